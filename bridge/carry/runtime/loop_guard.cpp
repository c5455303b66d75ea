#include "bridge/carry/runtime/loop_guard.hpp"

#include <spdlog/spdlog.h>

#include <utility>

namespace trestle::carry {
namespace {

constexpr std::chrono::seconds pause_between_lines{10};

std::unique_lock<std::mutex> held(std::mutex* mutex) {
  return mutex != nullptr ? std::unique_lock{*mutex} : std::unique_lock<std::mutex>{};
}

}  // namespace

LoopGuard::LoopGuard(RouteClock& clock, std::string what, const LoopCheck::Limits& limits, std::mutex* mutex)
    : clock_{clock}, what_{std::move(what)}, mutex_{mutex}, check_{limits}, trial_end_{clock.timer([this] {
        judge();
      })} {}

void LoopGuard::arm() {
  if (trial_end_->armed()) {
    return;
  }
  const auto lock = held(mutex_);
  if (check_.deadline()) {
    trial_end_->set(*check_.deadline());
  }
}

void LoopGuard::judge() {
  const auto now = clock_.now();
  std::string through;
  {
    const auto lock = held(mutex_);
    if (!check_.judge(now)) {
      on_trial_ = check_.deadline().has_value();
      return;
    }
    on_trial_ = false;
    through = through_;
  }
  if (!told_ || now - *told_ >= pause_between_lines) {
    told_ = now;
    spdlog::error(
        "{}: this route seems to loop through {}: what it carries comes back from there. It is kept from "
        "going round for long, and counted as `looped`; end the ring (docs/several_bridges.md)",
        what_, through);
  }
}

}  // namespace trestle::carry
