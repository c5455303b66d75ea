#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

namespace trestle::messages {

/// A place in a text, both counted from 1 and in bytes. Line 0: the text as a whole.
struct TextPlace {
  int line = 0;
  int column = 0;
};

/// What is wrong with a text that should be a message.
struct ValueError {
  TextPlace place;
  std::string field;  ///< "header.stamp.sec", "fields[3].name"; empty: the message, or no YAML or JSON at all
  std::string text;   ///< one line: what was expected, and what is there
};

/// "2:7: header.stamp.sec: expected a whole number from 0 to 255, found '300'". Unknown parts are left out.
[[nodiscard]] std::string to_string(const ValueError& error);

/// A piece of YAML or JSON whose type nobody knows yet.
struct TextValue {
  enum class Kind : std::uint8_t {
    nothing,  ///< null
    literal,  ///< JSON: true, false or a number, as written
    plain,    ///< YAML: what stands without quotes, which may mean a number or a string
    quoted,   ///< certainly a string
    binary,   ///< YAML: a scalar tagged !!binary
    list,
    mapping,  ///< its elements have keys
  };
  Kind kind = Kind::nothing;
  TextPlace place;
  TextPlace key_place;
  std::string key;   ///< of an element of a mapping
  std::string text;  ///< of scalars; in UTF-8
  std::vector<TextValue> elements;
};

/// Lists and mappings may be nested this deep: more than any message is.
inline constexpr std::size_t max_text_depth = 80;

/// Longer text is not read.
inline constexpr std::size_t max_text_bytes = std::size_t{8} << 20U;

/// What makes a text neither YAML nor JSON before anybody parses it: its size, bytes that are not UTF-8,
/// zeros.
[[nodiscard]] std::optional<ValueError> unreadable(std::string_view text);

/// Reads one YAML document; an empty one is an empty mapping. Anchors are refused.
[[nodiscard]] tl::expected<TextValue, ValueError> parse_yaml_text(std::string_view text);
/// Reads one JSON value (RFC 8259).
[[nodiscard]] tl::expected<TextValue, ValueError> parse_json_text(std::string_view text);

/// What stands there, in a few words: "'abc'", "a list of 3 elements".
[[nodiscard]] std::string found(const TextValue& value);

/// The place of a field in a text, or of the message that contains it if the text does not mention the field.
/// @param field  "fields[3].name", as errors name it.
[[nodiscard]] TextPlace place_of(const TextValue& text, std::string_view field);

/// Puts a TextValue together from the events of a parser, which come in the order of the text.
class TextValueBuilder {
 public:
  void key(std::string key, TextPlace place);
  void scalar(TextValue::Kind kind, std::string text, TextPlace place);
  /// False: nested too deep.
  [[nodiscard]] bool begin(TextValue::Kind kind, TextPlace place);
  void end();

  /// Whether the next event of the mapping that is open should be a key.
  [[nodiscard]] bool expects_key() const noexcept {
    return !open_.empty() && open_.back().kind == TextValue::Kind::mapping && !has_key_;
  }
  [[nodiscard]] TextValue take() { return std::move(root_); }

 private:
  TextValue next(TextValue::Kind kind, TextPlace place);
  void add(TextValue value);

  TextValue root_;
  std::vector<TextValue> open_;
  std::string key_;
  TextPlace key_place_;
  bool has_key_ = false;
};

}  // namespace trestle::messages
