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

}  // namespace

Neighbours::Neighbours(const IpAddress& own, std::string interface)
    : interface_{interface.empty() && !own.v6 ? interface_name(own) : std::move(interface)},
      socket_{own.v6 ? -1 : ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)} {}

bool Neighbours::known(const IpAddress& host) const noexcept {
  arpreq request{};
  if (host.v6 || interface_.empty() || interface_.size() >= sizeof request.arp_dev) {
    return false;
  }
  SocketAddress address{{host, 0}};
  std::memcpy(&request.arp_pa, address.data(), sizeof request.arp_pa);
  std::memcpy(request.arp_dev, interface_.data(), interface_.size());
  return ioctl(socket_.get(), SIOCGARP, &request) == 0 && (request.arp_flags & ATF_COM) != 0;
}

}  // namespace trestle::someip
