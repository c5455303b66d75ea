#include "bridge/carry/runtime/route_parts.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "bridge/carry/runtime/bridge_mark.hpp"
#include "bridge/messages/convert/most_bytes.hpp"
#include "bridge/messages/map/map_compiler.hpp"
#include "bridge/messages/types/type_hash.hpp"
#include "dds_adapter/ros_names.hpp"

namespace trestle::carry {
namespace {

// What ROS 2 nodes learn of the service that a request or reply belongs to, beside that of its message.
std::string user_data_of_service(const std::string& type, messages::TypeLibrary& types) {
  const auto hash = messages::type_hash(types, type);
  return hash ? dds::ros_service_hash_entry(*hash) : std::string{};
}

// The ROS side of a method.
dds::ServiceConfig service_config(const MethodRoute& method, const IpAddress& address,
                                  messages::TypeLibrary& types) {
  using enum dds::RosForm;
  dds::ServiceConfig config;
  config.name = method.ros_service;
  config.type = method.type;
  config.form = method.form == ServiceForm::fastrtps     ? fastrtps
                : method.form == ServiceForm::cyclonedds ? cyclonedds
                                                         : automatic;
  config.max_calls = method.max_calls;
  // As max_sample_bytes() of a route.
  config.max_sample_bytes = std::max(dds::default_max_sample_bytes, 8 * method.tp.max_message);
  const std::string of_service = user_data_of_service(method.type, types);
  config.request_user_data = user_data_of(method.type + "_Request", types) + of_service;
  config.reply_user_data = user_data_of(method.type + "_Response", types) + of_service;
  const BridgeMark mark = mark_of(address, method);
  config.bridge = to_text(mark);
  config.takes_bridge = [mark](std::string_view other) { return goes_on(mark, other); };
  return config;
}

}  // namespace

messages::MappedPlan compile(const Route& route, messages::TypeLibrary& types) {
  const std::string& payload_type = route.mapping ? route.mapping->payload.text : route.type;
  const auto fail = [&](const std::string& why) {
    return std::runtime_error{"route " + route.topic + ": " + payload_type + " cannot be carried: " + why};
  };
  const auto tree = types.resolve(payload_type);
  if (!tree) {
    throw fail(to_string(tree.error()));
  }
  const bool to_ros = route.direction == Direction::someip_to_dds;
  auto plan = messages::ConversionPlan::compile(*tree, route.rules,
                                                route.mapping && to_ros
                                                    ? std::numeric_limits<std::size_t>::max()
                                                    : messages::ConversionPlan::default_reference_from);
  if (!plan) {
    throw fail(plan.error());
  }
  if (!route.mapping) {
    return std::move(*plan);
  }
  const auto ros_tree = types.resolve(route.type);
  if (!ros_tree) {
    throw fail(to_string(ros_tree.error()));
  }
  auto map = messages::compile_map(*tree, *ros_tree, *route.mapping, map_direction(route.direction));
  if (!map.map) {
    throw fail(map.problems.front().text);
  }
  return {std::move(*plan), std::move(*map.map)};
}

void append_map(CounterGroup& group, const messages::MappedPlan& plan) {
  if (plan.has_map()) {
    const messages::MapCounters& map = plan.counters();
    group.counters.push_back({"map_saturated", map.saturated, someip::CounterKind::doubt});
    group.counters.push_back({"map_rounded", map.rounded, someip::CounterKind::doubt});
    group.counters.push_back({"map_not_a_number", map.not_a_number, someip::CounterKind::doubt});
  }
}

std::string user_data_of(const std::string& type, messages::TypeLibrary& types) {
  const auto hash = messages::type_hash(types, type);
  return hash ? dds::ros_type_hash_entry(*hash) : std::string{};
}

MethodParts compile(const MethodRoute& method, const IpAddress& address, messages::TypeLibrary& types) {
  const auto fail = [&](const std::string& why) {
    return std::runtime_error{"method " + method.ros_service + ": " + method.type +
                              " cannot be carried: " + why};
  };
  if (method.access != messages::FieldAccess::none) {
    const auto field = resolve_field_service(types, method.type, method.value_type, method.access);
    if (!field) {
      throw fail(field.error());
    }
    auto plans = compile_field_service(*field, method.access, method.rules);
    if (!plans) {
      throw fail(plans.error());
    }
    return {std::move(*plans), service_config(method, address, types)};
  }
  const auto service = types.resolve_service(method.type);
  if (!service) {
    throw fail(to_string(service.error()));
  }
  messages::MessageRules rules = method.rules;
  // The answer to ROS that a method without one does not give is made of defaults.
  rules.default_missing =
      rules.default_missing || (method.fire_and_forget && method.server == Server::someip);
  auto plans = compile_service(*service, rules);
  if (!plans) {
    throw fail(plans.error());
  }
  return {std::move(*plans), service_config(method, address, types),
          FailureReply::of(method.type, service->response)};
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
