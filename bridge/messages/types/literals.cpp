#include "bridge/messages/types/literals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>

#include "bridge/messages/types/default_elements.hpp"

namespace trestle::messages {
namespace {

template <typename Number>
Complaint check_integer(std::string_view text, std::string_view type) {
  const std::string_view literal = text;
  const bool negative = !text.empty() && text.front() == '-';
  if (!text.empty() && (negative || text.front() == '+')) {
    text.remove_prefix(1);
  }
  int base = 10;
  if (text.size() > 2 && text[0] == '0') {
    const char mark = text[1];
    base = mark == 'x' || mark == 'X'   ? 16
           : mark == 'b' || mark == 'B' ? 2
           : mark == 'o' || mark == 'O' ? 8
                                        : 10;
    text.remove_prefix(base == 10 ? 0 : 2);
  }
  std::uint64_t magnitude = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, magnitude, base);
  if (text.empty() || stop != end || error == std::errc::invalid_argument) {
    return fmt::format("expected an integer for {}, found \"{}\"", type, literal);
  }
  const auto most = static_cast<std::uint64_t>(std::numeric_limits<Number>::max());
  const std::uint64_t least = std::is_signed_v<Number> ? most + 1 : 0;
  if (error != std::errc{} || magnitude > (negative ? least : most)) {
    return fmt::format("{} is out of the range of {}", literal, type);
  }
  return {};
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
    case Primitive::byte:
    case Primitive::character:
    case Primitive::uint8:
      return check_integer<std::uint8_t>(text, to_string(type));
    case Primitive::int8:
      return check_integer<std::int8_t>(text, to_string(type));
    case Primitive::int16:
      return check_integer<std::int16_t>(text, to_string(type));
    case Primitive::uint16:
      return check_integer<std::uint16_t>(text, to_string(type));
    case Primitive::int32:
      return check_integer<std::int32_t>(text, to_string(type));
    case Primitive::uint32:
      return check_integer<std::uint32_t>(text, to_string(type));
    case Primitive::int64:
      return check_integer<std::int64_t>(text, to_string(type));
    case Primitive::uint64:
      return check_integer<std::uint64_t>(text, to_string(type));
    case Primitive::float32:
    case Primitive::float64:
      return check_float(text, to_string(type));
    case Primitive::string:
    case Primitive::wstring:
      return check_string(text, string_bound);
  }
  return {};
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

}  // namespace trestle::messages
