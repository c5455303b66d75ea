#pragma once
#include <string_view>
#include <vector>

#include "someip/wire/types.hpp"

namespace trestle::documents {

/// Reads the bytes that a line of hexadecimal digits stands for. Between bytes white space, ':', '-' and ','
/// may stand, and "0x" before the first or before each.
/// @return the bytes, or how many characters are fine before the first one that is not.
[[nodiscard]] tl::expected<std::vector<std::byte>, std::size_t> parse_hex_line(std::string_view line);

}  // namespace trestle::documents
