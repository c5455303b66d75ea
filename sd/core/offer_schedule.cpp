#include "sd/core/offer_schedule.hpp"

namespace trestle::sd {

TimePoint end_of(std::uint32_t ttl_s, TimePoint since) noexcept {
  return ttl_s == infinite_ttl_s ? never : since + std::chrono::seconds{ttl_s};
}

void OfferSchedule::start(const Timing& timing, TimePoint first, Duration cyclic_delay) noexcept {
  phase_ = Phase::initial_wait;
  repetitions_left_ = timing.repetitions_max;
  repetition_delay_ = timing.repetitions_base_delay;
  cyclic_delay_ = cyclic_delay;
  due_ = first;
}

bool OfferSchedule::on_time(TimePoint now) noexcept {
  if (!is_due(due_, now)) {
    return false;
  }
  // Waits start when the offer is really sent, not at the missed deadline: after a stall of the host there
  // must be no burst of offers.  [feat_req_someipsd_81]
  if (repetitions_left_ > 0) {
    phase_ = Phase::repetition;
    due_ = now + repetition_delay_;
    repetition_delay_ = doubled(repetition_delay_);
    --repetitions_left_;
  } else {
    // Also reached from the initial wait when REPETITIONS_MAX is 0  [feat_req_someipsd_74]. The example in
    // _77 waits for another doubled delay and sends as soon as this phase begins, but requirement _80 waits
    // for one CYCLIC_OFFER_DELAY first: we follow the requirement.
    phase_ = Phase::main;
    due_ = cyclic_delay_.count() > 0 ? now + cyclic_delay_ : never;
  }
  return true;
}

void FindSchedule::found() noexcept {
  phase_ = Phase::main;
  due_ = never;
}

void FindSchedule::found_some() noexcept {
  if (phase_ == Phase::initial_wait) {
    repetitions_left_ = 0;
  } else {
    found();
  }
}

}  // namespace trestle::sd
