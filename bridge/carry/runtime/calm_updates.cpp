#include "bridge/carry/runtime/calm_updates.hpp"

#include <algorithm>
#include <utility>

namespace trestle::carry {

CalmUpdates::CalmUpdates(RouteClock& clock, std::function<bool()> update)
    : clock_{clock}, filled_{clock.now()}, look_{clock.timer([this, update = std::move(update)] {
        if (update()) {
          --changes_left_;
        }
      })} {}

void CalmUpdates::look_soon() {
  if (look_->armed()) {
    return;
  }
  const auto now = clock_.now();
  const auto grown = std::min<std::int64_t>((now - filled_) / pause, at_once - changes_left_);
  changes_left_ += static_cast<int>(grown);
  filled_ = changes_left_ == at_once ? now : filled_ + grown * pause;
  look_->set(changes_left_ > 0 ? now : filled_ + pause);
}

}  // namespace trestle::carry
