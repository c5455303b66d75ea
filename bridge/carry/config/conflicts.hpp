#pragma once
#include <vector>

#include "bridge/carry/config/load_method.hpp"
#include "bridge/carry/config/load_route.hpp"

namespace trestle::carry {

/// Reports routes that are good one by one but cannot be together.
void report_conflicts(const std::vector<RouteInFile>& routes, const SomeipSettings& someip,
                      documents::Problems& problems);

/// Reports routes that have the topic of the diagnostics with another type.
void report_diagnostics_conflicts(const std::vector<RouteInFile>& routes,
                                  const std::vector<MethodInFile>& methods,
                                  const DiagnosticsSettings& diagnostics, documents::Problems& problems);

}  // namespace trestle::carry
