#include "bridge/messages/values/sample_builder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <limits>

#include "bridge/messages/types/literals.hpp"
#include "bridge/messages/types/number_text.hpp"
#include "bridge/messages/values/byte_text.hpp"
#include "bridge/messages/values/cdr.hpp"
#include "bridge/messages/values/quoted.hpp"
#include "someip/wire/utf.hpp"

namespace trestle::messages {
namespace {

using Kind = TextValue::Kind;

/// The default value of a field that has one, which the parser of .msg files has checked.
TextValue default_value(const Field& field) {
  TextValue list;
  list.kind = TextValue::Kind::list;
  for (DefaultElement& element : default_elements(field)) {
    TextValue value;
    value.kind = element.quoted ? TextValue::Kind::quoted : TextValue::Kind::plain;
    value.text = std::move(element.text);
    list.elements.push_back(std::move(value));
  }
  return field.type.array == ArrayKind::none ? std::move(list.elements.front()) : std::move(list);
}

class Builder {
 public:
  Builder(const TypeTree& tree, std::size_t max_bytes)
      : tree_{tree}, out_{max_bytes}, max_bytes_{max_bytes} {}

  tl::expected<std::vector<std::byte>, ValueError> build(const TextValue& text) {
    if (!message(tree_.root(), &text)) {
      return tl::unexpected{std::move(error_)};
    }
    return out_.take();
  }

 private:
  // Each function writes a value, or zeros and defaults if the text has none. After false, error_ says why.

  bool message(const MessageDefinition& type, const TextValue* value) {
    std::vector<const TextValue*> given(type.fields.size());
    if (value != nullptr && !sort_fields(type, *value, given)) {
      return false;
    }
    if (type.fields.empty()) {
      out_.number(std::uint8_t{0});  // what generates IDL puts a byte into empty messages
    }
    for (std::size_t at = 0; at < type.fields.size(); ++at) {
      const Field& one = type.fields[at];
      path_.push_back({&one.name, 0});
      if (given[at] == nullptr && !one.default_value.empty()) {
        const TextValue by_default = default_value(one);
        if (!field(one.type, &by_default)) {
          return false;
        }
      } else if (!field(one.type, given[at])) {
        return false;
      }
      path_.pop_back();
    }
    return !out_.failed() || too_large(value);
  }

  /// Finds the elements of a mapping that belong to the fields of a message.
  bool sort_fields(const MessageDefinition& type, const TextValue& value,
                   std::vector<const TextValue*>& given) {
    if (value.kind != Kind::mapping) {
      return fail(value, fmt::format("a mapping with fields of {} ({})", type.name, names(type)));
    }
    for (const TextValue& element : value.elements) {
      const auto at = std::ranges::find(type.fields, element.key, &Field::name);
      if (at == type.fields.end()) {
        return fail_at(element.key_place, fmt::format("{} is no field of {}; expected {}",
                                                      excerpt(element.key), type.name, names(type)));
      }
      const TextValue*& place = given[static_cast<std::size_t>(at - type.fields.begin())];
      if (place != nullptr) {
        return fail_at(element.key_place, fmt::format("{} is given twice, first in line {}",
                                                      excerpt(element.key), place->key_place.line));
      }
      place = &element;
    }
    return true;
  }

  static std::string names(const MessageDefinition& type) {
    constexpr std::size_t shown_max = 30;
    std::string result;
    for (std::size_t at = 0; at < std::min(type.fields.size(), shown_max); ++at) {
      result += (at == 0 ? "" : ", ") + type.fields[at].name;
    }
    return type.fields.empty() ? "no fields" : type.fields.size() > shown_max ? result + ", ..." : result;
  }

  bool field(const FieldType& type, const TextValue* value) {
    if (type.array == ArrayKind::none) {
      return single(type, value);
    }
    const bool fixed = type.array == ArrayKind::fixed;
    if (value == nullptr) {
      if (!fixed) {
        out_.number(std::uint32_t{0});
        return true;
      }
      if (type.primitive && width(*type.primitive) != 0) {
        out_.zeros(type.array_size, width(*type.primitive));
        return !out_.failed() || too_large(nullptr);
      }
      return elements(type, type.array_size, nullptr);
    }
    if (value->kind != Kind::list) {
      return is_byte(type) ? bytes(type, *value) : fail(*value, expected_array(type));
    }
    if (!fits(type, value->elements.size())) {
      return fail(*value, expected_array(type));
    }
    if (!fixed) {
      out_.number(static_cast<std::uint32_t>(value->elements.size()));
    }
    return elements(type, value->elements.size(), value->elements.data());
  }

