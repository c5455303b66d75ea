#include "bridge/messages/types/idl_literal.hpp"

#include <fmt/format.h>

namespace trestle::messages {
namespace {

/// rosidl_adapter writes the values of an array as a string: "(1, 2)", as Python does.
Complaint spell_idl_array(const std::string& text, const FieldType& type, std::string& into) {
  if (!text.starts_with('(') || !text.ends_with(')')) {
    return "expected a default value like \"(1, 2)\" for an array";
  }
  std::string elements = text.substr(1, text.size() - 2);
  if (elements.ends_with(',')) {
    elements.pop_back();  // a single one is "(1,)"
  }
  into = "[" + elements + "]";
  return check_array_literal(type, into);
}

}  // namespace

Complaint spell_idl_literal(const IdlLiteral& value, const FieldType& type, std::string& into) {
  if (!type.primitive) {
    return fmt::format("a member of type {} can have no default value", type.message);
  }
  const bool is_text = *type.primitive == Primitive::string || *type.primitive == Primitive::wstring;
  std::string text;
  for (const std::string_view part : value.strings) {
    text += unescaped_idl_string(part, *type.primitive == Primitive::wstring);
  }
  if (type.array != ArrayKind::none) {
    return spell_idl_array(text, type, into);
  }
  if (value.strings.empty() == is_text) {
    return fmt::format("expected {} for {}, found {}", is_text ? "a string" : "a number",
                       to_string(*type.primitive), value.token.text);
  }
  if (is_text) {
    into = "\"";
    for (const char c : text) {
      into += c == '"' || c == '\\' ? std::string{'\\', c} : std::string{c};
    }
    into += '"';
  } else if (value.token.kind == IdlToken::Kind::number) {
    into = (value.negative ? "-" : "") + std::string{value.token.text};
  } else {
    into = value.token.text == "TRUE" ? "true" : "false";
  }
  return check_literal(*type.primitive, type.string_bound, into);
}

}  // namespace trestle::messages
