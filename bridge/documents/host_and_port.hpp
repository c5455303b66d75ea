#pragma once
#include <cstdint>
#include <optional>
#include <string_view>

namespace trestle::documents {

/// "10.0.0.1", "host:11811", "fd00::1", "[fd00::1]:11811", taken apart.
struct HostAndPort {
  std::string_view host{};              ///< without brackets; whether there is such a host nobody has asked
  bool v6 = false;                      ///< it is written as IPv6 addresses are, and can be nothing else
  std::optional<std::uint16_t> port{};  ///< from 1 on
};

/// Nothing: a bracket that is not closed, or what is no port behind the host.
[[nodiscard]] std::optional<HostAndPort> host_and_port(std::string_view text);

}  // namespace trestle::documents
