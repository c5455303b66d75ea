#include "someip/core/update_schedule.hpp"

namespace trestle::someip {

bool UpdateSchedule::on_value(bool differs, TimePoint now) noexcept {
  if (rule_.cycle > Duration::zero() && !due_) {
    due_ = now + rule_.cycle;
    return true;  // the first of the cycle
  }
  return rule_.on_change && differs;
}

bool UpdateSchedule::on_time(TimePoint now) noexcept {
  if (!due_ || now < *due_) {
    return false;
  }
  // The interval is fixed: a late timer does not shift it, and after a stall no burst of updates follows.
  *due_ += ((now - *due_) / rule_.cycle + 1) * rule_.cycle;
  return true;
}

}  // namespace trestle::someip
