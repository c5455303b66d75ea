#include "bridge/carry/runtime/calm_updates.hpp"

#include <algorithm>
#include <utility>

namespace trestle::carry {

CalmUpdates::CalmUpdates(RouteClock& clock, std::function<bool()> update)
    : clock_{clock}, update_{std::move(update)}, filled_{clock.now()}, look_{clock.timer([this] {
        look();
      })} {}

void CalmUpdates::look() {
  if (update_()) {
    --changes_left_;
  }
}

void CalmUpdates::look_if_due() {
  if (look_->armed() && changes_left_ > 0) {
    look_->cancel();
    look();
  }
}

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
