#include "sd/core/find_schedule.hpp"

namespace trestle::sd {

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
