#pragma once
#include <algorithm>
#include <array>
#include <cstdint>

#include "sd/core/rate_limit.hpp"

namespace trestle::sd {

/// The last clients that were asked whether they hear us, did not answer and were forgotten since; and how
/// often such clients may change who has a place, or are answered at all. So a flood that goes round and
/// round among many addresses costs little.
class KnownFailures {
 public:
  /// @param mark  of the client, with which nobody can foresee which others share it
  [[nodiscard]] bool has(std::uint32_t mark) const noexcept {
    return std::ranges::find(marks_, mark) != marks_.end();
  }
  /// In place of the oldest one.
  void add(std::uint32_t mark) noexcept {
    if (!has(mark)) {
      marks_[next_++ % marks_.size()] = mark;
    }
  }
  /// Whether one of them may take the place of another one.
  [[nodiscard]] bool may_displace(TimePoint now) noexcept {
    return displacing_.take(now, std::chrono::milliseconds{100}, 5);
  }
  /// Whether one more message may be sent to those that have no place.
  [[nodiscard]] bool may_be_sent(TimePoint now) noexcept {
    return sending_.take(now, std::chrono::milliseconds{5}, 50);
  }

 private:
  std::array<std::uint32_t, 512> marks_{};
  std::uint32_t next_ = 0;
  RateLimit displacing_;
  RateLimit sending_;
};

}  // namespace trestle::sd
