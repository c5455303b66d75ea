#pragma once
#include <memory>

#include "bridge/carry/runtime/route_context.hpp"
#include "bridge/carry/runtime/route_parts.hpp"
#include "bridge/carry/runtime/running_route.hpp"

/// The kinds of routes. Each has a file that is named as its function here, and nothing else knows it; a new
/// one has its line here, and is made in make_routes.cpp. A context outlives the routes.
namespace trestle::carry {

[[nodiscard]] std::shared_ptr<RunningRoute> topic_to_event(const RouteContext& context, const Route& route,
                                                           messages::ConversionPlan plan,
                                                           std::string user_data);
[[nodiscard]] std::shared_ptr<RunningRoute> event_to_topic(const RouteContext& context, const Route& route,
                                                           const sd::SubscribeSpec& subscription,
                                                           messages::ConversionPlan plan,
                                                           std::string user_data);
/// @param route  which has a getter.
[[nodiscard]] std::shared_ptr<RunningRoute> getter_to_topic(const Route& route);
[[nodiscard]] std::shared_ptr<RunningRoute> method_to_service(const RouteContext& context,
                                                              const MethodRoute& method, MethodParts parts);
[[nodiscard]] std::shared_ptr<RunningRoute> service_to_method(const RouteContext& context,
                                                              const MethodRoute& method, MethodParts parts);

}  // namespace trestle::carry
