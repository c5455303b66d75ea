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

/// Copies `count` numbers of `width` bytes (2, 4 or 8) and reverses the bytes of each. The two places need
/// no alignment and must not overlap.
void copy_swapped(std::byte* to, const std::byte* from, std::size_t count, std::size_t width) noexcept;

}  // namespace trestle::bridge
