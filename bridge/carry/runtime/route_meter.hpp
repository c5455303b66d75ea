#pragma once
#include <array>
#include <chrono>
#include <memory>

#include "bridge/carry/runtime/route_clock.hpp"
#include "bridge/picture/picture.hpp"
#include "bridge/statistics/histogram.hpp"
#include "bridge/statistics/rate.hpp"
#include "someip/wire/header.hpp"

namespace trestle::carry {

/// When a message was where.
struct MessageTimes {
  RouteClock::TimePoint came;    ///< received as a whole
  RouteClock::TimePoint before;  ///< its conversion
  RouteClock::TimePoint after;
  RouteClock::TimePoint sent;           ///< handed on
  std::chrono::nanoseconds source{-1};  ///< since it was written, as its source says; negative: unknown
  std::size_t bytes = 0;                ///< converted
  someip::SessionId session{};
};

/// How fast a route is, and how long its messages take: noted with each message, on one thread, and read
/// there when somebody asks. Noting costs some ten nanoseconds; 5 KB of memory come with the first message.
class RouteMeter {
 public:
  /// One of the slowest.
  static constexpr std::size_t most_slow = 4;
  /// They are those of the present minute and of the one before.
  static constexpr std::chrono::minutes slow_for{1};

  void came(RouteClock::TimePoint now) noexcept { came_ = now; }
  void carried(const MessageTimes& times);
  /// Of a message that is not converted, or whose times do not matter.
  void carried(RouteClock::TimePoint now, std::size_t bytes) noexcept {
    carried_ = now;
    rate_.note(now, bytes);
  }

  /// Fills in what it knows.
  /// @param came  of the last message, if it was not noted here.
  void fill(RoutePicture& picture, const RouteClock& clock, RouteClock::TimePoint came = {}) const;

 private:
  /// The slowest of some time, in no order.
  struct Slowest {
    RouteClock::TimePoint start{};
    std::size_t count = 0;
    std::array<MessageTimes, most_slow> messages{};
  };
  struct Detail {
    statistics::Histogram conversion{statistics::Histogram::coarse};
    statistics::Histogram path{statistics::Histogram::coarse};
    Slowest now{};
    Slowest before{};
  };
  static void note(Detail& detail, const MessageTimes& times);

  RouteClock::TimePoint came_{};
  RouteClock::TimePoint carried_{};
  statistics::Rate rate_;
  std::unique_ptr<Detail> detail_;
};

}  // namespace trestle::carry
