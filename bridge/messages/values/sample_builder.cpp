#include "bridge/messages/values/sample_builder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <limits>

#include "bridge/documents/section.hpp"
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
  Builder(const TypeTree& tree, std::size_t max_bytes, const Words* words, bool choose)
      : tree_{tree}, out_{max_bytes}, max_bytes_{max_bytes}, words_{words}, choose_{choose} {}

  tl::expected<std::vector<std::byte>, ValueError> build(const TextValue& text) {
    if (!root(text)) {
      return tl::unexpected{std::move(error_)};
    }
    return out_.take();
  }

 private:
  // Each function writes a value, or zeros and defaults if the text has none. After false, error_ says why.

  /// With words, the name of a single value may be left out: 50 in place of {opening: 50}.
  bool root(const TextValue& text) {
    const std::size_t message_index = tree_.messages.size() - 1;
    const MessageDefinition& type = tree_.root();
    const bool is_mapping = text.kind == Kind::mapping;
    if (words_ == nullptr) {
      return message(message_index, &text);
    }
    if (!words_->argument.empty()) {
      const bool is_named =
          is_mapping && text.elements.size() == 1 && text.elements.front().key == words_->argument;
      path_.push_back({&words_->argument, 0});
      return message(message_index, is_named ? &text.elements.front() : &text);
    }
    const MessageWords& words = words_->of(message_index);
    if (words.form != MessageWords::Form::structure || type.fields.size() != 1) {
      return message(message_index, &text);
    }
    const bool has_name =
        is_mapping && (text.elements.empty() || std::ranges::any_of(text.elements, [&](const TextValue& one) {
                         return one.key == type.fields[0].name || one.key == name_of(words, type, 0);
                       }));
    if (has_name) {
      return message(message_index, &text);
    }
    path_.push_back({&name_of(words, type, 0), 0});
    return present(type.fields[0].type, words_of(words, 0), &text) && (!out_.failed() || too_large(&text));
  }

  bool message(std::size_t index, const TextValue* value) {
    const MessageDefinition& type = tree_.messages[index];
    const MessageWords& words = words_ == nullptr ? Words::nothing : words_->of(index);
    if (words.form == MessageWords::Form::wrapper && type.fields.size() == 1) {
      return field(type.fields.front().type, words_of(words, 0), value) &&
             (!out_.failed() || too_large(value));
    }
    std::vector<const TextValue*> given(type.fields.size());
    if (value != nullptr && !sort_fields(type, words, *value, given)) {
      return false;
    }
    const bool is_choice = words.form == MessageWords::Form::choice;
    const bool takes_first = is_choice && choose_ && !type.fields.empty() &&
                             std::ranges::all_of(given, [](const TextValue* one) { return one == nullptr; });
    if (is_choice && !takes_first && !is_one(type, words, value, given)) {
      return false;
    }
    if (type.fields.empty()) {
      out_.number(std::uint8_t{0});  // what generates IDL puts a byte into empty messages
    }
    for (std::size_t at = 0; at < type.fields.size(); ++at) {
      const Field& one = type.fields[at];
      const FieldWords& own = words_of(words, at);
      path_.push_back({&name_of(words, type, at), 0});
      bool good = false;
      if (takes_first && at == 0) {
        out_.number(std::uint32_t{1});
        good = single(one.type, own, nullptr);
      } else if (is_choice || own.form == FieldWords::Form::optional) {
        good = maybe(one.type, own, given[at]);
      } else if (given[at] == nullptr && !one.default_value.empty()) {
        const TextValue by_default = default_value(one);
        good = field(one.type, own, &by_default);
      } else {
        good = field(one.type, own, given[at]);
      }
      if (!good) {
        return false;
      }
      path_.pop_back();
    }
    return !out_.failed() || too_large(value);
  }

  /// A T[<=1] that people take for a T which may be missing.
  bool maybe(const FieldType& type, const FieldWords& words, const TextValue* value) {
    const bool is_there = value != nullptr && value->kind != Kind::nothing;
    out_.number(std::uint32_t{is_there});
    return !is_there || single(type, words, value);
  }

  bool present(const FieldType& type, const FieldWords& words, const TextValue* value) {
    return words.form == FieldWords::Form::optional ? maybe(type, words, value) : field(type, words, value);
  }

  /// Of a choice.
  bool is_one(const MessageDefinition& type, const MessageWords& words, const TextValue* value,
              const std::vector<const TextValue*>& given) {
    const auto count = std::ranges::count_if(
        given, [](const TextValue* one) { return one != nullptr && one->kind != Kind::nothing; });
    if (count == 1) {
      return true;
    }
    const std::string expected = fmt::format("expected exactly one of {}", names(type, words));
    return fail_at(value == nullptr ? TextPlace{} : value->place,
                   fmt::format("{}, found {}", expected, count == 0 ? "none" : fmt::to_string(count)));
  }

  /// Finds the elements of a mapping that belong to the fields of a message.
  bool sort_fields(const MessageDefinition& type, const MessageWords& words, const TextValue& value,
                   std::vector<const TextValue*>& given) {
    const bool is_payload = words_ != nullptr && !words_->name.empty() && &type == &tree_.root();
    const std::string& what = is_payload ? words_->name : type.name;
    if (value.kind != Kind::mapping) {
      return fail(value, fmt::format("a mapping with fields of {} ({})", what, names(type, words)));
    }
    for (const TextValue& element : value.elements) {
      const std::size_t at = field_of(type, words, element.key);
      if (at == type.fields.size()) {
        return fail_at(element.key_place, fmt::format("{} is no field of {}; expected {}",
                                                      excerpt(element.key), what, names(type, words)));
      }
      const TextValue*& place = given[at];
      if (place != nullptr) {
        return fail_at(element.key_place, fmt::format("{} is given twice, first in line {}",
                                                      excerpt(element.key), place->key_place.line));
      }
      place = &element;
    }
    return true;
  }

  /// By the name that people use, or by that of the definition.
  static std::size_t field_of(const MessageDefinition& type, const MessageWords& words,
                              std::string_view name) {
    for (std::size_t at = 0; at < words.fields.size() && at < type.fields.size(); ++at) {
      if (name_of(words, type, at) == name) {
        return at;
      }
    }
    const auto found = std::ranges::find(type.fields, name, &Field::name);
    return static_cast<std::size_t>(found - type.fields.begin());
  }

  static std::string names(const MessageDefinition& type, const MessageWords& words) {
    constexpr std::size_t shown_max = 30;
    std::string result;
    for (std::size_t at = 0; at < std::min(type.fields.size(), shown_max); ++at) {
      result += (at == 0 ? "" : ", ") + name_of(words, type, at);
    }
    return type.fields.empty() ? "no fields" : type.fields.size() > shown_max ? result + ", ..." : result;
  }

  bool field(const FieldType& type, const FieldWords& words, const TextValue* value) {
    if (type.array == ArrayKind::none) {
      return single(type, words, value);
    }
    const bool fixed = type.array == ArrayKind::fixed;
    if (value == nullptr) {
      if (!fixed) {
        out_.number(std::uint32_t{0});
        return true;
      }
      if (type.primitive && width(*type.primitive) != 0 && words.enumerators == nullptr) {
        out_.zeros(type.array_size, width(*type.primitive));
        return !out_.failed() || too_large(nullptr);
      }
      return elements(type, words, type.array_size, nullptr);
    }
    if (words.form == FieldWords::Form::entries && value->kind == Kind::mapping) {
      const TextValue list = entries_of(*value);
      return array(type, words, list);
    }
    return array(type, words, *value);
  }

  /// {a: 1, b: 2} as [{key: a, value: 1}, {key: b, value: 2}].
  static TextValue entries_of(const TextValue& mapping) {
    TextValue list = mapping;
    list.kind = Kind::list;
    for (TextValue& element : list.elements) {
      TextValue entry;
      entry.kind = Kind::mapping;
      entry.place = element.key_place;
      TextValue key;
      key.kind = Kind::plain;
      key.place = key.key_place = element.key_place;
      key.text = std::exchange(element.key, "value");
      key.key = "key";
      entry.elements.push_back(std::move(key));
      entry.elements.push_back(std::move(element));
      element = std::move(entry);
    }
    return list;
  }

  bool array(const FieldType& type, const FieldWords& words, const TextValue& value) {
    if (value.kind != Kind::list) {
      return is_byte(type) ? bytes(type, value) : fail(value, expected_array(type));
    }
    if (!fits(type, value.elements.size())) {
      return fail(value, expected_array(type));
    }
    if (type.array != ArrayKind::fixed) {
      out_.number(static_cast<std::uint32_t>(value.elements.size()));
    }
    return elements(type, words, value.elements.size(), value.elements.data());
  }

  bool elements(const FieldType& type, const FieldWords& words, std::size_t count, const TextValue* values) {
    for (std::size_t at = 0; at < count; ++at) {
      path_.push_back({nullptr, at});
      if (!single(type, words, values == nullptr ? nullptr : values + at)) {
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

  bool single(const FieldType& type, const FieldWords& words, const TextValue* value) {
    if (!type.primitive) {
      return message(type.message_index, value);
    }
    if (words.enumerators != nullptr && value != nullptr) {
      return enumerator(*type.primitive, words, *value);
    }
    if (words.enumerators != nullptr && words.enumerators->by_value(0) == nullptr &&
        !words.enumerators->all().empty()) {
      put(*type.primitive, words.enumerators->all().front());  // zero would be none of them
      return true;
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

  void put(Primitive primitive, const Enumerators::Pair& one) {
    visit_number(primitive, [&]<typename T>(T /*zero*/) {
      if constexpr (std::is_integral_v<T>) {
        out_.number(bits_of(static_cast<T>(one.second)));
      }
    });
  }

  /// One of several names, or the number behind it.
  bool enumerator(Primitive primitive, const FieldWords& words, const TextValue& value) {
    const bool is_text = value.kind == Kind::plain || value.kind == Kind::quoted;
    const Enumerators::Pair* const named = is_text ? words.enumerators->by_name(value.text) : nullptr;
    if (named != nullptr) {
      put(primitive, *named);
      return true;
    }
    bool good = false;
    visit_number(primitive, [&]<typename T>(T /*zero*/) {
      if (const auto read = read_number<T>(value)) {
        out_.number(bits_of(*read));
        good = true;
      }
    });
    if (!good) {
      std::string likely;
      const std::string expected = enumerators(words, value.text, likely);
      fail(value, "one of " + expected);
      error_.text += likely.empty() ? "" : fmt::format("; did you mean {}?", likely);
    }
    return good;
  }

  /// @param likely  the one that `text` is most likely a slip of.
  static std::string enumerators(const FieldWords& words, std::string_view text, std::string& likely) {
    constexpr std::size_t shown_max = 30;
    std::vector<std::string> known;
    std::string expected;
    for (const auto& [name, number] : words.enumerators->all()) {
      if (known.size() < shown_max) {
        expected += fmt::format("{}{} ({})", known.empty() ? "" : ", ", name, number);
      }
      known.push_back(name);
    }
    expected += known.size() > shown_max ? ", ..." : "";
    likely = documents::nearest(text, known);
    return expected;
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
  const Words* words_;
  bool choose_;
  std::vector<Step> path_;
  ValueError error_;
  const std::string empty_;
};

}  // namespace

tl::expected<std::vector<std::byte>, ValueError> build_sample(const TextValue& text, const TypeTree& tree,
                                                              std::size_t max_bytes, const Words* words,
                                                              bool choose) {
  return Builder{tree, max_bytes, words, choose}.build(text);
}

}  // namespace trestle::messages
