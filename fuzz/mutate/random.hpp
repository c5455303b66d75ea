#pragma once
#include <cstddef>
#include <cstdint>
#include <iterator>

namespace trestle::fuzz {

/// Numbers that a seed decides (SplitMix64): the same seed, the same inputs.
class Random {
 public:
  /// @param seed  any number.
  explicit constexpr Random(std::uint64_t seed) noexcept : state_{seed} {}

  /// Any number.
  constexpr std::uint64_t next() noexcept {
    state_ += 0x9e37'79b9'7f4a'7c15U;
    std::uint64_t mixed = state_;
    mixed = (mixed ^ (mixed >> 30U)) * 0xbf58'476d'1ce4'e5b9U;
    mixed = (mixed ^ (mixed >> 27U)) * 0x94d0'49bb'1331'11ebU;
    return mixed ^ (mixed >> 31U);
  }

  /// @return a number from 0 to `count` - 1; 0 when `count` is 0.
  constexpr std::size_t below(std::size_t count) noexcept {
    return count == 0 ? 0 : static_cast<std::size_t>(next() % count);
  }

  /// @return true in `percent` of 100 cases.
  constexpr bool chance(unsigned percent) noexcept { return below(100) < percent; }

  /// @return one of the elements; `of` must not be empty.
  template <typename Range>
  constexpr const auto& pick(const Range& of) noexcept {
    return *std::next(std::begin(of), static_cast<std::ptrdiff_t>(below(std::size(of))));
  }

 private:
  std::uint64_t state_;
};

}  // namespace trestle::fuzz
