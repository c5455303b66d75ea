#include "sd/core/find_schedule.hpp"

namespace trestle::sd {

FindSchedule::FindSchedule(const Timing& timing, TimePoint first) noexcept
    : phase_{Phase::initial_wait},
      repetitions_left_{timing.repetitions_max},
      repetition_delay_{timing.repetitions_base_delay},
      due_{first} {}

bool FindSchedule::on_time(TimePoint now) noexcept {
  if (!due_ || now < *due_) {
    return false;
  }
  if (repetitions_left_ > 0) {
    phase_ = Phase::repetition;
    due_ = now + repetition_delay_;
    repetition_delay_ = doubled(repetition_delay_);
    --repetitions_left_;
  } else {
    found();
  }
  return true;
}

void FindSchedule::found() noexcept {
  phase_ = Phase::main;
  due_.reset();
}

void FindSchedule::found_some() noexcept {
  if (phase_ == Phase::initial_wait) {
    repetitions_left_ = 0;
  } else {
    found();
  }
}

}  // namespace trestle::sd
