#include "bridge/cli/interfaces.hpp"

#include <ifaddrs.h>
#include <net/if.h>

#include <array>
#include <memory>

#include "someip/net/addresses.hpp"

namespace trestle::cli {

std::optional<std::string> interface_name(const IpAddress& address) {
  std::array<char, IF_NAMESIZE> name{};
  const unsigned index = someip::interface_of(address);
  return index != 0 && if_indextoname(index, name.data()) != nullptr ? std::optional<std::string>{name.data()}
                                                                     : std::nullopt;
}

std::optional<IpAddress> address_of_interface(const std::string& name, bool v6) {
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) {
    return std::nullopt;
  }
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> owner{all, &freeifaddrs};
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr != nullptr && name == one->ifa_name &&
        one->ifa_addr->sa_family == (v6 ? AF_INET6 : AF_INET)) {
      someip::SocketAddress address;
      address.assign(*one->ifa_addr);
      return address.endpoint().address;
    }
  }
  return std::nullopt;
}

}  // namespace trestle::cli
