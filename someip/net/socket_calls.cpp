#include "someip/net/socket_calls.hpp"

#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <random>
#include <string>

#include "someip/net/address_text.hpp"
#include "someip/net/addresses.hpp"
#include "someip/net/net_error.hpp"

namespace trestle::someip {

Descriptor::~Descriptor() {
  if (fd_ >= 0) {
    close(fd_);
  }
}

namespace {

/// What to do where the system gives this port to programs that ask for any port, such as each one with DDS:
/// then it is in use now and then. Empty where it does not.
std::string why_in_use_now_and_then(std::uint16_t port) {
  unsigned first = 0;
  unsigned last = 0;
  std::ifstream{"/proc/sys/net/ipv4/ip_local_port_range"} >> first >> last;
  if (port < first || port > last) {
    return {};
  }
  return "; the system gives ports " + std::to_string(first) + " to " + std::to_string(last) +
         " to programs that ask for any: add this one to sysctl net.ipv4.ip_local_reserved_ports";
}

}  // namespace

void fail(Transport transport, const Endpoint& endpoint, const char* what, int error) {
  const bool udp = transport == Transport::udp;
  std::string text =
      (udp ? "UDP " : "TCP ") + to_string(endpoint) + ": cannot " + what + ": " + std::strerror(error);
  if (error == EADDRINUSE) {
    const bool group = endpoint.address.is_multicast();
    text += group ? "; another program has this multicast group's port, and does not share it"
                  : "; another program has this port of this address";
    text += udp ? " (find it with: ss -ulpn" : " (find it with: ss -tlpn";
    text += " 'sport = :" + std::to_string(endpoint.port) + "'): stop it";
    if (group) {
      text += ", or let it set SO_REUSEADDR; another address of this host would not help";
    } else {
      text += ", or use another address of this host";
      text += endpoint.address.v6 ? "" : ", such as 127.0.0.2 for tests on one machine";
      text += why_in_use_now_and_then(endpoint.port);
    }
  } else if (error == EADDRNOTAVAIL) {
    text += "; no interface of this host has this address (see: ip address)";
  } else if (error == EACCES) {
    text += "; ports below 1024 need root or CAP_NET_BIND_SERVICE";
  }
  throw NetError{text};
}

bool retry_later(int error) noexcept {
  return error == EAGAIN || error == EWOULDBLOCK || error == ENOBUFS || error == EINTR;
}

int set_option(int fd, int level, int name, int number) noexcept {
  return setsockopt(fd, level, name, &number, sizeof number);
}

int bind_to(int fd, Endpoint local, unsigned scope) {
  const auto try_bind = [&] {
    SocketAddress address{local, scope};
    return bind(fd, address.data(), address.size()) == 0 ? 0 : errno;
  };
  if (local.port != 0) {
    return try_bind();
  }
  constexpr unsigned count = 65536 - first_dynamic_port;
  const unsigned start = std::random_device{}();
  for (unsigned i = 0; i < count; ++i) {
    local.port = static_cast<std::uint16_t>(first_dynamic_port + (start + i) % count);
    const int error = try_bind();
    if (error != EADDRINUSE) {
      return error;
    }
  }
  return EADDRINUSE;
}

void set_dscp(int fd, std::uint8_t dscp) {
  if (dscp > 63) {
    throw NetError{"DSCP " + std::to_string(dscp) + ": it is 0 to 63"};
  }
  if (dscp != 0) {  // one of the two fits the socket
    set_option(fd, IPPROTO_IP, IP_TOS, dscp << 2);
    set_option(fd, IPPROTO_IPV6, IPV6_TCLASS, dscp << 2);
  }
}

void set_unicast_ttl(int fd, std::uint8_t hops) noexcept {
  if (hops != 0) {  // one of the two fits the socket
    set_option(fd, IPPROTO_IP, IP_TTL, hops);
    set_option(fd, IPPROTO_IPV6, IPV6_UNICAST_HOPS, hops);
  }
}

void set_buffer(int fd, int forced_name, int name, int bytes) noexcept {
  if (set_option(fd, SOL_SOCKET, forced_name, bytes) != 0) {  // needs CAP_NET_ADMIN
    set_option(fd, SOL_SOCKET, name, bytes);
  }
}

int buffer_bytes(int fd, int name) noexcept {
  int bytes = 0;
  socklen_t size = sizeof bytes;
  getsockopt(fd, SOL_SOCKET, name, &bytes, &size);
  return bytes / 2;  // the kernel reports twice what was asked for: half is for its bookkeeping
}

}  // namespace trestle::someip
