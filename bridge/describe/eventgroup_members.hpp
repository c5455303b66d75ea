#pragma once
#include <string>

#include "bridge/describe/model.hpp"

namespace trestle::describe {

/// What is in an eventgroup, for those that have no name: "moved, level", at most four names, then "…".
/// Empty: nothing that is described.
[[nodiscard]] std::string members_of(const Service& service, someip::EventgroupId eventgroup);

}  // namespace trestle::describe
