#include "dds_adapter/copy_bytes.hpp"

#include <cstdint>
#include <cstring>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace trestle {
namespace {

#if defined(__x86_64__)

// Between these the C library copies by "rep movsb", where it has that.
constexpr std::size_t from_bytes = 2048;
constexpr std::size_t to_bytes = 1024 * 1024;

bool can_copy_blocks() noexcept {
  return __builtin_cpu_supports("avx2") != 0;
}

/// AMD's Zen 3 and 4 take 15 to 25 times as long for that where the target begins less than 16 bytes behind
/// the source, as places within a page of 4 KB: so the data of a cloud may, behind its front, and then does
/// each time. Elsewhere blocks are as quick. (glibc has not known until 2.39, its bug 30994.)
bool is_slow() noexcept {
  return __builtin_cpu_is("amdfam19h") != 0;
}

/// Four at a time: a load must not wait for a store that seems to be to the same place. Blocks of 16 bytes
/// would be half as quick beside a busy neighbour on the same core, those of 64 are not quicker.
__attribute__((target("avx2"))) void copy_blocks(std::byte* to, const std::byte* from,
                                                 std::size_t size) noexcept {
  constexpr std::size_t block = sizeof(__m256i);
  constexpr std::size_t at_once = 4 * block;
  const auto load = [&](std::size_t at) __attribute__((target("avx2"), always_inline)) {
    const void* const place = from + at;
    return _mm256_loadu_si256(static_cast<const __m256i*>(place));
  };
  const auto store = [&](std::size_t at, __m256i value) __attribute__((target("avx2"), always_inline)) {
    void* const place = to + at;
    _mm256_store_si256(static_cast<__m256i*>(place), value);
  };
  std::memcpy(to, from, block);
  std::size_t at = (0 - reinterpret_cast<std::uintptr_t>(to)) % block;
  for (; size - at >= at_once; at += at_once) {
    const __m256i first = load(at);
    const __m256i second = load(at + block);
    const __m256i third = load(at + 2 * block);
    const __m256i fourth = load(at + 3 * block);
    store(at, first);
    store(at + block, second);
    store(at + 2 * block, third);
    store(at + 3 * block, fourth);
  }
  std::memcpy(to + at, from + at, size - at);
}

#else

bool can_copy_blocks() noexcept {
  return false;
}
bool is_slow() noexcept {
  return false;
}

#endif

const bool has_blocks = can_copy_blocks();

}  // namespace

const bool slow_memcpy = has_blocks && is_slow();

void copy_bytes(std::byte* to, const std::byte* from, std::size_t size,
                [[maybe_unused]] bool blocks) noexcept {
#if defined(__x86_64__)
  if (blocks && has_blocks && size > from_bytes && size <= to_bytes) {
    copy_blocks(to, from, size);
    return;
  }
#endif
  std::memcpy(to, from, size);
}

}  // namespace trestle
