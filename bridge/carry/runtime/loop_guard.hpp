#pragma once
#include <memory>
#include <mutex>
#include <string>

#include "bridge/carry/runtime/loop_check.hpp"
#include "bridge/carry/runtime/route_clock.hpp"

namespace trestle::carry {

/// Keeps a route from carrying the same messages round and round, and tells of it: a LoopCheck with a timer
/// and a log. On the thread that runs the io_context, but for may_carry() if there is a mutex.
class LoopGuard {
 public:
  /// @param what   the route, for the log.
  /// @param mutex  held by callers of may_carry() and looped(); nothing: one thread does all.
  LoopGuard(RouteClock& clock, std::string what, const LoopCheck::Limits& limits = {},
            std::mutex* mutex = nullptr);
  LoopGuard(const LoopGuard&) = delete;
  LoopGuard& operator=(const LoopGuard&) = delete;

  /// As LoopCheck's; counts what may not be carried.
  /// @param through  gives words for where the message came from; only called when they are needed.
  template <typename Through>
  [[nodiscard]] bool may_carry(std::uint64_t hash, std::optional<std::uint64_t> from,
                               LoopCheck::TimePoint now, const Through& through) {
    if (check_.may_carry(hash, from, now)) {
      return true;
    }
    if (!on_trial_) {
      on_trial_ = true;
      through_ = through();
    }
    ++looped_;
    return false;
  }
  [[nodiscard]] bool is_repeat(std::uint64_t hash, LoopCheck::TimePoint now) const noexcept {
    return check_.is_repeat(hash, now);
  }

  /// To be called soon after a message was not to be carried: has a timer end the trial.
  void arm();
  /// Messages that were not carried.
  [[nodiscard]] std::uint64_t looped() const noexcept { return looped_; }

 private:
  void judge();

  const RouteClock& clock_;
  const std::string what_;
  std::mutex* const mutex_;
  LoopCheck check_;
  bool on_trial_ = false;
  std::string through_;
  std::uint64_t looped_ = 0;
  std::optional<LoopCheck::TimePoint> told_;
  const std::unique_ptr<RouteTimer> trial_end_;
};

}  // namespace trestle::carry
