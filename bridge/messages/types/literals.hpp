#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/messages/types/idl_lexer.hpp"
#include "bridge/messages/types/message_definition.hpp"

/// Constants and default values as `.msg` and `.idl` files write them.
namespace trestle::messages {

/// What is wrong with a literal, in one line; empty: nothing.
using Complaint = std::string;

/// Checks the value of a number, truth or string, which may stand in quotes.
/// @param string_bound  most characters of a string; 0: no bound.
[[nodiscard]] Complaint check_literal(Primitive type, std::uint32_t string_bound, std::string_view text);

/// Checks "[a, b, c]", a value of an array of primitives.
[[nodiscard]] Complaint check_array_literal(const FieldType& type, std::string_view text);

/// One value of a default: a number as it is written, "true" or "false", or the characters of a string.
struct DefaultElement {
  std::string text;
  bool quoted = false;  ///< a string that stood in quotes, which are gone
};

/// The default value of a field, which the parser of .msg files has checked: one element, or those of an
/// array. Empty when the field has none.
[[nodiscard]] std::vector<DefaultElement> default_elements(const Field& field);

/// How many characters the first of several elements has: up to the comma that is not inside quotes.
[[nodiscard]] std::size_t element_size(std::string_view text);

/// A value as it stands in an `.idl` file.
struct IdlLiteral {
  IdlToken token;                         ///< the number, TRUE or FALSE, or the first string
  std::vector<std::string_view> strings;  ///< string tokens, which belong together
  bool negative = false;
};

/// Writes a value of the type as a `.msg` file would, for default_elements(), and checks it.
/// @return what is wrong with it; empty: nothing, and `into` is set.
[[nodiscard]] Complaint spell_idl_literal(const IdlLiteral& value, const FieldType& type, std::string& into);

}  // namespace trestle::messages
