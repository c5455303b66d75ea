// Property: what parse_idl() accepts, written out from the parsed definitions, parses to the same members;
// and each default value has as many elements as its array may have. The first byte chooses a message, a
// service or an action.
#include <fmt/format.h>

#include <array>
#include <cstdlib>
#include <span>

#include "bridge/messages/types/literals.hpp"
#include "bridge/messages/types/parsers.hpp"

using namespace trestle;

namespace {

void require(bool truth) {
  if (!truth) {
    std::abort();
  }
}

std::string idl_name(const messages::FieldType& type) {
  if (!type.primitive) {
    std::string name = type.message;
    for (std::size_t at = name.find('/'); at != std::string::npos; at = name.find('/')) {
      name.replace(at, 1, "::");
    }
    return name;
  }
  std::string name;
  switch (*type.primitive) {
    case messages::Primitive::boolean:
      return "boolean";
    case messages::Primitive::byte:
      return "octet";
    case messages::Primitive::float32:
      return "float";
    case messages::Primitive::float64:
      return "double";
    case messages::Primitive::string:
    case messages::Primitive::wstring:
      name = to_string(*type.primitive);
      return type.string_bound == 0 ? name : fmt::format("{}<{}>", name, type.string_bound);
    default:
      return to_string(*type.primitive);
  }
}

std::string written(const messages::Field& field) {
  const std::string type = idl_name(field.type);
  switch (field.type.array) {
    case messages::ArrayKind::none:
      return fmt::format("{} {};\n", type, field.name);
    case messages::ArrayKind::fixed:
      return fmt::format("{} {}[{}];\n", type, field.name, field.type.array_size);
    case messages::ArrayKind::bounded:
      return fmt::format("sequence<{}, {}> {};\n", type, field.type.array_size, field.name);
    case messages::ArrayKind::unbounded:
      return fmt::format("sequence<{}> {};\n", type, field.name);
  }
  return {};
}

void check_default(const messages::Field& field) {
  const std::size_t elements = messages::default_elements(field).size();
  switch (field.type.array) {
    case messages::ArrayKind::none:
      require(elements == (field.default_value.empty() ? 0 : 1));
      break;
    case messages::ArrayKind::fixed:
      require(field.default_value.empty() || elements == field.type.array_size);
      break;
    case messages::ArrayKind::bounded:
      require(elements <= field.type.array_size);
      break;
    case messages::ArrayKind::unbounded:
      break;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) {
    return 0;
  }
  constexpr std::array kinds{messages::InterfaceKind::message, messages::InterfaceKind::service,
                             messages::InterfaceKind::action};
  const messages::InterfaceName name{"f", kinds.at(data[0] % kinds.size()), "F"};
  std::string text(size - 1, '\0');
  std::ranges::copy(std::span{data, size}.subspan(1), text.begin());
  const auto first = messages::parse_idl(text, name, "F.idl");
  if (!first) {
    return 0;
  }
  const std::size_t parts = messages::message_names(name).size();
  require(first->size() >= parts);
  std::string again;
  for (const messages::MessageDefinition& message : std::span{*first}.first(parts)) {
    again += fmt::format("struct {} {{\n", message.name.substr(message.name.rfind('/') + 1));
    for (const messages::Field& field : message.fields) {
      check_default(field);
      again += written(field);
    }
    again += message.fields.empty() ? "uint8 structure_needs_at_least_one_member;\n};\n" : "};\n";
  }
  const auto second = messages::parse_idl(
      fmt::format("module f {{ module {} {{\n{}}}; }};", to_string(name.kind), again), name, "F.idl");
  require(second && second->size() == first->size());
  for (std::size_t i = 0; i < parts; ++i) {
    const auto same = [](const messages::Field& a, const messages::Field& b) {
      return a.name == b.name && a.type == b.type;
    };
    require(std::ranges::equal(first->at(i).fields, second->at(i).fields, same));
  }
  return 0;
}
