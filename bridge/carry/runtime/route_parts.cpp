#include "bridge/carry/runtime/route_parts.hpp"

#include <algorithm>
#include <stdexcept>

#include "bridge/messages/convert/most_bytes.hpp"
#include "bridge/messages/types/type_hash.hpp"
#include "dds_adapter/ros_names.hpp"

namespace trestle::carry {

messages::ConversionPlan compile(const Route& route, messages::TypeLibrary& types) {
  const auto fail = [&](const std::string& why) {
    return std::runtime_error{"route " + route.topic + ": " + route.type + " cannot be carried: " + why};
  };
  const auto tree = types.resolve(route.type);
  if (!tree) {
    throw fail(to_string(tree.error()));
  }
  auto plan = messages::ConversionPlan::compile(*tree, route.rules);
  if (!plan) {
    throw fail(plan.error());
  }
  return std::move(*plan);
}

std::string user_data_of(const std::string& type, messages::TypeLibrary& types) {
  const auto hash = messages::type_hash(types, type);
  return hash ? dds::ros_type_hash_entry(*hash) : std::string{};
}

std::string user_data_of_service(const std::string& type, messages::TypeLibrary& types) {
  const auto hash = messages::type_hash(types, type);
  return hash ? dds::ros_service_hash_entry(*hash) : std::string{};
}

sd::SubscribeSpec subscription_of(const std::vector<Route>& routes, const Route& route,
                                  const messages::ConversionPlan& plan) {
  const auto uses = [&](Transport transport) {
    return std::ranges::any_of(routes, [&](const Route& other) {
      return other.direction == route.direction && other.service == route.service &&
             other.instance == route.instance && other.eventgroup == route.eventgroup &&
             other.transport == transport;
    });
  };
  std::vector<sd::E2eSpec> e2e;
  if (route.e2e) {  // the route itself counts and drops
    e2e.push_back({.id = route.event,
                   .check = route.e2e->profile,
                   .state_machine = route.e2e->state_machine,
                   .pass_failed = true,
                   .payload_only = route.e2e->payload_only});
  }
  // A newer interface may have more behind what we know; less than the least piece of memory saves nothing.
  constexpr std::size_t least = std::size_t{64} << 10U;
  const auto most = messages::most_someip_bytes(plan.program());
  return {.service = route.service,
          .instance = route.instance,
          .major = route.major,
          .minor = route.minor,
          .eventgroup = route.eventgroup,
          .events = {route.event},
          .udp = uses(Transport::udp),
          .tcp = uses(Transport::tcp),
          .port = route.port,
          .e2e = std::move(e2e),
          .max_event_bytes =
              most ? std::optional{std::max(least, messages::room_to_receive(*most))} : std::nullopt};
}

}  // namespace trestle::carry
