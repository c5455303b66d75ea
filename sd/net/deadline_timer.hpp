#pragma once
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <optional>

#include "someip/wire/types.hpp"

namespace trestle::sd {

/// Calls back when the deadline of a state machine has come.
class DeadlineTimer {
 public:
  /// @param due  never called after the timer's destruction, nor from within arm().
  DeadlineTimer(boost::asio::io_context& io, std::function<void()> due)
      : timer_{io}, due_{std::make_shared<std::function<void()>>(std::move(due))} {}

  /// The deadline may have moved: cheap when it has not.
  void arm(std::optional<TimePoint> deadline) {
    if (deadline == armed_) {
      return;
    }
    armed_ = deadline;
    if (!deadline) {
      timer_.cancel();
      return;
    }
    timer_.expires_at(*deadline);
    timer_.async_wait([this, weak = std::weak_ptr{due_}](const boost::system::error_code& error) {
      const auto due = weak.lock();
      if (!error && due) {
        armed_.reset();
        (*due)();
      }
    });
  }

  [[nodiscard]] std::optional<TimePoint> armed() const noexcept { return armed_; }

 private:
  boost::asio::steady_timer timer_;
  std::shared_ptr<std::function<void()>> due_;
  std::optional<TimePoint> armed_;
};

}  // namespace trestle::sd
