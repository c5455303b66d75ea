#pragma once
#include <optional>

#include "someip/wire/endpoint.hpp"

namespace trestle::someip {

/// Has the system keep the errors that a UDP socket's datagrams met on their way (ICMP), to be read with
/// next_udp_error(). From then on each may also end the next call that sends or receives, in place of what
/// that would have done.
void keep_udp_errors(int fd, bool v6) noexcept;

/// An error that a datagram met.
struct UdpError {
  Endpoint receiver{};       ///< where it was sent to
  bool unreachable = false;  ///< the receiver, its port or the way there is not there; false: something else
};

/// The oldest error that is kept, which it then is no more; nothing when there is none.
///
/// Whoever can forge the address of a host on the way can forge such an error: for a socket that sends to
/// many, the kernel checks only that the datagram which the ICMP message quotes has the address and port of
/// this socket as its source. That is no more than a forged StopSubscribeEventgroup would take.
[[nodiscard]] std::optional<UdpError> next_udp_error(int fd) noexcept;

}  // namespace trestle::someip
