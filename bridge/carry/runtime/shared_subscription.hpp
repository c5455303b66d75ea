#pragma once
#include <string>
#include <vector>

#include "bridge/carry/config/bridge_config.hpp"
#include "sd/net/service_spec.hpp"

namespace trestle::carry {

/// Makes what somebody wants beside the routes one with their subscriptions: the same on the wire where a
/// route has the eventgroup, and at the port of the routes where they have others of the service. A Node
/// hands an event to all that want it of its sender, so with a second subscription at another port the routes
/// would get each event twice.
/// @param routes  all that there are, of both directions; each has one instance.
/// @param wish  of one instance, too.
/// @return why that cannot be; empty: it can.
[[nodiscard]] std::string share_with_routes(const std::vector<const Route*>& routes, sd::SubscribeSpec& wish);

}  // namespace trestle::carry
