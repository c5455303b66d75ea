#pragma once
#include <cstddef>
#include <cstdint>

namespace trestle::console {

/// Of all viewers since the start.
struct ViewerCounters {
  std::size_t viewers = 0;  ///< now
  std::uint64_t sent = 0;   ///< messages
  std::uint64_t slow = 0;   ///< messages that were not sent: a viewer, or the viewers' thread, was too slow
  std::uint64_t too_large = 0;
  std::uint64_t unreadable = 0;
  std::uint64_t malformed = 0;  ///< viewers that ended because they broke a protocol
};

}  // namespace trestle::console
