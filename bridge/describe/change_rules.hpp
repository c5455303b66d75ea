#pragma once
#include <string_view>

#include "bridge/describe/compare.hpp"

namespace trestle::describe::comparing {

/// That of an id which is in the table.
[[nodiscard]] const ChangeRule& rule(std::string_view id);

}  // namespace trestle::describe::comparing
