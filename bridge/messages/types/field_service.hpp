#pragma once
#include <cstdint>
#include <string>
#include <tl/expected.hpp>

#include "bridge/messages/types/type_library.hpp"

/// The ROS services by which a field is read and changed. SOME/IP's getter and setter carry nothing but the
/// value; a ROS service has a type of its own, whose messages hold it.
namespace trestle::messages {

/// Which part of a field a ROS service stands for.
enum class FieldAccess : std::uint8_t {
  none,  ///< no field's: an ordinary service
  get,   ///< an empty request, the value in the response  [feat_req_someip_633]
  set,  ///< the wanted value in the request, the value that it has now in the response  [feat_req_someip_634]
};

/// The service that is made for values of a type, where none is named: of "std_msgs/msg/Float64" it is
/// "std_msgs_fields/srv/GetFloat64" or "std_msgs_fields/srv/SetFloat64".
/// @param value_type  "pkg/msg/Name"
[[nodiscard]] std::string field_service_name(const std::string& value_type, FieldAccess access);

/// The text of the `.srv` file that such a service has.
[[nodiscard]] std::string field_service_text(const std::string& value_type, FieldAccess access);

/// A service that gets or sets a field, and its value.
struct FieldServiceTypes {
  ServiceTypes service;
  TypeTree value;
};

/// Finds both types. The service that is made for values of this type need not be known before.
/// @return the types, or one line that says what is wrong: a type is not known or has a fault, or a message
///         of the service is neither one member of the value's type, nor the value's members in their order
///         (or, where it is to be empty, not empty).
[[nodiscard]] tl::expected<FieldServiceTypes, std::string> resolve_field_service(
    TypeLibrary& library, const std::string& service, const std::string& value_type, FieldAccess access);

}  // namespace trestle::messages
