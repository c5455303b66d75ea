#pragma once
#include <memory>
#include <vector>

#include "bridge/carry/runtime/route_context.hpp"
#include "bridge/carry/runtime/routes.hpp"
#include "bridge/messages/convert/conversion_plan.hpp"
#include "bridge/messages/types/type_library.hpp"

namespace trestle::carry {

/// All that a configuration has, in its order: routes with their getters, then methods. Compiles their
/// conversions. A new kind of route has its line here.
/// @param context  outlives the routes.
/// @throws std::runtime_error  with the place in the configuration.
[[nodiscard]] std::vector<MadeRoute> make_routes(const RouteContext& context, const BridgeConfig& config,
                                                 messages::TypeLibrary& types);

/// One of a topic, with its conversion.
/// @param beside  all routes of the configuration, which may share its subscription.
[[nodiscard]] std::shared_ptr<RunningRoute> make_route(const RouteContext& context, const Route& route,
                                                       messages::ConversionPlan plan,
                                                       messages::TypeLibrary& types,
                                                       const std::vector<Route>& beside = {});

}  // namespace trestle::carry
