#pragma once
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "bridge/carry/runtime/route_clock.hpp"
#include "bridge/picture/seen_message.hpp"
#include "someip/wire/types.hpp"

namespace trestle::carry {

class RunningRoute;

/// Keeps a copy of the newest message of one route, and shows each to those who follow it.
class Onlooker {
 public:
  /// Larger messages are not copied.
  static constexpr std::size_t most_bytes = std::size_t{32} << 20U;
  /// Messages of more bytes than these are copied only so often, unless somebody follows.
  static constexpr std::size_t often_bytes = std::size_t{64} << 10U;
  static constexpr std::chrono::milliseconds spacing{50};

  explicit Onlooker(const RouteClock& clock) : clock_{clock} {}

  void keep_sample(ByteView cdr) { keep(true, cdr); }
  void keep_payload(ByteView payload) { keep(false, payload); }

  /// Whether the newest message is kept. It is not for those who follow alone: they may follow a thousand
  /// routes.
  void ask(bool is_asked);
  /// Null: none has come since somebody asks.
  [[nodiscard]] const std::shared_ptr<const SeenMessage>& newest() const noexcept { return newest_; }

  /// @return by which it is removed.
  std::uint64_t add(MessageSink sink) {
    sinks_.emplace(++last_, std::move(sink));
    return last_;
  }
  void remove(std::uint64_t sink) { sinks_.erase(sink); }
  [[nodiscard]] bool is_followed() const noexcept { return !sinks_.empty(); }

 private:
  void keep(bool is_cdr, ByteView bytes);

  const RouteClock& clock_;
  bool is_asked_ = false;
  std::shared_ptr<const SeenMessage> newest_;
  RouteClock::TimePoint next_{};
  std::map<std::uint64_t, MessageSink> sinks_;
  std::uint64_t last_ = 0;
};

/// Lets people look at messages: from the first question about a route until some seconds after the last one
/// its newest message is kept; and each is shown to those who follow the route. A route that nobody looks at
/// tests a pointer for that, and no more.
class Onlookers {
 public:
  static constexpr std::chrono::seconds look_for{5};
  /// So many routes are asked about at once. With one more the longest not asked for is no longer.
  static constexpr std::size_t most_routes = 4;

  /// @param clock  outlives it.
  explicit Onlookers(RouteClock& clock);
  /// No route carries anything any more.
  ~Onlookers();
  Onlookers(const Onlookers&) = delete;
  Onlookers& operator=(const Onlookers&) = delete;

  /// The newest message; null: none has come since somebody looks.
  [[nodiscard]] std::shared_ptr<const SeenMessage> look(const std::shared_ptr<RunningRoute>& route);

  /// Shows each message to `sink` from now on, until what is returned ends, or the route, or this.
  [[nodiscard]] std::shared_ptr<void> follow(const std::shared_ptr<RunningRoute>& route, MessageSink sink);

  /// Routes that are looked at or followed now.
  [[nodiscard]] std::size_t size() const noexcept { return looks_.size(); }

 private:
  struct Look {
    std::weak_ptr<RunningRoute> route;
    std::unique_ptr<Onlooker> onlooker;
    std::optional<RouteClock::TimePoint> until{};  ///< of those who ask; nothing: nobody does
  };
  struct Following;
  [[nodiscard]] Look* look_of(const std::shared_ptr<RunningRoute>& route);
  Look& begin(const std::shared_ptr<RunningRoute>& route);
  static void end(const Look& look);
  void make_room();
  void end_those_that_are_over();

  RouteClock& clock_;
  std::vector<Look> looks_;
  std::unique_ptr<RouteTimer> over_;
  std::shared_ptr<Onlookers*> self_ = std::make_shared<Onlookers*>(this);  ///< for those who follow longer
};

}  // namespace trestle::carry
