#pragma once
#include "someip/net/udp_socket.hpp"

namespace trestle::someip {

/// A socket as these options want it.
/// @throws NetError
[[nodiscard]] int open_udp(const UdpOptions& options);

/// The index of the interface for multicast; 0 when none is asked for.
/// @throws NetError when there is none such.
[[nodiscard]] unsigned udp_interface(const UdpOptions& options);

/// When the interface for multicast may have been removed and made anew: joins and sends there.
/// @param before  its index so far.
/// @return its index now.
/// @throws NetError
unsigned follow_interface(int fd, const UdpOptions& options, unsigned before);

}  // namespace trestle::someip
