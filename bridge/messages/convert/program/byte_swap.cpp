#include "bridge/messages/convert/program/byte_swap.hpp"

#include <array>
#include <cassert>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace trestle::messages {
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

constexpr std::size_t avx2_block = 32;
constexpr std::size_t avx512_block = 64;

/// The source of each byte within its group of 16, for numbers of 2, 4 and 8 bytes.
constexpr auto sources = [] {
  std::array<std::array<std::uint8_t, avx512_block>, 3> from_byte{};
  for (std::size_t k = 0; k < from_byte.size(); ++k) {
    for (std::size_t i = 0; i < avx512_block; ++i) {
      from_byte[k][i] = static_cast<std::uint8_t>((i ^ ((2U << k) - 1)) % 16);
    }
  }
  return from_byte;
}();
/// For numbers of `width` bytes.
const void* sources_of(std::size_t width) noexcept {
  return sources[width / 4].data();
}

// Two similar functions: a template cannot choose between two instruction sets.
//
// From the first block boundary of the target on, no store crosses a cache line, if a number can begin at
// that boundary. Bytes before it are done by a block at the front that overlaps the next one, and the rest by
// a block that ends at the end. Four blocks per turn, because the speed of a loop with one block depends on
// where the linker puts it.

/// Reverses the bytes of each number.
/// @param bytes  at least a block.
__attribute__((target("avx2"))) void swap_avx2(std::byte* to, const std::byte* from, std::size_t bytes,
                                               std::size_t width) noexcept {
  constexpr std::size_t block = avx2_block;
  const __m256i shuffle = _mm256_loadu_si256(static_cast<const __m256i*>(sources_of(width)));
  const auto swap_block = [&](std::size_t at) __attribute__((target("avx2"), always_inline)) {
    const void* const source = from + at;
    void* const target = to + at;
    const __m256i numbers = _mm256_loadu_si256(static_cast<const __m256i*>(source));
    _mm256_storeu_si256(static_cast<__m256i*>(target), _mm256_shuffle_epi8(numbers, shuffle));
  };
  std::size_t done = 0;
  const std::size_t to_boundary = (0 - reinterpret_cast<std::uintptr_t>(to)) & (block - 1);
  if (to_boundary % width == 0) {
    swap_block(0);
    done = to_boundary;
  }
  for (; bytes - done >= 4 * block; done += 4 * block) {
    swap_block(done);
    swap_block(done + block);
    swap_block(done + 2 * block);
    swap_block(done + 3 * block);
  }
  for (; bytes - done >= block; done += block) {
    swap_block(done);
  }
  if (done != bytes) {
    swap_block(bytes - block);
  }
}

/// The same with half as many instructions.
__attribute__((target("avx512bw"))) void swap_avx512(std::byte* to, const std::byte* from, std::size_t bytes,
                                                     std::size_t width) noexcept {
  constexpr std::size_t block = avx512_block;
  const __m512i shuffle = _mm512_loadu_si512(sources_of(width));
  const auto swap_block = [&](std::size_t at) __attribute__((target("avx512bw"), always_inline)) {
    _mm512_storeu_si512(to + at, _mm512_shuffle_epi8(_mm512_loadu_si512(from + at), shuffle));
  };
  std::size_t done = 0;
  const std::size_t to_boundary = (0 - reinterpret_cast<std::uintptr_t>(to)) & (block - 1);
  if (to_boundary % width == 0) {
    swap_block(0);
    done = to_boundary;
  }
  for (; bytes - done >= 4 * block; done += 4 * block) {
    swap_block(done);
    swap_block(done + block);
    swap_block(done + 2 * block);
    swap_block(done + 3 * block);
  }
  for (; bytes - done >= block; done += block) {
    swap_block(done);
  }
  if (done != bytes) {
    swap_block(bytes - block);
  }
}

Shuffle found() noexcept {
  const bool in_halves = __builtin_cpu_is("amdfam19h") != 0;  // Zen 4 does 64 bytes as twice 32
  return __builtin_cpu_supports("avx512bw") != 0 && !in_halves ? Shuffle::avx512
         : __builtin_cpu_supports("avx2") != 0                 ? Shuffle::avx2
                                                               : Shuffle::none;
}

#else

Shuffle found() noexcept {
  return Shuffle::none;
}

#endif

}  // namespace

const Shuffle best_shuffle = found();

void copy_swapped(std::byte* to, const std::byte* from, std::size_t count, std::size_t width,
                  Shuffle shuffle) noexcept {
  assert(width == 2 || width == 4 || width == 8);
#if defined(__x86_64__)
  const std::size_t bytes = count * width;
  if (bytes >= avx2_block && shuffle != Shuffle::none) {
    return shuffle == Shuffle::avx512 && bytes >= 4 * avx512_block ? swap_avx512(to, from, bytes, width)
                                                                   : swap_avx2(to, from, bytes, width);
  }
#else
  static_cast<void>(shuffle);
#endif
  switch (width) {
    case 2:
      return swap_each<std::uint16_t>(to, from, count);
    case 4:
      return swap_each<std::uint32_t>(to, from, count);
    default:
      return swap_each<std::uint64_t>(to, from, count);
  }
}

}  // namespace trestle::messages
