#pragma once
#include <algorithm>
#include <chrono>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "someip/wire/types.hpp"

namespace trestle::sd {

/// Those who wait until there is room for what they want to send. They are asked about again and again, at
/// first after a millisecond, then less often: room comes in many ways, as messages leave or give way, and
/// as connections, subscriptions and offers end.
class RoomWatch {
 public:
  static constexpr Duration first_pause = std::chrono::milliseconds{1};
  static constexpr Duration longest_pause = std::chrono::milliseconds{16};

  /// @param is_full  whether there is still no room.
  /// @param told     is handed out once there is.
  void add(std::function<bool()> is_full, std::function<void()> told, TimePoint now) {
    waiting_.push_back({std::move(is_full), std::move(told)});
    pause_ = first_pause;
    next_ = now;
  }
  /// Those who are to be told now, in the order in which they came.
  [[nodiscard]] std::vector<std::function<void()>> on_time(TimePoint now) {
    std::vector<std::function<void()>> told;
    if (now < next_) {
      return told;
    }
    std::erase_if(waiting_, [&](Waiting& one) {
      const bool is_over = !one.is_full();
      if (is_over) {
        told.push_back(std::move(one.told));
      }
      return is_over;
    });
    next_ = now + pause_;
    pause_ = std::min(2 * pause_, longest_pause);
    return told;
  }
  /// Nobody waits: nothing.
  [[nodiscard]] std::optional<TimePoint> deadline() const {
    return waiting_.empty() ? std::nullopt : std::optional{next_};
  }

 private:
  struct Waiting {
    std::function<bool()> is_full;
    std::function<void()> told;
  };
  std::vector<Waiting> waiting_;
  Duration pause_ = first_pause;
  TimePoint next_{};
};

}  // namespace trestle::sd
