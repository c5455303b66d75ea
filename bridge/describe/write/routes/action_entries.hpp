#pragma once
#include <vector>

#include "bridge/describe/write/routes/route_entries.hpp"

namespace trestle::describe {

/// Makes one entry of the list "actions" of the five parts of each action, which are routes and methods named
/// "NAME/_action/send_goal" and so on: a route file takes the types of actions nowhere else. Parts that make
/// no action are taken out, and named in `not_carried`.
void join_actions(std::vector<RouteEntry>& entries, std::vector<NotCarried>& not_carried);

}  // namespace trestle::describe
