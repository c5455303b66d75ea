#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "bridge/messages/convert/program/byte_swap.hpp"
#include "dds_adapter/copy_bytes.hpp"

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace trestle::messages::quick {

/// Bytes that copy_text() is quickest with.
inline constexpr std::size_t text_block = 32;

/// Copies the characters of a short string.
/// @param there  bytes that can be read and written, perhaps more than `size`.
/// @return whether there is no zero among them.
__attribute__((always_inline)) inline bool copy_text(std::byte* to, const std::byte* from, std::size_t size,
                                                     [[maybe_unused]] std::size_t there) noexcept {
#if defined(__SSE2__)
  // As much whatever the size: branches that depend on the sizes of texts are what takes longest.
  if (size < text_block && there >= text_block) {
    const auto half = [&](std::size_t at) __attribute__((always_inline)) {
      __m128i characters;
      std::memcpy(&characters, from + at, sizeof characters);
      std::memcpy(to + at, &characters, sizeof characters);
      return static_cast<std::uint32_t>(_mm_movemask_epi8(_mm_cmpeq_epi8(characters, _mm_setzero_si128())));
    };
    const std::uint32_t first = half(0);
    return ((first | half(16) << 16U) & ((std::uint32_t{1} << size) - 1)) == 0;
  }
#endif
  const auto zeros_of = [](std::uint64_t word) __attribute__((always_inline)) {
    return (word - 0x0101010101010101U) & ~word & 0x8080808080808080U;
  };
  std::uint64_t zero = 0;
  if (size >= 8) {
    const auto copy = [&](std::size_t at) __attribute__((always_inline)) {
      std::uint64_t word = 0;
      std::memcpy(&word, from + at, sizeof word);
      std::memcpy(to + at, &word, sizeof word);
      zero |= zeros_of(word);
    };
    std::size_t at = 0;
    for (; at < size - 8; at += 8) {
      copy(at);
    }
    copy(size - 8);  // may overlap
  } else if (size >= 4) {
    std::uint32_t front = 0;
    std::uint32_t back = 0;
    std::memcpy(&front, from, 4);
    std::memcpy(&back, from + size - 4, 4);
    std::memcpy(to, &front, 4);
    std::memcpy(to + size - 4, &back, 4);
    zero = zeros_of(std::uint64_t{front} << 32U | back);
  } else {
    for (std::size_t i = 0; i < size; ++i) {
      to[i] = from[i];
      zero |= from[i] == std::byte{0} ? 1U : 0U;
    }
  }
  return zero == 0;
}

/// Copies few booleans.
/// @return whether each of them is 0 or 1.
__attribute__((always_inline)) inline bool copy_bools(std::byte* to, const std::byte* from,
                                                      std::size_t count) noexcept {
  std::byte seen{0};
  for (std::size_t i = 0; i < count; ++i) {
    seen |= from[i];
    to[i] = from[i];
  }
  return seen <= std::byte{1};
}

/// Copies the numbers of an array, of `size` bytes together, and reverses the bytes of each if `swap`.
inline void copy_array(std::byte* to, const std::byte* from, std::size_t size, std::size_t width,
                       bool swap) noexcept {
  if (swap) {
    copy_swapped(to, from, size >> static_cast<unsigned>(std::countr_zero(width)), width);
  } else {
    copy_bytes(to, from, size);
  }
}

}  // namespace trestle::messages::quick
