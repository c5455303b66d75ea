#pragma once
#include <algorithm>

#include "bridge/messages/types/message_definition.hpp"

namespace trestle::messages {

/// Whether rosidl estimates too large a size for samples of a type: it adds padding for the numbers after the
/// count of a sequence, which an empty sequence does not have, and a terminator for wstrings.
[[nodiscard]] inline bool is_overestimated(const TypeTree& tree) {
  return std::ranges::any_of(tree.messages, [](const MessageDefinition& definition) {
    return std::ranges::any_of(definition.fields, [](const Field& field) {
      const bool is_sequence =
          field.type.array == ArrayKind::bounded || field.type.array == ArrayKind::unbounded;
      return field.type.primitive == Primitive::wstring ||
             (field.type.primitive && width(*field.type.primitive) == 8 && is_sequence);
    });
  });
}

}  // namespace trestle::messages
