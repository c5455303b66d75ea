#pragma once
#include "sd/core/offer_schedule.hpp"

namespace trestle::sd {

/// When the multicast Finds of one required service are due. As an OfferSchedule, but silent in the main
/// phase.  [feat_req_someipsd_866]
class FindSchedule : public OfferSchedule {
 public:
  /// Enters the initial wait phase; the first Find is due at `first`. Before, it is down: nothing is due.
  void start(const Timing& timing, TimePoint first) noexcept {
    OfferSchedule::start(timing, first, Duration{0});
  }

  /// The service is offered: to the main phase.  [feat_req_someipsd_867]
  void found() noexcept;
  /// Instances of a service are offered, but there may be more: only the first Find, if it has not been sent,
  /// stays due.  [feat_req_someipsd_239]
  void found_some() noexcept;
};

}  // namespace trestle::sd
