#pragma once
#include "sd/core/offer_schedule.hpp"

namespace trestle::sd {

/// When the multicast Finds of one required service are due. As an OfferSchedule, but silent in the main
/// phase.  [feat_req_someipsd_866]
class FindSchedule {
 public:
  /// Down: nothing is due.
  FindSchedule() = default;
  /// Enters the initial wait phase; the first Find is due at `first`.
  FindSchedule(const Timing& timing, TimePoint first) noexcept;

  /// Advances to `now`; true when a FindService entry is to be sent now.
  bool on_time(TimePoint now) noexcept;
  /// The service is offered: to the main phase.  [feat_req_someipsd_867]
  void found() noexcept;
  /// Instances of a service are offered, but there may be more: only the first Find, if it has not been sent,
  /// stays due.  [feat_req_someipsd_239]
  void found_some() noexcept;

  [[nodiscard]] std::optional<TimePoint> deadline() const noexcept { return due_; }
  [[nodiscard]] Phase phase() const noexcept { return phase_; }

 private:
  Phase phase_ = Phase::down;
  std::uint8_t repetitions_left_ = 0;
  Duration repetition_delay_{};
  std::optional<TimePoint> due_;
};

}  // namespace trestle::sd
