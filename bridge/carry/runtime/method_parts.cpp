#include "bridge/carry/runtime/method_parts.hpp"

#include <algorithm>
#include <stdexcept>

#include "bridge/carry/runtime/bridge_mark.hpp"
#include "bridge/carry/runtime/route_parts.hpp"

namespace trestle::carry {
namespace {

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

}  // namespace trestle::carry
