#pragma once
#include <string>
#include <string_view>

namespace trestle::documents {

/// The SHA-256 of a text, as 64 hexadecimal digits; empty if OpenSSL cannot make it.
[[nodiscard]] std::string sha256(std::string_view text);

}  // namespace trestle::documents
