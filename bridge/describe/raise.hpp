#pragma once
#include <string>
#include <vector>

#include "bridge/describe/model.hpp"
#include "bridge/describe/raised_types.hpp"
#include "bridge/messages/convert/message_rules.hpp"
#include "bridge/messages/types/message_definition.hpp"
#include "bridge/messages/types/type_library.hpp"

namespace trestle::describe {

/// Adds the types of a ROS message to a model, with the wire rules of the specification, and its constants.
/// Each type is there once: Type::ros_name tells which it is, and lower() gives the same definitions back.
/// @param types  of the model: the same for all messages that are added to it.
/// @return the type of the message itself.
TypeIndex raise(RaisedTypes& types, const messages::TypeTree& tree);
/// The same with the wire rules of a route, as the payload that carries the message. One message with
/// different rules becomes several types, which are variants of the first.
/// @param name  of the payload's value.
/// @param lost  gets what the model has no form for, a line each.
[[nodiscard]] Payload raise(RaisedTypes& types, const messages::TypeTree& tree,
                            const messages::MessageRules& rules, std::string name,
                            std::vector<std::string>& lost);

/// The value that carries such a type whole.
[[nodiscard]] Value value_of(const Model& model, TypeIndex type, std::string name);

/// A method that is the ROS service. Its ids are open.
/// @param name  of the method.
[[nodiscard]] Method raise(RaisedTypes& types, const messages::ServiceTypes& service, std::string name);
/// The same with wire rules, as above.
[[nodiscard]] Method raise(RaisedTypes& types, const messages::ServiceTypes& service,
                           const messages::MessageRules& rules, std::string name,
                           std::vector<std::string>& lost);

}  // namespace trestle::describe
