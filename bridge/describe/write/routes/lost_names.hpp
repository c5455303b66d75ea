#pragma once
#include <vector>

#include "bridge/describe/write/routes/route_entries.hpp"

namespace trestle::describe {

/// Tells which names a route file does not have: it names topics as ROS does, and knows instances,
/// eventgroups and services by their ids alone. A file that names the descriptions beside it needs none of
/// this.
/// @param entries  of the file, before parts of actions are joined.
void tell_of_names(const Model& model, const Lowered& lowered, const std::vector<RouteEntry>& entries,
                   std::vector<NotCarried>& not_carried);

}  // namespace trestle::describe
