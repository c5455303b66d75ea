#pragma once
#include <vector>

#include "bridge/config/load_route.hpp"

namespace trestle::bridge {

/// Reports routes that are good one by one but cannot be together.
void report_conflicts(const std::vector<RouteInFile>& routes, const SomeipSettings& someip,
                      Problems& problems);

}  // namespace trestle::bridge
