#pragma once
#include <string>
#include <string_view>

namespace trestle::messages {

/// Appends text in double quotes, escaped so that JSON and YAML both read it: control characters, line
/// separators and what changes the direction of text are spelt \uXXXX, so that nothing that a peer sends can
/// steer a terminal. Bytes that are not valid UTF-8 become U+FFFD.
void append_quoted(std::string& out, std::string_view text);

/// Whether text may stand in YAML without quotes and is a string to all readers of YAML 1.1 and 1.2. True
/// for less than the standard allows.
[[nodiscard]] bool is_plain_yaml(std::string_view text);

/// Whether a name may be a key of a mapping without quotes.
[[nodiscard]] bool is_plain_key(std::string_view name);

/// A piece of somebody's text for a message: quoted, printable, and cut when it is long.
[[nodiscard]] std::string excerpt(std::string_view text);

}  // namespace trestle::messages
