#include "someip/net/neighbours.hpp"

#include <ifaddrs.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <array>
#include <cstring>
#include <memory>

#include "someip/net/addresses.hpp"

namespace trestle::someip {
namespace {

std::string interface_name(const IpAddress& own) {
  std::array<char, IF_NAMESIZE> name{};
  return if_indextoname(interface_of(own), name.data()) == nullptr ? std::string{} : std::string{name.data()};
}

// The mask of this address' subnet, in network order; 0 where there is no ARP.
std::uint32_t mask_with_arp(const IpAddress& own) {
  ifaddrs* all = nullptr;
  if (own.v6 || getifaddrs(&all) != 0) {
    return 0;
  }
  const std::unique_ptr<ifaddrs, void (*)(ifaddrs*)> end{all, &freeifaddrs};
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr != nullptr && one->ifa_addr->sa_family == AF_INET && one->ifa_netmask != nullptr &&
        (one->ifa_flags & (IFF_LOOPBACK | IFF_NOARP | IFF_POINTOPOINT)) == 0) {
      sockaddr_in address{};
      sockaddr_in mask{};
      std::memcpy(&address, one->ifa_addr, sizeof address);
      std::memcpy(&mask, one->ifa_netmask, sizeof mask);
      if (std::memcmp(&address.sin_addr, own.bytes.data(), sizeof address.sin_addr) == 0) {
        return mask.sin_addr.s_addr;
      }
    }
  }
  return 0;
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
