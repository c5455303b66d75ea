#include "someip/net/neighbours.hpp"

#include <linux/neighbour.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "someip/net/addresses.hpp"
#include "someip/net/netlink.hpp"

namespace trestle::someip {
namespace {

std::string interface_name(const IpAddress& own) {
  std::array<char, IF_NAMESIZE> name{};
  return if_indextoname(interface_of(own), name.data()) == nullptr ? std::string{} : std::string{name.data()};
}

int open_socket(bool v6) {
  return v6 ? ::socket(AF_NETLINK, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, NETLINK_ROUTE)
            : ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
}

arpreq request_of(const IpAddress& host, const std::string& interface) {
  arpreq request{};
  SocketAddress address{{host, 0}};
  std::memcpy(&request.arp_pa, address.data(), sizeof request.arp_pa);
  std::memcpy(request.arp_dev, interface.data(), interface.size());
  return request;
}

bool is_link_local(const IpAddress& host) {
  return host.v6 && host.bytes[0] == 0xfe && (host.bytes[1] & 0xc0U) == 0x80;
}

// --- rtnetlink --------------------------------------------------------------------------------------------

/// Asks for one entry of the table.
struct Question {
  nlmsghdr header{};
  ndmsg body{};
  rtattr attribute{};
  std::array<std::uint8_t, 16> host{};
};
static_assert(sizeof(Question) == NLMSG_ALIGN(sizeof(nlmsghdr)) + NLMSG_ALIGN(sizeof(ndmsg)) + RTA_LENGTH(16),
              "without gaps, as the kernel reads it");

Question question_of(const IpAddress& host, unsigned interface, std::uint32_t number) {
  Question question;
  question.header.nlmsg_len = sizeof question;
  question.header.nlmsg_type = RTM_GETNEIGH;
  question.header.nlmsg_flags = NLM_F_REQUEST;
  question.header.nlmsg_seq = number;
  question.body.ndm_family = AF_INET6;
  question.body.ndm_ifindex = static_cast<int>(interface);
  question.attribute.rta_len = RTA_LENGTH(sizeof question.host);
  question.attribute.rta_type = NDA_DST;
  question.host = host.bytes;
  return question;
}

}  // namespace

Neighbours::Neighbours(const IpAddress& own, std::string interface)
    : own_{own},
      interface_{interface.empty() ? interface_name(own) : std::move(interface)},
      mask_{mask_with_neighbours(own)},
      socket_{open_socket(own.v6)},
      index_{own.v6 ? if_nametoindex(interface_.c_str()) : 0} {}

bool Neighbours::known(const IpAddress& host) const noexcept {
  return looked_up(host) == Answer::came;
}

Neighbours::Answer Neighbours::entry_of(const IpAddress& host) const noexcept {
  return is_on_link(host) ? looked_up(host) : Answer::untold;
}

Neighbours::Answer Neighbours::answer_of(const IpAddress& host) const noexcept {
  const Answer answer = entry_of(host);
  return answer == Answer::unasked && interface_of(host) != 0 ? Answer::untold : answer;
}

bool Neighbours::is_on_link(const IpAddress& host) const noexcept {
  bool same = host.v6 == own_.v6 && !mask_.is_unspecified();
  if (same && is_link_local(host)) {
    return true;
  }
  for (std::size_t i = 0; same && i < mask_.bytes.size(); ++i) {
    same = ((own_.bytes[i] ^ host.bytes[i]) & mask_.bytes[i]) == 0;
  }
  return same;
}

Neighbours::Answer Neighbours::looked_up(const IpAddress& host) const noexcept {
  if (host.v6 != own_.v6) {
    return Answer::untold;
  }
  return host.v6 ? looked_up_v6(host) : looked_up_v4(host);
}

// Looks it up in the ARP table.
Neighbours::Answer Neighbours::looked_up_v4(const IpAddress& host) const noexcept {
  if (interface_.empty() || interface_.size() >= sizeof arpreq::arp_dev) {
    return Answer::untold;
  }
  arpreq request = request_of(host, interface_);
  if (ioctl(socket_.get(), SIOCGARP, &request) != 0) {
    return Answer::unasked;
  }
  return (request.arp_flags & ATF_COM) != 0 ? Answer::came : Answer::awaited;
}

// There is no such call for IPv6; rtnetlink tells of a single host. The same states give the same answers.
Neighbours::Answer Neighbours::looked_up_v6(const IpAddress& host) const noexcept {
  if (index_ == 0) {
    return Answer::untold;
  }
  const Question question = question_of(host, index_, ++question_);
  std::array<std::byte, 1024> room;  // an entry takes about 100 bytes
  const NetlinkAnswer entry = ask_netlink(socket_.get(), std::as_bytes(std::span{&question, 1}), room);
  if (entry.error == ENODEV) {
    index_ = if_nametoindex(interface_.c_str());  // it may have been made anew
  }
  const auto neighbour = entry.front<ndmsg>();
  if (entry.error != 0 || entry.type != RTM_NEWNEIGH || !neighbour) {
    return entry.error == ENOENT ? Answer::unasked : Answer::untold;
  }
  constexpr unsigned has_answered = NUD_PERMANENT | NUD_REACHABLE | NUD_STALE | NUD_DELAY | NUD_PROBE;
  if ((neighbour->ndm_state & NUD_NOARP) != 0U) {
    return Answer::unasked;
  }
  return (neighbour->ndm_state & has_answered) != 0U ? Answer::came : Answer::awaited;
}

}  // namespace trestle::someip
