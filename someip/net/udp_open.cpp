#include "someip/net/udp_open.hpp"

#include <net/if.h>
#include <netinet/udp.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>

#include "someip/net/addresses.hpp"
#include "someip/net/socket_calls.hpp"

namespace trestle::someip {
namespace {

[[noreturn]] void fail(const Endpoint& endpoint, const char* what, int error) {
  someip::fail(Transport::udp, endpoint, what, error);
}

/// Joins or leaves a group; 0 for success.
int change_membership(int fd, const IpAddress& group, unsigned interface, bool join) {
  if (group.v6) {
    ipv6_mreq request{};
    std::memcpy(&request.ipv6mr_multiaddr, group.bytes.data(), sizeof request.ipv6mr_multiaddr);
    request.ipv6mr_interface = interface;
    return setsockopt(fd, IPPROTO_IPV6, join ? IPV6_JOIN_GROUP : IPV6_LEAVE_GROUP, &request, sizeof request);
  }
  ip_mreqn request{};
  std::memcpy(&request.imr_multiaddr, group.bytes.data(), sizeof request.imr_multiaddr);
  request.imr_ifindex = static_cast<int>(interface);
  return setsockopt(fd, IPPROTO_IP, join ? IP_ADD_MEMBERSHIP : IP_DROP_MEMBERSHIP, &request, sizeof request);
}

void join_group(int fd, const UdpOptions& options, unsigned interface) {
  if (change_membership(fd, *options.join, interface, true) != 0) {
    fail({*options.join, options.local.port}, "join the multicast group", errno);
  }
  if (!options.join->v6) {
    // Receive only from groups that this socket joined, not those that other programs of this host did.
    set_option(fd, IPPROTO_IP, IP_MULTICAST_ALL, 0);
  }
}

void send_multicast_from(int fd, const UdpOptions& options, unsigned interface) {
  int result = 0;
  if (options.interface->own.v6) {
    result = set_option(fd, IPPROTO_IPV6, IPV6_MULTICAST_IF, static_cast<int>(interface)) |
             set_option(fd, IPPROTO_IPV6, IPV6_MULTICAST_HOPS, options.multicast_ttl);
  } else {
    ip_mreqn request{};
    std::memcpy(&request.imr_address, options.interface->own.bytes.data(), sizeof request.imr_address);
    request.imr_ifindex = static_cast<int>(interface);
    result = setsockopt(fd, IPPROTO_IP, IP_MULTICAST_IF, &request, sizeof request) |
             set_option(fd, IPPROTO_IP, IP_MULTICAST_TTL, options.multicast_ttl);
  }
  if (result != 0) {
    fail(options.local, "choose the interface for multicast", errno);
  }
}

}  // namespace

unsigned udp_interface(const UdpOptions& options) {
  if (!options.interface) {
    return 0;
  }
  const MulticastInterface& wanted = *options.interface;
  if (!wanted.name.empty()) {
    const unsigned index = if_nametoindex(wanted.name.c_str());
    if (index == 0) {
      throw NetError{"there is no network interface '" + wanted.name + "' (see: ip link)"};
    }
    return index;
  }
  const unsigned index = interface_of(wanted.own);
  if (index == 0) {
    fail({wanted.own, options.local.port}, "find the network interface", EADDRNOTAVAIL);
  }
  return index;
}

unsigned follow_interface(int fd, const UdpOptions& options, unsigned before) {
  const unsigned interface = udp_interface(options);
  if (interface == before) {
    return interface;  // the system keeps our membership there, also while the interface is down
  }
  if (options.join) {
    change_membership(fd, *options.join, before, false);  // the number of memberships of a socket is limited
    join_group(fd, options, interface);
  }
  send_multicast_from(fd, options, interface);
  return interface;
}

int open_udp(const UdpOptions& options) {
  const bool v6 = options.local.address.v6;
  const int fd = ::socket(v6 ? AF_INET6 : AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  Descriptor socket{fd};
  if (fd < 0) {
    fail(options.local, "open a socket", errno);
  }
  const unsigned interface = udp_interface(options);
  if (v6) {
    set_option(fd, IPPROTO_IPV6, IPV6_V6ONLY, 1);
  }
  if (options.sharing != PortSharing::exclusive) {
    // SO_REUSEADDR below would also give us an address that another socket has, together with its datagrams.
    if (options.sharing == PortSharing::by_address && udp_endpoint_in_use(options.local)) {
      fail(options.local, "bind", EADDRINUSE);
    }
    set_option(fd, SOL_SOCKET, SO_REUSEADDR, 1);
    // Two sockets share a port when both ask for it in the same way. Most stacks ask for SO_REUSEADDR; some,
    // such as pysomeip, only for SO_REUSEPORT. Multicast datagrams reach each socket; unicast datagrams would
    // be divided among the sockets of an address.
    if (options.local.address.is_multicast()) {
      set_option(fd, SOL_SOCKET, SO_REUSEPORT, 1);
    }
  }
  set_buffer(fd, SO_RCVBUFFORCE, SO_RCVBUF, options.receive_buffer_bytes);
  set_buffer(fd, SO_SNDBUFFORCE, SO_SNDBUF, options.send_buffer_bytes);
  if (options.busy_poll.count() > 0) {
    set_option(fd, SOL_SOCKET, SO_BUSY_POLL, static_cast<int>(options.busy_poll.count()));
  }
  set_option(fd, SOL_SOCKET, SO_RXQ_OVFL, 1);
  set_option(fd, SOL_UDP, UDP_GRO, 1);  // an older kernel delivers datagram by datagram
  set_dscp(fd, options.dscp);
  set_unicast_ttl(fd, options.unicast_ttl);
  if (const int error = bind_to(fd, options.local, v6 ? interface : 0); error != 0) {
    fail(options.local, "bind", error);
  }
  if (options.join) {
    join_group(fd, options, interface);
  }
  if (options.interface) {
    send_multicast_from(fd, options, interface);
  }
  return socket.release();
}

}  // namespace trestle::someip
