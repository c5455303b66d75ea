#include "bridge/messages/types/field_service.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trestle::messages {
namespace {

InterfaceName made_service(const std::string& value_type, FieldAccess access) {
  InterfaceName name = interface_name(value_type).value_or(InterfaceName{});
  name.package += "_fields";
  name.kind = InterfaceKind::service;
  name.type.insert(0, access == FieldAccess::get ? "Get" : "Set");
  return name;
}

bool same_type(const Field& left, const Field& right) {
  FieldType type = left.type;
  type.message_index = right.type.message_index;  // each index belongs to its own tree
  return type == right.type;
}

/// Whether the message and the value have the same CDR: an enclosing message adds no bytes.
bool holds(const MessageDefinition& message, const MessageDefinition& value) {
  const bool is_one_member = message.fields.size() == 1 && message.fields[0].type.message == value.name &&
                             message.fields[0].type.array == ArrayKind::none;
  return is_one_member || std::ranges::equal(message.fields, value.fields, same_type);
}

std::string fault_of(const FieldServiceTypes& types, FieldAccess access) {
  const MessageDefinition& value = types.value.root();
  const MessageDefinition& request = types.service.request.root();
  const MessageDefinition& response = types.service.response.root();
  if (value.fields.empty()) {
    return fmt::format("{} has no fields, so it cannot be the value of a field", value.name);
  }
  if (access == FieldAccess::get && !request.fields.empty()) {
    return fmt::format("{} is not empty, but a getter has no parameters", request.name);
  }
  const auto wrong = [&](const MessageDefinition& message) {
    return fmt::format(
        "{} does not hold the value: expected one member of type {}, or its members in their order",
        message.name, value.name);
  };
  if (access == FieldAccess::set && !holds(request, value)) {
    return wrong(request);
  }
  return holds(response, value) ? std::string{} : wrong(response);
}

}  // namespace

std::string field_service_name(const std::string& value_type, FieldAccess access) {
  return made_service(value_type, access).full();
}

std::string field_service_text(const std::string& value_type, FieldAccess access) {
  const InterfaceName value = interface_name(value_type).value_or(InterfaceName{});
  const std::string member = fmt::format("{}/{} value\n", value.package, value.type);
  return fmt::format("{}---\n{}", access == FieldAccess::set ? member : "", member);
}

tl::expected<FieldServiceTypes, std::string> resolve_field_service(TypeLibrary& library,
                                                                   const std::string& service,
                                                                   const std::string& value_type,
                                                                   FieldAccess access) {
  auto value = library.resolve(value_type);
  if (!value) {
    return tl::unexpected{to_string(value.error())};
  }
  if (service == field_service_name(value_type, access)) {
    library.define(made_service(value_type, access), field_service_text(value_type, access));
  }
  auto both = library.resolve_service(service);
  if (!both) {
    return tl::unexpected{to_string(both.error())};
  }
  FieldServiceTypes types{std::move(*both), std::move(*value)};
  if (std::string fault = fault_of(types, access); !fault.empty()) {
    return tl::unexpected{std::move(fault)};
  }
  return types;
}

}  // namespace trestle::messages
