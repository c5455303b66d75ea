#pragma once
#include <cstddef>
#include <string>

#include "bridge/cli/terminal.hpp"
#include "bridge/picture/picture.hpp"

namespace trestle::carry {

/// A running bridge for people: a line about it, a line a route with its state, rate, latencies and drops,
/// why nothing flows below it, and limits that are nearly full.
[[nodiscard]] std::string status_text(const Picture& picture, const cli::Colours& colours);

/// The slowest messages of all routes, a line each, and what took the time.
/// @param most  lines.
[[nodiscard]] std::string slowest_text(const Picture& picture, const cli::Colours& colours,
                                       std::size_t most = 20);

}  // namespace trestle::carry
