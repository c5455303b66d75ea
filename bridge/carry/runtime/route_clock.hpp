#pragma once
#include <chrono>
#include <functional>
#include <memory>
#include <optional>

#include "bridge/carry/runtime/interface.hpp"

namespace boost::asio {
class io_context;
}

namespace trestle::carry {

/// Calls back at a time. Made by a RouteClock; after its end nothing is called back.
class RouteTimer : public Interface {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  /// It calls back at this time, or soon after, and at no time that was set before. Never from within set().
  virtual void set(TimePoint when) = 0;
  /// It does not call back.
  virtual void cancel() = 0;
  /// When it is going to call back, if it is.
  [[nodiscard]] virtual std::optional<TimePoint> armed() const = 0;
};

/// What the routes of a bridge know of time. Tests have a virtual one, in which an hour takes no time.
class RouteClock : public Interface {
 public:
  using TimePoint = RouteTimer::TimePoint;

  /// From any thread.
  [[nodiscard]] virtual TimePoint now() const = 0;
  /// The time of day, since 1970, with which DDS stamps samples.
  [[nodiscard]] virtual std::chrono::nanoseconds since_1970() const = 0;
  /// @param due  is called on the thread that runs the io_context. It may end the timer.
  [[nodiscard]] virtual std::unique_ptr<RouteTimer> timer(std::function<void()> due) = 0;
};

/// The clock of this machine.
/// @param io  outlives the result and its timers.
[[nodiscard]] std::unique_ptr<RouteClock> clock_of(boost::asio::io_context& io);

}  // namespace trestle::carry
