#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace trestle::messages {

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

/// Copies few bytes: for those a call of memcpy takes longer than the copy.
__attribute__((always_inline)) inline void copy_few_bytes(std::byte* to, const std::byte* from,
                                                          std::size_t size) noexcept {
  // Words, of which the last may overlap the one before.
  const auto copy = [=](auto word) __attribute__((always_inline)) {
    for (std::size_t at = 0;; at = std::min(at + sizeof word, size - sizeof word)) {
      std::memcpy(&word, from + at, sizeof word);
      std::memcpy(to + at, &word, sizeof word);
      if (at == size - sizeof word) {
        return;
      }
    }
  };
  if (size >= 8) {
    copy(std::uint64_t{});
  } else if (size >= 4) {
    copy(std::uint32_t{});
  } else if (size >= 2) {
    copy(std::uint16_t{});
  } else if (size == 1) {
    *to = *from;
  }
}

/// Copies few numbers of `width` bytes (1, 2, 4 or 8), and reverses the bytes of each if `swap`.
__attribute__((always_inline)) inline void copy_few_numbers(std::byte* to, const std::byte* from,
                                                            std::size_t count, std::size_t width,
                                                            bool swap) noexcept {
  const auto copy = [=](auto number) __attribute__((always_inline)) {
    for (std::size_t i = 0; i < count; ++i) {
      std::memcpy(&number, from + i * sizeof number, sizeof number);
      number = swapped(number);
      std::memcpy(to + i * sizeof number, &number, sizeof number);
    }
  };
  if (!swap || width == 1) {
    copy_few_bytes(to, from, count * width);
  } else if (width == 4) {
    copy(std::uint32_t{});
  } else if (width == 8) {
    copy(std::uint64_t{});
  } else {
    copy(std::uint16_t{});
  }
}

}  // namespace trestle::messages
