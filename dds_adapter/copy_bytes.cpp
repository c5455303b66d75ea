#include "dds_adapter/copy_bytes.hpp"

#include <cstdint>
#include <cstring>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace trestle {
namespace {

#if defined(__x86_64__)

// Between these sizes the C library copies with "rep movsb", where it can.
constexpr std::size_t from_bytes = 2048;
constexpr std::size_t to_bytes = 1024 * 1024;

bool can_copy_blocks() noexcept {
  return __builtin_cpu_supports("avx2") != 0;
}

/// On AMD's Zen 3 and 4 that takes 15 to 25 times as long if the target begins less than 16 bytes behind the
/// source, compared by their places within a page of 4 KB. The data of a cloud may lie so behind its front,
/// each time. Otherwise blocks are as quick. (glibc did not know this until 2.39, see its bug 30994.)
bool is_slow() noexcept {
  return __builtin_cpu_is("amdfam19h") != 0;
}

/// Four at a time, so that a load does not wait for a store that seems to go to the same place. Blocks of 16
/// bytes would be half as quick while the core's other thread is busy, and blocks of 64 are not quicker.
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
