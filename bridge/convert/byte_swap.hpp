#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace trestle::bridge {

/// The number with its bytes in reverse order.
[[nodiscard]] constexpr std::uint16_t swapped(std::uint16_t number) noexcept {
  return __builtin_bswap16(number);
}
[[nodiscard]] constexpr std::uint32_t swapped(std::uint32_t number) noexcept {
  return __builtin_bswap32(number);
}
[[nodiscard]] constexpr std::uint64_t swapped(std::uint64_t number) noexcept {
  return __builtin_bswap64(number);
}

/// Instructions that reverse many numbers at once, the slowest first.
enum class Shuffle : std::uint8_t { none, avx2, avx512 };
/// The quickest of this processor, which has those before it, too.
extern const Shuffle best_shuffle;

/// Copies `count` numbers of `width` bytes (2, 4 or 8) and reverses the bytes of each. The two places need
/// no alignment and must not overlap.
void copy_swapped(std::byte* to, const std::byte* from, std::size_t count, std::size_t width,
                  Shuffle shuffle = best_shuffle) noexcept;

/// Copies few numbers of `width` bytes (1, 2, 4 or 8), and reverses the bytes of each if `swap`.
__attribute__((always_inline)) inline void copy_few_numbers(std::byte* to, const std::byte* from,
                                                            std::size_t count, std::size_t width,
                                                            bool swap) noexcept {
  const auto copy = [&](auto number) {
    for (std::size_t i = 0; i < count; ++i, from += sizeof number, to += sizeof number) {
      std::memcpy(&number, from, sizeof number);
      if constexpr (sizeof number > 1) {
        number = swap ? swapped(number) : number;
      }
      std::memcpy(to, &number, sizeof number);
    }
  };
  switch (width) {
    case 1:
      return copy(std::uint8_t{});
    case 2:
      return copy(std::uint16_t{});
    case 4:
      return copy(std::uint32_t{});
    default:
      return copy(std::uint64_t{});
  }
}

}  // namespace trestle::bridge
