#pragma once
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/messages/types/interface_name.hpp"
#include "bridge/messages/types/message_definition.hpp"

namespace trestle::messages {

/// Parses the text of a `.msg`, `.srv` or `.action` file (which one, `name.kind` says) into the messages that
/// the file defines, with those that rosidl makes from it:
///  - of a service X: X_Request, X_Response and X_Event;
///  - of an action X: X_Goal, X_Result, X_Feedback, X_FeedbackMessage, and the messages of the services
///    X_SendGoal and X_GetResult.
///
/// @param file  the file's name, for errors.
[[nodiscard]] tl::expected<std::vector<MessageDefinition>, TypeError> parse_interface(
    std::string_view text, const InterfaceName& name, const std::string& file);

/// The messages that the file of an interface spells out, in their order.
[[nodiscard]] std::vector<std::string> message_names(const InterfaceName& name);

/// Adds what rosidl makes of the messages of a service or an action, as above.
void add_generated_messages(std::vector<MessageDefinition>& messages, const InterfaceName& name,
                            const std::string& file);

}  // namespace trestle::messages
