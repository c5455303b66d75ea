#pragma once
#include <cstdint>
#include <optional>

#include "someip/wire/endpoint.hpp"

namespace trestle::someip {

/// Has the system keep the errors that a UDP socket's datagrams met on their way (ICMP), to be read with
/// next_udp_error(). From then on each may also end the next call that sends or receives, in place of what
/// that would have done.
void keep_udp_errors(int fd, bool v6) noexcept;

struct UdpError {
  enum class Kind : std::uint8_t {
    other,        ///< for example, the datagram was too large
    unreachable,  ///< the receiver, its port or the way there is not there
    hearsay,      ///< a third host, for example a router, says so
  };
  Endpoint receiver{};  ///< where it was sent to
  Kind kind = Kind::other;
};

/// The oldest error that is kept, which it then is no more; nothing when there is none.
///
/// For a socket that sends to many, the kernel checks only that the datagram which an ICMP message quotes has
/// the address and port of this socket as its source. So anybody can send one. It counts as `unreachable`
/// only if it comes from the receiver itself, or from this host (nobody has answered to ARP). To forge that,
/// the receiver's address must be forged, as for a forged StopSubscribeEventgroup.
/// @param own  the address of this socket.
[[nodiscard]] std::optional<UdpError> next_udp_error(int fd, const IpAddress& own) noexcept;

}  // namespace trestle::someip