  bool elements(const FieldType& type, std::size_t count, const TextValue* values) {
    for (std::size_t at = 0; at < count; ++at) {
      path_.push_back({nullptr, at});
      if (!single(type, values == nullptr ? nullptr : values + at)) {
        return false;
      }
      if (out_.failed()) {
        return too_large(values);
      }
      path_.pop_back();
    }
    return true;
  }

  static bool is_byte(const FieldType& type) {
    return type.primitive == Primitive::byte || type.primitive == Primitive::character ||
           type.primitive == Primitive::uint8;
  }

  static bool fits(const FieldType& type, std::size_t count) {
    switch (type.array) {
      case ArrayKind::fixed:
        return count == type.array_size;
      case ArrayKind::bounded:
        return count <= type.array_size;
      case ArrayKind::none:
      case ArrayKind::unbounded:
        break;
    }
    return count <= std::numeric_limits<std::uint32_t>::max();
  }

  static std::string expected_array(const FieldType& type) {
    const std::string of = type.primitive ? to_string(*type.primitive) : type.message;
    const std::string bytes = is_byte(type) ? ", or a string with base64 or \"hex:00ff\"" : "";
    switch (type.array) {
      case ArrayKind::fixed:
        return fmt::format("a list of {} {}{}", type.array_size, of, bytes);
      case ArrayKind::bounded:
        return fmt::format("a list of at most {} {}{}", type.array_size, of, bytes);
      case ArrayKind::none:
      case ArrayKind::unbounded:
        break;
    }
    return fmt::format("a list of {}{}", of, bytes);
  }

  /// An array of bytes written as one string.
  bool bytes(const FieldType& type, const TextValue& value) {
    constexpr std::string_view hex = "hex:";
    std::optional<std::vector<std::byte>> read;
    if (value.text.starts_with(hex) && value.kind != Kind::binary) {
      read = from_hex(std::string_view{value.text}.substr(hex.size()));
    } else if (value.kind == Kind::quoted || value.kind == Kind::binary) {
      read = from_base64(value.text);
    }
    if (!read) {
      return fail(value, expected_array(type));
    }
    if (!fits(type, read->size())) {
      return fail_at(value.place,
                     fmt::format("expected {}, found {} bytes", expected_array(type), read->size()));
    }
    if (type.array != ArrayKind::fixed) {
      out_.number(static_cast<std::uint32_t>(read->size()));
    }
    out_.bytes(*read);
    return true;
  }

  bool single(const FieldType& type, const TextValue* value) {
    if (!type.primitive) {
      return message(tree_.messages[type.message_index], value);
    }
    switch (*type.primitive) {
      case Primitive::boolean:
        return boolean(value);
      case Primitive::string:
        return string(value, type.string_bound);
      case Primitive::wstring:
        return wstring(value, type.string_bound);
      default:
        return visit_number(*type.primitive, [&]<typename T>(T /*zero*/) { return number<T>(value); });
    }
  }

  static bool may_be_number(const TextValue& value) {
    return value.kind == Kind::plain || value.kind == Kind::literal;
  }

  bool boolean(const TextValue* value) {
    bool state = false;
    if (value != nullptr) {
      const std::string& text = value->text;
      state = text == "true" || text == "True" || text == "TRUE";
      if (!may_be_number(*value) || (!state && text != "false" && text != "False" && text != "FALSE")) {
        return fail(*value, "true or false");
      }
    }
    out_.number(std::uint8_t{state});
    return true;
  }

