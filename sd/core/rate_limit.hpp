#pragma once
#include "someip/core/guards.hpp"
#include "someip/wire/types.hpp"

namespace trestle::sd {

/// How much may come in a row, and how often after that.
class RateLimit {
 public:
  /// @param pause    between two, on average
  /// @param at_once  how many may come without any pause
  /// @return false when `cost` are too many now: they don't count then. Never, without guards.
  [[nodiscard]] bool take(TimePoint now, Duration pause, std::uint32_t at_once,
                          std::uint32_t cost = 1) noexcept {
    if constexpr (guards) {
      const TimePoint next = (is_due(free_at_, now) ? now : free_at_) + pause * cost;
      if (!is_due(next, now + pause * at_once)) {
        return false;
      }
      free_at_ = next;
    }
    return true;
  }

 private:
  TimePoint free_at_{};  // when all that has come would be over, had it come at the allowed pace
};

}  // namespace trestle::sd
