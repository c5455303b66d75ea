#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "bridge/messages/values/message_values.hpp"

namespace trestle::messages {

/// The values of a message that a text does not mention, by the names that people give them. parse() takes
/// their defaults, or zeros.
/// @param text  one that parse() takes.
/// @return empty too where a text is the one value itself. What may be missing, and what structures have
///         beside it, is not looked into.
[[nodiscard]] std::vector<std::string> left_out(const MessageValues& values, std::string_view text,
                                                ValueForm form);

}  // namespace trestle::messages
