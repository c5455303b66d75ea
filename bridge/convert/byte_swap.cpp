#include "bridge/convert/byte_swap.hpp"

#include <array>
#include <cassert>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace trestle::bridge {
namespace {

/// Compilers make vector code of this only where the baseline instruction set has byte shuffles: on Arm, but
/// not on x86-64.
template <typename Number>
void swap_each(std::byte* to, const std::byte* from, std::size_t count) noexcept {
  for (std::size_t i = 0; i < count; ++i) {
    Number number;
    std::memcpy(&number, from + i * sizeof(Number), sizeof(Number));
    number = swapped(number);
    std::memcpy(to + i * sizeof(Number), &number, sizeof(Number));
  }
}

#if defined(__x86_64__)

/// Reverses the bytes of each number in whole blocks of 32 bytes.
/// @return bytes done, at the front.
__attribute__((target("avx2"))) std::size_t swap_blocks(std::byte* to, const std::byte* from,
                                                        std::size_t bytes, std::size_t width) noexcept {
  // Where each byte of 16 comes from.
  alignas(16) std::array<std::uint8_t, 16> from_byte;
  for (std::size_t i = 0; i < from_byte.size(); ++i) {
    from_byte[i] = static_cast<std::uint8_t>(i ^ (width - 1));
  }
  const void* const order = from_byte.data();
  const __m256i shuffle = _mm256_broadcastsi128_si256(_mm_load_si128(static_cast<const __m128i*>(order)));
  constexpr std::size_t block = 32;
  const auto swap_block = [&](std::size_t at) __attribute__((target("avx2"), always_inline)) {
    const void* const source = from + at;
    void* const target = to + at;
    const __m256i numbers = _mm256_loadu_si256(static_cast<const __m256i*>(source));
    _mm256_storeu_si256(static_cast<__m256i*>(target), _mm256_shuffle_epi8(numbers, shuffle));
  };
  std::size_t done = 0;
  // From the first block boundary of the target on no store crosses two lines of the cache, if numbers can be
  // there: what is before it is done once more by the block at the front.
  const std::size_t to_boundary = (0 - reinterpret_cast<std::uintptr_t>(to)) & (block - 1);
  if (bytes >= block && to_boundary % width == 0) {
    swap_block(0);
    done = to_boundary;
  }
  // Four a turn: how fast a loop of one is depends on where the linker puts it.
  for (; bytes - done >= 4 * block; done += 4 * block) {
    swap_block(done);
    swap_block(done + block);
    swap_block(done + 2 * block);
    swap_block(done + 3 * block);
  }
  for (; bytes - done >= block; done += block) {
    swap_block(done);
  }
  return done;
}

const bool has_avx2 = __builtin_cpu_supports("avx2") != 0;

#endif

}  // namespace

void copy_swapped(std::byte* to, const std::byte* from, std::size_t count, std::size_t width) noexcept {
  assert(width == 2 || width == 4 || width == 8);
#if defined(__x86_64__)
  if (count * width >= 64 && has_avx2) {
    const std::size_t done = swap_blocks(to, from, count * width, width);
    to += done;
    from += done;
    count -= done / width;
  }
#endif
  copy_swapped_singly(to, from, count, width);
}

void copy_swapped_singly(std::byte* to, const std::byte* from, std::size_t count,
                         std::size_t width) noexcept {
  switch (width) {
    case 2:
      return swap_each<std::uint16_t>(to, from, count);
    case 4:
      return swap_each<std::uint32_t>(to, from, count);
    default:
      return swap_each<std::uint64_t>(to, from, count);
  }
}

}  // namespace trestle::bridge
