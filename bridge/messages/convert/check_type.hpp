#pragma once
#include <string>
#include <vector>

#include "bridge/messages/convert/message_rules.hpp"
#include "bridge/messages/types/field_service.hpp"
#include "bridge/messages/types/type_library.hpp"

namespace trestle::messages {

/// Says in one line what is wrong with a message type ("sensor_msgs/msg/PointCloud2") or a service
/// ("std_srvs/srv/SetBool"): it is not known, its definition has a fault, or it cannot be carried by these
/// rules. Empty: nothing.
/// @param places  searched before AMENT_PREFIX_PATH, see TypeLibrary.
[[nodiscard]] std::string check_type(const std::string& type, const TypePlaces& places,
                                     const MessageRules& rules = {});

/// The same of a service that gets or sets a field with values of a type, by resolve_field_service().
[[nodiscard]] std::string check_field_service(const std::string& service, const std::string& value_type,
                                              FieldAccess access, const TypePlaces& places,
                                              const MessageRules& rules = {});

/// Says in one line which arrays of a known type may have more bytes than their length field can say: such
/// messages are dropped. Empty: none, or all length fields of arrays have 32 bits.
[[nodiscard]] std::string check_lengths(const std::string& type, const TypePlaces& places,
                                        const MessageRules& rules);

}  // namespace trestle::messages
