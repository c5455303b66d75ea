#pragma once
#include <cstdint>
#include <string>

#include "bridge/conform/tester.hpp"

namespace trestle::conform {

/// A number for what an answer is, and in which state it came.
[[nodiscard]] std::uint64_t behaviour(const std::string& state, const Packet& packet);

}  // namespace trestle::conform
