#pragma once
#include <vector>

#include "bridge/carry/config/elements.hpp"

/// What is good by itself but cannot be together.
namespace trestle::carry {

/// Reports such routes.
void report_conflicts(const std::vector<RouteInFile>& routes, const SomeipSettings& someip,
                      documents::Problems& problems);

/// Reports such methods, also beside these routes.
void report_method_conflicts(const std::vector<MethodInFile>& methods, const std::vector<RouteInFile>& routes,
                             const SomeipSettings& someip, documents::Problems& problems);

/// Reports routes that have the topic of the diagnostics with another type.
void report_diagnostics_conflicts(const std::vector<RouteInFile>& routes,
                                  const std::vector<MethodInFile>& methods,
                                  const DiagnosticsSettings& diagnostics, documents::Problems& problems);

}  // namespace trestle::carry
