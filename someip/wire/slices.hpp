#pragma once
#include "someip/wire/types.hpp"

namespace trestle {

[[nodiscard]] constexpr std::size_t size_of(std::span<const ByteView> slices) noexcept {
  std::size_t sum = 0;
  for (const ByteView slice : slices) {
    sum += slice.size();
  }
  return sum;
}

}  // namespace trestle
