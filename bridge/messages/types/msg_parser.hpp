#pragma once
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/messages/types/message_definition.hpp"

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

/// Parses a file of several messages with lines of `---` between them, as `.srv` and `.action` files are.
/// Each part is like the text of a `.msg` file, and may be empty.
///
/// @param names  those of the messages, as of parse_msg(); as many as the file must have.
[[nodiscard]] tl::expected<std::vector<MessageDefinition>, TypeError> parse_parts(
    std::string_view text, std::span<const std::string> names, const std::string& file);

/// The full name of a type: "pkg/msg/Type" from "pkg/msg/Type" or "pkg/Type", or nothing when it is not
/// formed like one.
[[nodiscard]] std::optional<std::string> full_type_name(std::string_view name);

}  // namespace trestle::messages
