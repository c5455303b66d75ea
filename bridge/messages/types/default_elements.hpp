#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "bridge/messages/types/message_definition.hpp"

namespace trestle::messages {

/// One value of a default: a number as it is written, "true" or "false", or the characters of a string.
struct DefaultElement {
  std::string text;
  bool quoted = false;  ///< a string that stood in quotes, which are gone
};

/// The default value of a field, which the parser of .msg files has checked: one element, or those of an
/// array. Empty when the field has none.
[[nodiscard]] std::vector<DefaultElement> default_elements(const Field& field);

/// Without the spaces and tabs at both ends.
[[nodiscard]] std::string_view trimmed(std::string_view text);
/// How many characters the first of several elements has: up to the comma that is not inside quotes.
[[nodiscard]] std::size_t element_size(std::string_view text);

}  // namespace trestle::messages
