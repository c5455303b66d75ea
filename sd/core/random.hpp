#pragma once
#include "someip/wire/types.hpp"

namespace trestle::sd {

/// A small generator (SplitMix64) for delays; not for secrets. The same seed gives the same delays.
class Random {
 public:
  explicit constexpr Random(std::uint64_t seed) noexcept : state_{seed} {}

  constexpr std::uint64_t next() noexcept {
    state_ += 0x9e37'79b9'7f4a'7c15U;
    std::uint64_t mixed = state_;
    mixed = (mixed ^ (mixed >> 30U)) * 0xbf58'476d'1ce4'e5b9U;
    mixed = (mixed ^ (mixed >> 27U)) * 0x94d0'49bb'1331'11ebU;
    return mixed ^ (mixed >> 31U);
  }

  /// A duration from `min` to `max`, both included.  [feat_req_someipsd_64] [feat_req_someipsd_85]
  constexpr Duration between(Duration min, Duration max) noexcept {
    if (max <= min) {
      return min;
    }
    const auto width = static_cast<std::uint64_t>((max - min).count()) + 1;
    return min + Duration{static_cast<Duration::rep>(next() % width)};
  }

 private:
  std::uint64_t state_;
};

}  // namespace trestle::sd
