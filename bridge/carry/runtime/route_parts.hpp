#pragma once
#include <optional>
#include <string>
#include <vector>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/carry/runtime/counters.hpp"
#include "bridge/carry/runtime/failure_reply.hpp"
#include "bridge/messages/convert/conversion_plan.hpp"
#include "bridge/messages/convert/service_plans.hpp"
#include "bridge/messages/map/mapped_plan.hpp"
#include "bridge/messages/types/type_library.hpp"
#include "dds_adapter/service.hpp"
#include "sd/net/service_spec.hpp"

/// What routes are made from, those of the configuration and those of discovery.
namespace trestle::carry {

/// The route's conversion, in its direction.
/// @throws std::runtime_error  its type is not known or cannot be carried.
[[nodiscard]] messages::MappedPlan compile(const Route& route, messages::TypeLibrary& types);

/// Adds what a mapping of fields did to numbers, where the route has one.
void append_map(CounterGroup& group, const messages::MappedPlan& plan);

/// What a method is made from.
struct MethodParts {
  messages::ServicePlans plans;
  dds::ServiceConfig ros;
  std::optional<FailureReply> failure{};  ///< server: someip; what is answered when a call goes wrong
};

/// Compiles the method's conversions.
/// @param address  of the bridge in SOME/IP.
/// @throws std::runtime_error  its type is not known or cannot be carried.
[[nodiscard]] MethodParts compile(const MethodRoute& method, const IpAddress& address,
                                  messages::TypeLibrary& types);

/// What ROS 2 nodes learn of the type by discovery; they warn of topics that lack it.
[[nodiscard]] std::string user_data_of(const std::string& type, messages::TypeLibrary& types);

/// All routes of an eventgroup share a subscription, which names every protocol that they need.
/// @param routes  of the configuration.
/// @param plan    of the route, which may bound what is received.
[[nodiscard]] sd::SubscribeSpec subscription_of(const std::vector<Route>& routes, const Route& route,
                                                const messages::ConversionPlan& plan);

}  // namespace trestle::carry
