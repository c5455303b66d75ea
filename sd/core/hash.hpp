#pragma once
#include <cstdint>

#include "someip/wire/bytes.hpp"

namespace trestle::sd {

/// FNV-1a over some bytes, begun with `seed`. No protection against somebody who looks for two inputs with
/// the same hash.
[[nodiscard]] constexpr std::uint32_t hash_of(std::uint32_t seed, ByteView bytes) noexcept {
  std::uint32_t hash = 0x811c9dc5U ^ seed;
  for (const std::byte byte : bytes) {
    hash = (hash ^ static_cast<std::uint32_t>(byte)) * 0x01000193U;
  }
  return hash;
}

}  // namespace trestle::sd
