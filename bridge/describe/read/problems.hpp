#pragma once
#include "bridge/describe/model.hpp"
#include "bridge/documents/problems.hpp"

namespace trestle::describe {

using documents::Problems;

/// A reader tells so many and no more: a hostile file must not fill the memory.
inline constexpr std::size_t max_problems = 100;

}  // namespace trestle::describe
