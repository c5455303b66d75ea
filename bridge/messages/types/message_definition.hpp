#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// ROS 2 messages as data: what a file says, and a type with everything it is made of.
namespace trestle::messages {

/// The types that need no definition. In ROS 2, `byte` and `char` are both one unsigned byte.
enum class Primitive : std::uint8_t {
  boolean,
  byte,
  character,
  int8,
  uint8,
  int16,
  uint16,
  int32,
  uint32,
  int64,
  uint64,
  float32,
  float64,
  string,
  wstring,
};

/// The name that `.msg` files use: "bool", "char", "uint16".
[[nodiscard]] const char* to_string(Primitive primitive) noexcept;

/// Bytes of a number, bool, byte or char; 0 for strings.
[[nodiscard]] constexpr std::uint8_t width(Primitive primitive) noexcept {
  switch (primitive) {
    case Primitive::boolean:
    case Primitive::byte:
    case Primitive::character:
    case Primitive::int8:
    case Primitive::uint8:
      return 1;
    case Primitive::int16:
    case Primitive::uint16:
      return 2;
    case Primitive::int32:
    case Primitive::uint32:
    case Primitive::float32:
      return 4;
    case Primitive::int64:
    case Primitive::uint64:
    case Primitive::float64:
      return 8;
    case Primitive::string:
    case Primitive::wstring:
      break;
  }
  return 0;
}

/// Calls `visit` with a zero of the C++ type that a number, byte or char has.
/// @param primitive  no bool and no string.
template <typename Visit>
auto visit_number(Primitive primitive, const Visit& visit) {
  switch (primitive) {
    case Primitive::int8:
      return visit(std::int8_t{});
    case Primitive::int16:
      return visit(std::int16_t{});
    case Primitive::uint16:
      return visit(std::uint16_t{});
    case Primitive::int32:
      return visit(std::int32_t{});
    case Primitive::uint32:
      return visit(std::uint32_t{});
    case Primitive::int64:
      return visit(std::int64_t{});
    case Primitive::uint64:
      return visit(std::uint64_t{});
    case Primitive::float32:
      return visit(float{});
    case Primitive::float64:
      return visit(double{});
    default:
      return visit(std::uint8_t{});
  }
}

/// How many elements a field has.
enum class ArrayKind : std::uint8_t {
  none,
  fixed,      ///< T[N]: always N elements
  bounded,    ///< T[<=N]: up to N
  unbounded,  ///< T[]
};

/// The type of a field: a primitive or a message, perhaps an array of them.
struct FieldType {
  std::optional<Primitive> primitive{};  ///< nothing: a message
  std::string message{};                 ///< "pkg/msg/Type" of a message
  std::size_t message_index = 0;         ///< of a message, in its TypeTree; without meaning outside of one
  std::uint32_t string_bound = 0;  ///< most characters (bytes, or UTF-16 units) of a string; 0: no bound
  ArrayKind array = ArrayKind::none;
  std::uint32_t array_size = 0;  ///< N of fixed and bounded arrays
  friend bool operator==(const FieldType&, const FieldType&) = default;
};

/// What people wrote beside a message, a field or a constant, for other people. Plays no part in ROS.
struct Comment {
  std::string text{};  ///< lines, without comment signs
  std::string unit{};  ///< of a number: "km/h"
  friend bool operator==(const Comment&, const Comment&) = default;
};

/// A field of a message, in the order of the wire.
struct Field {
  std::string name;
  FieldType type;
  std::string default_value;  ///< as written; empty: none. Never on the wire.
  int line = 0;               ///< in its file, from 1
  int column = 0;             ///< of the type
  /// "bytes" of a comment "# trestle: bytes" behind the field: what it was in the interface description that
  /// the file was made of. Empty: nothing else. docs/describe_types.md has the list. Plays no part in ROS.
  std::string mark{};
  Comment comment{};
};

/// What such a comment begins with.
inline constexpr std::string_view mark_comment = "# trestle: ";
/// Of the whole comment; a longer one is no mark.
inline constexpr std::size_t max_mark_bytes = 1024;

/// A constant of a message; never on the wire.
struct Constant {
  std::string name;
  Primitive type = Primitive::int32;
  std::string value;  ///< as written, with the quotes of a string
  Comment comment{};
};

/// One message type as its file defines it.
struct MessageDefinition {
  std::string name;  ///< "pkg/msg/Type"
  std::string file;  ///< where it was read, for messages
  std::vector<Field> fields;
  std::vector<Constant> constants;
  bool is_idl = false;  ///< read from an `.idl` file, where char is a type of its own, and no uint8
  Comment comment{};    ///< of the first part of a `.srv` file: of the service
  std::string mark{};   ///< "union" of a line "# trestle: union" before the fields; as Field::mark
};

/// A message type and all that it is made of. Each message stands before those that use it, the type itself
/// is the last; a field's `message_index` says where its message stands.
struct TypeTree {
  std::vector<MessageDefinition> messages;
  [[nodiscard]] const MessageDefinition& root() const { return messages.back(); }
};

/// What is wrong with a type, and where.
struct TypeError {
  std::string file;  ///< empty: nothing was read yet
  int line = 0;      ///< from 1; 0: the file as a whole
  int column = 0;
  std::string text;  ///< one line: what is there, and what was expected
};

/// "file:line:column: text", without the parts that are not known.
[[nodiscard]] std::string to_string(const TypeError& error);

}  // namespace trestle::messages
