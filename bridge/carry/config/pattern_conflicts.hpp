#pragma once
#include <vector>

#include "bridge/carry/config/elements.hpp"
#include "bridge/carry/config/load.hpp"

namespace trestle::carry {

/// The pattern that a topic belongs to: the first one that matches it and does not exclude it, or nothing.
[[nodiscard]] const TopicPattern* pattern_of(const std::vector<TopicPattern>& patterns,
                                             std::string_view topic);

/// Ports of patterns that somebody else uses the other way.
void report_pattern_conflicts(const std::vector<PatternInFile>& patterns,
                              const std::vector<RouteInFile>& routes, std::uint16_t sd_port,
                              documents::Problems& problems);

/// What in the lock file does not go together with the configuration: ids outside of the range of the
/// topic's pattern, and ids that routes and methods of other topics have.
void report_lock_conflicts(const BridgeConfig& config, const std::vector<RouteInFile>& routes,
                           const std::vector<MethodInFile>& methods, documents::Problems& lock_problems);

/// The routes of locked topics that belong to a pattern from SOME/IP. A topic with a route of its own gets no
/// other; nor does one whose type is not known here, which is warned of.
[[nodiscard]] std::vector<RouteInFile> locked_routes(const BridgeConfig& config,
                                                     const std::vector<RouteInFile>& routes,
                                                     const TypeCheck& check_type,
                                                     documents::Problems& lock_problems);

}  // namespace trestle::carry
