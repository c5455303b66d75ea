#pragma once
#include <string>

#include "bridge/messages/types/message_definition.hpp"

namespace trestle::record {

/// The encoding of such schemas.
inline constexpr const char* ros2msg_encoding = "ros2msg";

/// A type as the text of a schema: its `.msg` text, then those of all messages in it, each behind a line of
/// `=` and one with its name. Of what was read from `.idl` files, default values and constants are left out:
/// they play no part on the wire, and are written in another way there.
[[nodiscard]] std::string ros2msg(const messages::TypeTree& tree);

}  // namespace trestle::record
