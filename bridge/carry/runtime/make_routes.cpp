#include "bridge/carry/runtime/make_routes.hpp"

#include "bridge/carry/runtime/event_to_topic.hpp"
#include "bridge/carry/runtime/getter_to_topic.hpp"
#include "bridge/carry/runtime/method_to_service.hpp"
#include "bridge/carry/runtime/route_parts.hpp"
#include "bridge/carry/runtime/service_to_method.hpp"
#include "bridge/carry/runtime/start_at.hpp"
#include "bridge/carry/runtime/topic_to_event.hpp"

namespace trestle::carry {
namespace {

std::unique_ptr<RunningRoute> make_method(const RouteContext& context, const MethodRoute& method,
                                          messages::TypeLibrary& types) {
  MethodParts parts = compile(method, context.address, types);
  if (method.server == Server::someip) {
    return std::make_unique<ServiceToMethod>(context, method, std::move(parts));
  }
  return std::make_unique<MethodToService>(context, method, std::move(parts));
}

}  // namespace

std::unique_ptr<RunningRoute> make_route(const RouteContext& context, const Route& route,
                                         messages::ConversionPlan plan, messages::TypeLibrary& types,
                                         const std::vector<Route>& beside) {
  std::string user_data = user_data_of(route.type, types);
  if (route.direction == Direction::someip_to_dds) {
    const sd::SubscribeSpec subscription = subscription_of(beside, route, plan);
    return std::make_unique<EventToTopic>(context, route, subscription, std::move(plan),
                                          std::move(user_data));
  }
  return std::make_unique<TopicToEvent>(context, route, std::move(plan), std::move(user_data));
}

std::vector<MadeRoute> make_routes(const RouteContext& context, const BridgeConfig& config,
                                   messages::TypeLibrary& types) {
  std::vector<MadeRoute> made;
  for (const Route& route : config.routes) {
    made.push_back({route.mark, start_at(config, route.mark, [&] {
                      return make_route(context, route, compile(route, types), types, config.routes);
                    })});
    if (route.getter) {
      made.push_back({route.mark, std::make_unique<GetterToTopic>(route)});
    }
  }
  for (const MethodRoute& method : config.methods) {
    made.push_back(
        {method.mark, start_at(config, method.mark, [&] { return make_method(context, method, types); })});
  }
  return made;
}

}  // namespace trestle::carry
