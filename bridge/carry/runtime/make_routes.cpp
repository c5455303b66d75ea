#include "bridge/carry/runtime/make_routes.hpp"

#include "bridge/carry/runtime/route_kinds.hpp"
#include "bridge/carry/runtime/start_at.hpp"

namespace trestle::carry {
namespace {

std::shared_ptr<RunningRoute> make_method(const RouteContext& context, const MethodRoute& method,
                                          messages::TypeLibrary& types) {
  MethodParts parts = compile(method, context.address, types);
  if (method.server == Server::someip) {
    return service_to_method(context, method, std::move(parts));
  }
  return method_to_service(context, method, std::move(parts));
}

}  // namespace

std::shared_ptr<RunningRoute> make_route(const RouteContext& context, const Route& route,
                                         messages::ConversionPlan plan, messages::TypeLibrary& types,
                                         const std::vector<Route>& beside) {
  std::string user_data = user_data_of(route.type, types);
  if (route.direction == Direction::someip_to_dds) {
    const sd::SubscribeSpec subscription = subscription_of(beside, route, plan);
    return event_to_topic(context, route, subscription, std::move(plan), std::move(user_data));
  }
  return topic_to_event(context, route, std::move(plan), std::move(user_data));
}

std::vector<MadeRoute> make_routes(const RouteContext& context, const BridgeConfig& config,
                                   messages::TypeLibrary& types) {
  std::vector<MadeRoute> made;
  for (const Route& route : config.routes) {
    made.push_back({route.mark, start_at(config, route.mark, [&] {
                      return make_route(context, route, compile(route, types), types, config.routes);
                    })});
    if (route.getter) {
      made.push_back({route.mark, getter_to_topic(route)});
    }
  }
  for (const MethodRoute& method : config.methods) {
    made.push_back(
        {method.mark, start_at(config, method.mark, [&] { return make_method(context, method, types); })});
  }
  return made;
}

}  // namespace trestle::carry
