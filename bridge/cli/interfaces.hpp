#pragma once
#include <optional>
#include <string>

#include "someip/wire/endpoint.hpp"

namespace trestle::cli {

/// Name of the network interface that has this address; nothing when none has.
[[nodiscard]] std::optional<std::string> interface_name(const IpAddress& address);
/// The first address of an interface, IPv4 or IPv6; nothing when it has none.
[[nodiscard]] std::optional<IpAddress> address_of_interface(const std::string& name, bool v6);

}  // namespace trestle::cli
