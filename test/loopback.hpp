#pragma once
#include <unistd.h>

#include "someip/wire/endpoint.hpp"

namespace trestle::test {

/// Addresses on loopback that only this test process uses, so that tests can run beside each other and beside
/// other SOME/IP stacks: 127.x.y.`host`.
[[nodiscard]] inline IpAddress own_address(std::uint8_t host) {
  const auto pid = static_cast<unsigned>(getpid());
  return IpAddress::v4(127, static_cast<std::uint8_t>(1 + (pid >> 8U) % 254), static_cast<std::uint8_t>(pid),
                       host);
}

/// A multicast group that only this test process uses.
[[nodiscard]] inline IpAddress own_group() {
  const auto pid = static_cast<unsigned>(getpid());
  return IpAddress::v4(239, 255, static_cast<std::uint8_t>(pid >> 8U), static_cast<std::uint8_t>(pid));
}

}  // namespace trestle::test
