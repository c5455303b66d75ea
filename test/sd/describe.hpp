#pragma once
#include <string>
#include <vector>

#include "sd/core/service_discovery.hpp"

namespace trestle::test {

/// "10.0.0.1:30509"; IPv6 as hexadecimal digits.
std::string describe(const Endpoint& endpoint);

/// Every field of an SD entry and of what it references, in a line that a test can show:
/// "offer 1234.5678 v1.0 ttl 3 udp 10.0.0.1:30509",
/// "subscribe 1234.5678 v1 group 4465 ttl 3 counter 0 initial udp 10.0.0.2:40000".
/// Numbers of ids are hexadecimal.
std::string describe(const sd::SdMessage& message, const sd::Entry& entry);

/// A whole SD datagram: "s1 reboot: offer ...; find ...". Flags other than "reboot" are told when they are
/// not unicast and explicit initial data.
std::string describe_datagram(ByteView datagram);

/// "available 1234.5678 v1.0 udp 10.0.0.1:30509 at 10.0.0.1:30490" and the like.
std::string describe(const sd::Happening& event);

}  // namespace trestle::test
