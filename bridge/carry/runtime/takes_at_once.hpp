#pragma once
#include <chrono>

namespace trestle::carry {

/// Whether writing at most PIPE_BUF bytes does not wait: a pipe, a terminal and a socket have room for them,
/// and a file always has. So does what nobody can read any more: writing fails there, at once.
/// @param patience  how long to wait until it is so.
[[nodiscard]] bool takes_at_once(int fd, std::chrono::milliseconds patience = {});

}  // namespace trestle::carry