  template <typename T>
  bool number(const TextValue* value) {
    T number = 0;
    if (value != nullptr) {
      const auto read = read_number<T>(*value);
      if (!read) {
        return fail(*value, fmt::format("a {}number from {} to {}{}", std::is_integral_v<T> ? "whole " : "",
                                        std::numeric_limits<T>::lowest(), std::numeric_limits<T>::max(),
                                        std::is_integral_v<T> ? "" : " or NaN"));
      }
      number = *read;
    }
    out_.number(bits_of(number));
    return true;
  }

  template <std::integral T>
  static std::optional<T> read_number(const TextValue& value) {
    return may_be_number(value) ? read_integer<T>(value.text) : std::nullopt;
  }
  template <std::floating_point T>
  static std::optional<T> read_number(const TextValue& value) {
    if (may_be_number(value)) {
      return read_float<T>(value.text);
    }
    // JSON can express NaN only as a string.
    const auto special = value.kind == Kind::quoted ? read_special(value.text) : std::nullopt;
    return special ? std::optional{static_cast<T>(*special)} : std::nullopt;
  }

  /// The text for a string field; null if `value` is not a string.
  static const std::string* text_of(const TextValue& value) {
    return value.kind == Kind::plain || value.kind == Kind::quoted ? &value.text : nullptr;
  }

  static std::string expected_string(std::uint32_t bound, const char* unit) {
    return bound == 0 ? "a string" : fmt::format("a string of at most {} {}", bound, unit);
  }

  bool string(const TextValue* value, std::uint32_t bound) {
    const std::string* const text = value == nullptr ? &empty_ : text_of(*value);
    if (text == nullptr || (bound != 0 && text->size() > bound)) {
      return fail(*value, expected_string(bound, "bytes"));
    }
    out_.number(static_cast<std::uint32_t>(text->size() + 1));
    out_.bytes(std::as_bytes(std::span{*text}));
    out_.number(std::uint8_t{0});
    return true;
  }

  bool wstring(const TextValue* value, std::uint32_t bound) {
    const std::string* const text = value == nullptr ? &empty_ : text_of(*value);
    if (text == nullptr) {
      return fail(*value, expected_string(bound, "UTF-16 units"));
    }
    std::vector<std::uint16_t> units;
    ByteView rest = std::as_bytes(std::span{*text});
    while (const auto character = someip::first_utf8(rest)) {
      std::array<std::byte, 4> utf16{};
      someip::put_utf16(character->code, utf16.data(), std::endian::big);
      for (std::size_t at = 0; at < someip::utf16_bytes(character->code); at += 2) {
        units.push_back(someip::load<std::uint16_t>(utf16.data() + at));
      }
      rest = rest.subspan(character->bytes);
    }
    if (bound != 0 && units.size() > bound) {
      return fail(*value, expected_string(bound, "UTF-16 units"));
    }
    out_.number(static_cast<std::uint32_t>(units.size()));
    for (const std::uint16_t unit : units) {
      out_.number(std::uint32_t{unit});
    }
    return true;
  }

  bool too_large(const TextValue* value) {
    return fail_at(value == nullptr ? TextPlace{} : value->place,
                   fmt::format("the message becomes larger than {} bytes", max_bytes_));
  }

  bool fail(const TextValue& value, const std::string& expected) {
    return fail_at(value.place.line == 0 ? value.key_place : value.place,
                   fmt::format("expected {}, found {}", expected, found(value)));
  }

  bool fail_at(TextPlace place, std::string text) {
    std::string path;
    for (const Step& step : path_) {
      if (step.name == nullptr) {
        path += fmt::format("[{}]", step.index);
      } else {
        path += (path.empty() ? "" : ".") + *step.name;
      }
    }
    error_ = {place, std::move(path), std::move(text)};
    return false;
  }

  struct Step {
    const std::string* name;  ///< of a field, or null for an element of an array
    std::size_t index;
  };

  const TypeTree& tree_;
  CdrWriter out_;
  std::size_t max_bytes_;
  std::vector<Step> path_;
  ValueError error_;
  const std::string empty_;
};

}  // namespace

tl::expected<std::vector<std::byte>, ValueError> build_sample(const TextValue& text, const TypeTree& tree,
                                                              std::size_t max_bytes) {
  return Builder{tree, max_bytes}.build(text);
}

}  // namespace trestle::messages
