#pragma once
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "bridge/describe/model.hpp"
#include "bridge/messages/types/message_definition.hpp"

namespace trestle::generate {

/// What the page makes a form of, for the values of one payload: {"type": N, "types": [{"label", "choice",
/// "fields": [{"name" (of ROS), "label" (of the description), "kind" ("bool", "integer", "float", "string",
/// "bytes", "message"), "what", "low", "high", "bound", "array" ("list", "fixed"), "size", "optional",
/// "enumerators": [[name, number]], "type": N, "default", "unit", "description"}]}]}. What does not apply has
/// no key. Numbers of integers are texts, as JavaScript's have 53 bits.
/// @param tree    the message that the values become.
/// @param values  what its fields are in the description, which knows names of people and enumerators.
[[nodiscard]] nlohmann::ordered_json form_of(const describe::Model& model, const messages::TypeTree& tree,
                                             const std::vector<describe::Value>& values);

}  // namespace trestle::generate
