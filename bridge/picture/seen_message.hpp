#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

namespace trestle::carry {

/// A copy of a message, for somebody who looks at a route.
struct SeenMessage {
  bool is_cdr = false;           ///< a CDR sample with its encapsulation header; else a SOME/IP payload
  std::vector<std::byte> bytes;  ///< empty where it is too large to be copied
  std::size_t size = 0;
  std::int64_t at_ns = 0;  ///< when it came, since 1970
};

}  // namespace trestle::carry
