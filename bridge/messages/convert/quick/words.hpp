#pragma once
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace trestle::messages::quick {

/// Bytes that are compared at once, in a register where the processor has them so wide.
using Words = std::uint64_t __attribute__((vector_size(16)));

/// From memory of any alignment.
[[nodiscard]] inline Words words(const std::byte* from) noexcept {
  Words numbers;
  std::memcpy(&numbers, from, sizeof numbers);
  return numbers;
}

[[nodiscard]] inline bool is_zero(Words numbers) noexcept {
  return (numbers[0] | numbers[1]) == 0;
}

}  // namespace trestle::messages::quick
