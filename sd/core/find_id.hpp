#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "someip/wire/types.hpp"

namespace trestle::sd {

/// The first place from `at` on that has this service; the number of places when there is none.
[[nodiscard]] inline std::size_t find_id(std::span<const someip::ServiceId> ids, someip::ServiceId service,
                                         std::size_t at = 0) noexcept {
  // A peer may have us search thousands of them for each of its entries. A loop without a way out in its
  // middle becomes a few comparisons of many ids at once.
  constexpr std::size_t block = 32;
  for (; ids.size() - at >= block; at += block) {
    std::uint16_t equal = 0;
    for (std::size_t i = 0; i < block; ++i) {
      equal = static_cast<std::uint16_t>(equal + (ids[at + i] == service ? 1 : 0));
    }
    if (equal != 0) {
      break;
    }
  }
  while (at < ids.size() && ids[at] != service) {
    ++at;
  }
  return at;
}

}  // namespace trestle::sd
