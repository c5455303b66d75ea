#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "bridge/messages/types/idl_lexer.hpp"
#include "bridge/messages/types/literals.hpp"
#include "bridge/messages/types/message_definition.hpp"

namespace trestle::messages {

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
