#pragma once
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>
#include <optional>

#include "someip/wire/types.hpp"

namespace trestle::sd {

/// Calls back when the deadline of a state machine has come, or sooner: a deadline that moves away, as it
/// does with each call and each answer, leaves the system's timer as it is. So `due` has to ask the state
/// machine whether there is something to do, and to arm() anew.
class DeadlineTimer {
 public:
  /// @param due  never called after the timer's destruction, nor from within arm().
  DeadlineTimer(boost::asio::io_context& io, std::function<void()> due)
      : timer_{io}, due_{std::make_shared<std::function<void()>>(std::move(due))} {}

  /// The deadline may have moved. Costs something only when it is nearer than what is awaited.
  void arm(std::optional<TimePoint> deadline) {
    if (!deadline || (armed_ && *armed_ <= *deadline)) {
      return;
    }
    armed_ = deadline;
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
