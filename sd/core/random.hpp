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
    if (max.count() <= min.count()) {
      return min;
    }
    const auto width = static_cast<std::uint64_t>((max - min).count()) + 1;
    // A fraction of the width, in units of 2^-32: small processors have no instruction for 64-bit remainders.
    const std::uint64_t fraction = next() >> 32U;
    const std::uint64_t drawn = (width >> 32U) * fraction + (((width & 0xffff'ffffU) * fraction) >> 32U);
    return min + Duration{static_cast<Duration::rep>(drawn)};
  }

 private:
  std::uint64_t state_;
};

}  // namespace trestle::sd
