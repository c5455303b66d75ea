#pragma once
#include <cstddef>

namespace trestle::test {

/// How many TCP segments with data have come over this connection; 0 if the system does not tell.
[[nodiscard]] std::size_t data_segments_received(int fd) noexcept;

}  // namespace trestle::test
