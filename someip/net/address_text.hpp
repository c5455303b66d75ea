#pragma once
#include <optional>
#include <string>

#include "someip/wire/endpoint.hpp"

namespace trestle::someip {

/// "127.0.0.1", "fe80::1".
[[nodiscard]] std::string to_string(const IpAddress& address);
/// "127.0.0.1:30490", "[fe80::1]:30490".
[[nodiscard]] std::string to_string(const Endpoint& endpoint);
/// Nothing when `text` is no address.
[[nodiscard]] std::optional<IpAddress> parse_address(const std::string& text);

}  // namespace trestle::someip
