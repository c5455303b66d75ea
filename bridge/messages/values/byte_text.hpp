#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "someip/wire/types.hpp"

/// Bytes as text, for arrays of bytes.
namespace trestle::messages {

/// Two lower-case digits for each byte.
void append_hex(std::string& out, ByteView bytes);
/// Digits of either case, nothing between them.
[[nodiscard]] std::optional<std::vector<std::byte>> from_hex(std::string_view digits);

/// The alphabet with '+' and '/', padded with '='.  (RFC 4648)
void append_base64(std::string& out, ByteView bytes);
/// Also without the padding; white space is skipped, as YAML breaks lines in it.
[[nodiscard]] std::optional<std::vector<std::byte>> from_base64(std::string_view text);

}  // namespace trestle::messages
