#include "dds_adapter/copy_bytes.hpp"

#include <cstdint>
#include <cstring>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace trestle {
namespace {

#if defined(__SSE2__)

// Between these the C library copies by "rep movsb", where it has that.
constexpr std::size_t from_bytes = 2048;
constexpr std::size_t to_bytes = 1024 * 1024;

/// AMD's Zen 3 and 4 take 15 times as long for that where the target begins less than 16 bytes behind the
/// source, as places within a page of 4 KB: so the data of a cloud may, behind its front, and then does each
/// time. Elsewhere they take some 5 % longer. (glibc has not known until 2.39, its bug 30994.)
bool is_slow() noexcept {
  return __builtin_cpu_is("amdfam19h") != 0;
}

/// Four at a time: a load must not wait for a store that seems to be to the same place.
void copy_blocks(std::byte* to, const std::byte* from, std::size_t size) noexcept {
  constexpr std::size_t block = sizeof(__m128i);
  constexpr std::size_t at_once = 4 * block;
  const auto load = [&](std::size_t at) {
    const void* const place = from + at;
    return _mm_loadu_si128(static_cast<const __m128i*>(place));
  };
  const auto store = [&](std::size_t at, __m128i value) {
    void* const place = to + at;
    _mm_store_si128(static_cast<__m128i*>(place), value);
  };
  std::memcpy(to, from, block);
  std::size_t at = (0 - reinterpret_cast<std::uintptr_t>(to)) % block;
  for (; size - at >= at_once; at += at_once) {
    const __m128i first = load(at);
    const __m128i second = load(at + block);
    const __m128i third = load(at + 2 * block);
    const __m128i fourth = load(at + 3 * block);
    store(at, first);
    store(at + block, second);
    store(at + 2 * block, third);
    store(at + 3 * block, fourth);
  }
  std::memcpy(to + at, from + at, size - at);
}

#else

bool is_slow() noexcept {
  return false;
}

#endif

}  // namespace

const bool slow_memcpy = is_slow();

void copy_bytes(std::byte* to, const std::byte* from, std::size_t size,
                [[maybe_unused]] bool blocks) noexcept {
#if defined(__SSE2__)
  if (blocks && size > from_bytes && size <= to_bytes) {
    copy_blocks(to, from, size);
    return;
  }
#endif
  std::memcpy(to, from, size);
}

}  // namespace trestle
