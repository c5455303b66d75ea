#include "bridge/messages/types/literals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>

#include "bridge/messages/types/characters.hpp"
#include "bridge/messages/types/number_text.hpp"

namespace trestle::messages {
namespace {

template <std::integral Number>
Complaint check_integer(std::string_view text, std::string_view type) {
  const auto whole = read_signed(text);
  if (!whole) {
    return fmt::format("expected an integer for {}, found \"{}\"", type, text);
  }
  return read_integer<Number>(text) ? Complaint{} : fmt::format("{} is out of the range of {}", text, type);
}

Complaint check_float(std::string_view text, std::string_view type) {
  std::string_view digits = text;
  if (!digits.empty() && digits.front() == '+') {
    digits.remove_prefix(1);
  }
  double number = 0;
  const char* const end = digits.data() + digits.size();
  const auto [stop, error] = std::from_chars(digits.data(), end, number);
  if (digits.empty() || stop != end || error == std::errc::invalid_argument) {
    return fmt::format("expected a number for {}, found \"{}\"", type, text);
  }
  return {};
}

Complaint check_string(std::string_view text, std::uint32_t bound) {
  const bool quoted = !text.empty() && (text.front() == '"' || text.front() == '\'');
  std::size_t length = text.size();
  if (quoted) {
    std::size_t at = 1;
    for (length = 0; at < text.size() && text[at] != text.front(); ++length) {
      at += text[at] == '\\' ? 2U : 1U;
    }
    if (at + 1 != text.size()) {
      return at >= text.size() ? fmt::format("the string {} has no closing quote", text)
                               : fmt::format("nothing may follow the closing quote in {}", text);
    }
  }
  return bound != 0 && length > bound ? fmt::format("the string has more than {} characters", bound)
                                      : Complaint{};
}

}  // namespace

Complaint check_literal(Primitive type, std::uint32_t string_bound, std::string_view text) {
  switch (type) {
    case Primitive::boolean: {
      constexpr std::array<std::string_view, 6> names{"true", "false", "True", "False", "1", "0"};
      return std::ranges::find(names, text) != names.end()
                 ? Complaint{}
                 : fmt::format("expected true or false, found \"{}\"", text);
    }
    case Primitive::string:
    case Primitive::wstring:
      return check_string(text, string_bound);
    default:
      return visit_number(type, [&]<typename Number>(Number /*zero*/) {
        if constexpr (std::is_integral_v<Number>) {
          return check_integer<Number>(text, to_string(type));
        } else {
          return check_float(text, to_string(type));
        }
      });
  }
}

Complaint check_array_literal(const FieldType& type, std::string_view text) {
  if (text.size() < 2 || text.front() != '[' || text.back() != ']') {
    return fmt::format("expected a default value like [1, 2] for an array, found \"{}\"", text);
  }
  text = trimmed(text.substr(1, text.size() - 2));
  std::uint32_t count = 0;
  while (!text.empty()) {
    const std::size_t end = element_size(text);
    const bool more = end < text.size();
    const std::string_view element = trimmed(text.substr(0, end));
    if (Complaint complaint = check_literal(*type.primitive, type.string_bound, element);
        !complaint.empty()) {
      return complaint;
    }
    ++count;
    text = more ? trimmed(text.substr(end + 1)) : std::string_view{};
    if (more && text.empty()) {
      return "expected a value after the last comma";
    }
  }
  if (type.array == ArrayKind::fixed ? count != type.array_size
                                     : type.array == ArrayKind::bounded && count > type.array_size) {
    return fmt::format("the default value has {} elements, the array {}{}", count,
                       type.array == ArrayKind::fixed ? "" : "at most ", type.array_size);
  }
  return {};
}

std::size_t element_size(std::string_view text) {
  char quote = 0;
  std::size_t end = 0;
  for (; end < text.size() && (quote != 0 || text[end] != ','); ++end) {
    if (quote != 0 && text[end] == '\\') {
      ++end;
    } else if (quote != 0) {
      quote = text[end] == quote ? '\0' : quote;
    } else if (text[end] == '"' || text[end] == '\'') {
      quote = text[end];
    }
  }
  return std::min(end, text.size());
}

namespace {

DefaultElement element(Primitive type, std::string_view text) {
  DefaultElement value;
  if (type == Primitive::boolean) {
    value.text = text == "1" || text == "true" || text == "True" ? "true" : "false";
  } else if (width(type) == 0 && !text.empty() && (text.front() == '"' || text.front() == '\'')) {
    value.quoted = true;
    for (std::size_t at = 1; at + 1 < text.size(); ++at) {
      at += text[at] == '\\' && at + 2 < text.size() ? 1U : 0U;
      value.text += text[at];
    }
  } else {
    value.text = text;
  }
  return value;
}

}  // namespace

std::vector<DefaultElement> default_elements(const Field& field) {
  std::string_view text = field.default_value;
  if (text.empty() || !field.type.primitive) {
    return {};
  }
  if (field.type.array == ArrayKind::none) {
    return {element(*field.type.primitive, text)};
  }
  std::vector<DefaultElement> elements;
  text = text.substr(1, text.size() - 2);
  while (!trimmed(text).empty()) {
    const std::size_t size = element_size(text);
    elements.push_back(element(*field.type.primitive, trimmed(text.substr(0, size))));
    text.remove_prefix(std::min(size + 1, text.size()));
  }
  return elements;
}

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
