#pragma once
#include <optional>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/carry/runtime/failure_reply.hpp"
#include "bridge/messages/convert/service_plans.hpp"
#include "bridge/messages/types/type_library.hpp"
#include "dds_adapter/service.hpp"

namespace trestle::carry {

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

}  // namespace trestle::carry
