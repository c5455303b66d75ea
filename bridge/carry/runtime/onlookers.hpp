#pragma once
#include <chrono>
#include <memory>
#include <vector>

#include "bridge/carry/runtime/route_clock.hpp"
#include "bridge/picture/seen_message.hpp"
#include "someip/wire/types.hpp"

namespace trestle::carry {

class RunningRoute;

/// Keeps a copy of the newest message of one route.
class Onlooker {
 public:
  /// Larger messages are not copied.
  static constexpr std::size_t most_bytes = std::size_t{32} << 20U;
  /// Messages of more bytes than these are copied only so often.
  static constexpr std::size_t often_bytes = std::size_t{64} << 10U;
  static constexpr std::chrono::milliseconds spacing{50};

  explicit Onlooker(const RouteClock& clock) : clock_{clock} {}

  void keep_sample(ByteView cdr) { keep(true, cdr); }
  void keep_payload(ByteView payload) { keep(false, payload); }

  /// Null: none has come since somebody looks.
  [[nodiscard]] const std::shared_ptr<const SeenMessage>& newest() const noexcept { return newest_; }

 private:
  void keep(bool is_cdr, ByteView bytes);

  const RouteClock& clock_;
  std::shared_ptr<const SeenMessage> newest_;
  RouteClock::TimePoint next_{};
};

/// Lets people look at messages: from the first question about a route until some seconds after the last one
/// its newest message is kept. A route that nobody looks at tests a pointer for that, and no more.
class Onlookers {
 public:
  static constexpr std::chrono::seconds look_for{5};
  /// So many routes are looked at at once. With one more the longest not asked for is no longer.
  static constexpr std::size_t most_routes = 4;

  /// @param clock  outlives it.
  explicit Onlookers(RouteClock& clock);
  /// No route carries anything any more.
  ~Onlookers();
  Onlookers(const Onlookers&) = delete;
  Onlookers& operator=(const Onlookers&) = delete;

  /// The newest message; null: none has come since somebody looks.
  [[nodiscard]] std::shared_ptr<const SeenMessage> look(const std::shared_ptr<RunningRoute>& route);

  /// Routes that are looked at now.
  [[nodiscard]] std::size_t size() const noexcept { return looks_.size(); }

 private:
  struct Look {
    std::weak_ptr<RunningRoute> route;
    std::unique_ptr<Onlooker> onlooker;
    RouteClock::TimePoint until;
  };
  static void end(const Look& look);
  void end_those_that_are_over();

  RouteClock& clock_;
  std::vector<Look> looks_;
  std::unique_ptr<RouteTimer> over_;
};

}  // namespace trestle::carry
