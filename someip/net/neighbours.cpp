#include "someip/net/neighbours.hpp"

#include <net/if.h>
#include <net/if_arp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <array>
#include <cstring>

#include "someip/net/addresses.hpp"

namespace trestle::someip {
namespace {

std::string interface_name(const IpAddress& own) {
  std::array<char, IF_NAMESIZE> name{};
  return if_indextoname(interface_of(own), name.data()) == nullptr ? std::string{} : std::string{name.data()};
}

std::uint32_t number(const IpAddress& address) {
  std::uint32_t result = 0;
  std::memcpy(&result, address.bytes.data(), sizeof result);
  return result;
}

arpreq request_of(const IpAddress& host, const std::string& interface) {
  arpreq request{};
  SocketAddress address{{host, 0}};
  std::memcpy(&request.arp_pa, address.data(), sizeof request.arp_pa);
  std::memcpy(request.arp_dev, interface.data(), interface.size());
  return request;
}

}  // namespace

Neighbours::Neighbours(const IpAddress& own, std::string interface)
    : own_{own},
      interface_{interface.empty() && !own.v6 ? interface_name(own) : std::move(interface)},
      mask_{mask_with_arp(own)},
      socket_{own.v6 ? -1 : ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)} {}

bool Neighbours::known(const IpAddress& host) const noexcept {
  return looked_up(host) == Answer::came;
}

Neighbours::Answer Neighbours::entry_of(const IpAddress& host) const noexcept {
  const bool has_entry = mask_ != 0 && !host.v6 && ((number(own_) ^ number(host)) & mask_) == 0;
  return has_entry ? looked_up(host) : Answer::untold;
}

Neighbours::Answer Neighbours::answer_of(const IpAddress& host) const noexcept {
  const Answer answer = entry_of(host);
  return answer == Answer::unasked && interface_of(host) != 0 ? Answer::untold : answer;
}

// Looks it up in the ARP table.
Neighbours::Answer Neighbours::looked_up(const IpAddress& host) const noexcept {
  if (host.v6 || interface_.empty() || interface_.size() >= sizeof arpreq::arp_dev) {
    return Answer::untold;
  }
  arpreq request = request_of(host, interface_);
  if (ioctl(socket_.get(), SIOCGARP, &request) != 0) {
    return Answer::unasked;
  }
  return (request.arp_flags & ATF_COM) != 0 ? Answer::came : Answer::awaited;
}

}  // namespace trestle::someip
