#pragma once
#include <vector>

#include "bridge/carry/config/load_method.hpp"
#include "bridge/carry/config/load_route.hpp"

namespace trestle::carry {

/// Reports methods that are good one by one but cannot be together, or not beside these routes.
void report_method_conflicts(const std::vector<MethodInFile>& methods, const std::vector<RouteInFile>& routes,
                             std::uint16_t sd_port, documents::Problems& problems);

}  // namespace trestle::carry
