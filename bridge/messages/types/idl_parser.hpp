#pragma once
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/messages/types/interface_name.hpp"
#include "bridge/messages/types/message_definition.hpp"

namespace trestle::messages {

/// Parses the text of a ROS 2 `.idl` file: what rosidl's own parser takes of OMG IDL 4.2, and what
/// rosidl_adapter writes. One struct is a message, X_Request and X_Response are a service, X_Goal, X_Result
/// and X_Feedback an action; what rosidl makes of these is added, as by parse_interface().
///
/// Refused by name, with the place: what ROS 2 cannot send (unions, enumerations, maps, inheritance ...),
/// what SOME/IP cannot say (wchar, long double), and @key and @optional, which change what is on the wire for
/// some. Other annotations mean nothing, but for @default.
///
/// @param name  the structs have to be in its modules and be named after it.
/// @param file  the file's name, for errors.
[[nodiscard]] tl::expected<std::vector<MessageDefinition>, TypeError> parse_idl(std::string_view text,
                                                                                const InterfaceName& name,
                                                                                const std::string& file);

}  // namespace trestle::messages
