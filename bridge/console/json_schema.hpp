#pragma once
#include <cstddef>
#include <string>

#include "bridge/messages/types/message_definition.hpp"

namespace trestle::console {

/// A type of more fields, those of nested messages counted as often as they occur, is not described.
inline constexpr std::size_t most_schema_fields = 2000;

/// What JSON of a type looks like that MessageValues prints, as a JSON Schema: for viewers that offer fields
/// to choose from. Byte arrays are strings ("hex:00ff").
[[nodiscard]] std::string json_schema(const messages::TypeTree& tree);

}  // namespace trestle::console
