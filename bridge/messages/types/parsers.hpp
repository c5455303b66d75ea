#pragma once
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/messages/types/interface_name.hpp"
#include "bridge/messages/types/message_definition.hpp"

/// From the texts of files to definitions.
namespace trestle::messages {

/// Larger `.msg` files are refused unread.
inline constexpr std::size_t max_msg_file_bytes = std::size_t{1} << 20U;

/// Parses the text of a ROS 2 `.msg` file: fields of every kind, bounds, constants, default values, comments.
///
/// Constants and default values are checked against their type. A message named without a package is of the
/// same package, except for `Header`, which TypeLibrary also looks for in std_msgs.
///
/// @param name  "pkg/msg/Type" of the message.
/// @param file  the file's name, for errors.
[[nodiscard]] tl::expected<MessageDefinition, TypeError> parse_msg(std::string_view text,
                                                                   const std::string& name,
                                                                   const std::string& file);

/// Where the comment begins that ends a line of such a file: the first '#' that is not inside quotes. The
/// line's size if there is none.
[[nodiscard]] std::size_t comment_begin(std::string_view line);

/// Parses a file of several messages with lines of `---` between them, as `.srv` and `.action` files are.
/// Each part is like the text of a `.msg` file, and may be empty.
///
/// @param names  those of the messages, as of parse_msg(); as many as the file must have.
[[nodiscard]] tl::expected<std::vector<MessageDefinition>, TypeError> parse_parts(
    std::string_view text, std::span<const std::string> names, const std::string& file);

/// The full name of a type: "pkg/msg/Type" from "pkg/msg/Type" or "pkg/Type", or nothing when it is not
/// formed like one.
[[nodiscard]] std::optional<std::string> full_type_name(std::string_view name);

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

/// Parses the text of a ROS 2 `.idl` file: what rosidl's own parser takes of OMG IDL 4.2, and what
/// rosidl_adapter writes. One struct is a message, X_Request and X_Response are a service, X_Goal, X_Result
/// and X_Feedback an action; what rosidl makes of these is added, as by parse_interface().
///
/// Refused by name, with the place: what ROS 2 cannot send (unions, enumerations, maps, inheritance ...),
/// what SOME/IP cannot say (wchar, long double), and @key and @optional, which change what is on the wire for
/// some. Other annotations mean nothing, but for @default, @unit and @verbatim (language="comment"): the last
/// two, and comments above and behind a declaration, are what people wrote beside it.
///
/// @param name  the structs have to be in its modules and be named after it.
/// @param file  the file's name, for errors.
[[nodiscard]] tl::expected<std::vector<MessageDefinition>, TypeError> parse_idl(std::string_view text,
                                                                                const InterfaceName& name,
                                                                                const std::string& file);

}  // namespace trestle::messages
