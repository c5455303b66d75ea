#pragma once
#include "sd/core/settings.hpp"

namespace trestle::sd {

/// Stands for "no deadline".
inline constexpr TimePoint never = TimePoint::max();

/// The phases of offering or finding one service.  [feat_req_someipsd_68]
enum class Phase : std::uint8_t {
  down,  ///< nothing is sent: the link is down, or what was looked for has been stopped
  initial_wait,
  repetition,
  main,
};

/// When what was said at `since` for `ttl_s` seconds is over.
[[nodiscard]] TimePoint end_of(std::uint32_t ttl_s, TimePoint since) noexcept;

/// When the multicast offers of one service instance are due.
class OfferSchedule {
 public:
  /// Enters the initial wait phase; the first offer is due at `first`. Before, it is down: nothing is due.
  void start(const Timing& timing, TimePoint first) noexcept {
    start(timing, first, timing.cyclic_offer_delay);
  }

  /// Advances to `now`; true when an OfferService entry is to be sent now.
  /// Early and repeated calls change nothing, so a driver's timer need not be exact.
  bool on_time(TimePoint now) noexcept;

  /// When on_time() has something to do; or never.
  [[nodiscard]] TimePoint deadline() const noexcept { return due_; }
  [[nodiscard]] Phase phase() const noexcept { return phase_; }

 protected:
  void start(const Timing& timing, TimePoint first, Duration cyclic_delay) noexcept;

  Phase phase_ = Phase::down;
  std::uint8_t repetitions_left_ = 0;
  Duration repetition_delay_{};
  Duration cyclic_delay_{};
  TimePoint due_ = never;
};

/// The wait after the next repetition.  [feat_req_someipsd_76]
[[nodiscard]] constexpr Duration doubled(Duration delay) noexcept {
  // The bound keeps a REPETITIONS_MAX of 255 from overflowing; nobody waits that long.
  constexpr Duration longest = std::chrono::hours{24 * 365};
  return delay.count() > longest.count() / 2 ? longest : 2 * delay;
}

/// When the multicast Finds of a required service are due. As an OfferSchedule, but silent in the main phase.
/// [feat_req_someipsd_866]
class FindSchedule : public OfferSchedule {
 public:
  /// Enters the initial wait phase; the first Find is due at `first`. Before, it is down: nothing is due.
  void start(const Timing& timing, TimePoint first) noexcept {
    OfferSchedule::start(timing, first, Duration{0});
  }

  /// The service is offered: to the main phase.  [feat_req_someipsd_867]
  void found() noexcept;
  /// Instances are offered, maybe not all: only an unsent first Find stays due.  [feat_req_someipsd_239]
  void found_some() noexcept;
};

}  // namespace trestle::sd
