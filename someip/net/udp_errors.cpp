#include "someip/net/udp_errors.hpp"

#include <netinet/icmp6.h>
#include <netinet/in.h>
#include <netinet/ip_icmp.h>
#include <sys/socket.h>
#include <time.h>  // NOLINT(modernize-deprecated-headers): errqueue.h needs its timespec

#include <linux/errqueue.h>

#include <array>
#include <cstddef>
#include <cstring>

#include "someip/net/addresses.hpp"
#include "someip/net/socket_calls.hpp"

namespace trestle::someip {
namespace {

// False for errors about a datagram that is too large, or of which a fragment was lost.
bool says_unreachable(const sock_extended_err& error) noexcept {
  return (error.ee_origin == SO_EE_ORIGIN_ICMP && error.ee_type == ICMP_DEST_UNREACH &&
          error.ee_code != ICMP_FRAG_NEEDED) ||
         (error.ee_origin == SO_EE_ORIGIN_ICMP6 && error.ee_type == ICMP6_DST_UNREACH);
}

// Who sent the ICMP message: its address follows the error.
IpAddress offender_of(const cmsghdr& part) noexcept {
  SocketAddress offender;
  const auto* const bytes = CMSG_DATA(&part) + sizeof(sock_extended_err);
  sa_family_t family = AF_UNSPEC;
  std::memcpy(&family, bytes, sizeof family);
  if (family != AF_INET && family != AF_INET6) {
    return {};
  }
  std::memcpy(offender.data(), bytes, family == AF_INET6 ? sizeof(sockaddr_in6) : sizeof(sockaddr_in));
  return offender.endpoint().address;
}

}  // namespace

void keep_udp_errors(int fd, bool v6) noexcept {
  set_option(fd, v6 ? IPPROTO_IPV6 : IPPROTO_IP, v6 ? IPV6_RECVERR : IP_RECVERR, 1);
}

std::optional<UdpError> next_udp_error(int fd, const IpAddress& own) noexcept {
  SocketAddress receiver;
  // The error, the address of its sender, and room for what other socket options may add.
  alignas(cmsghdr) std::array<std::byte, 512> control;
  msghdr message{};
  message.msg_name = receiver.data();
  message.msg_namelen = sizeof(sockaddr_storage);
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  if (recvmsg(fd, &message, MSG_ERRQUEUE) < 0) {
    return std::nullopt;
  }
  UdpError result;
  if (message.msg_namelen == 0) {
    return result;
  }
  result.receiver = receiver.endpoint();
  for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr; part = CMSG_NXTHDR(&message, part)) {
    if ((part->cmsg_level == IPPROTO_IP && part->cmsg_type == IP_RECVERR) ||
        (part->cmsg_level == IPPROTO_IPV6 && part->cmsg_type == IPV6_RECVERR)) {
      sock_extended_err error{};
      std::memcpy(&error, CMSG_DATA(part), sizeof error);
      if (says_unreachable(error)) {
        const IpAddress offender = offender_of(*part);
        result.kind = offender == result.receiver.address || offender == own ? UdpError::Kind::unreachable
                                                                             : UdpError::Kind::hearsay;
      }
    }
  }
  return result;
}

}  // namespace trestle::someip
