#pragma once
#include <vector>

#include "bridge/describe/write/routes/route_entries.hpp"

namespace trestle::describe {

/// Tells which settings a route file does not have: service discovery tells a client where an instance is,
/// and messages do not wait for others. A file that names the descriptions beside it needs none of this.
/// @param entries  of the file, before parts of actions are joined.
void tell_of_settings(const Model& model, const std::vector<RouteEntry>& entries, const RouteOptions& options,
                      std::vector<NotCarried>& not_carried);

}  // namespace trestle::describe
