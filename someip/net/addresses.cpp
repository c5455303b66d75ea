#include "someip/net/addresses.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>

#include <cstring>

#include "someip/net/address_text.hpp"

namespace trestle::someip {

SocketAddress::SocketAddress(const Endpoint& endpoint, unsigned scope) noexcept {
  if (endpoint.address.v6) {
    sockaddr_in6 address{};
    address.sin6_family = AF_INET6;
    address.sin6_port = htons(endpoint.port);
    address.sin6_scope_id = scope;
    std::memcpy(&address.sin6_addr, endpoint.address.bytes.data(), sizeof address.sin6_addr);
    std::memcpy(&storage_, &address, sizeof address);
    size_ = sizeof address;
  } else {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(endpoint.port);
    std::memcpy(&address.sin_addr, endpoint.address.bytes.data(), sizeof address.sin_addr);
    std::memcpy(&storage_, &address, sizeof address);
    size_ = sizeof address;
  }
}

Endpoint SocketAddress::endpoint() const noexcept {
  Endpoint result;
  if (storage_.ss_family == AF_INET6) {
    sockaddr_in6 address{};
    std::memcpy(&address, &storage_, sizeof address);
    result.address.v6 = true;
    std::memcpy(result.address.bytes.data(), &address.sin6_addr, sizeof address.sin6_addr);
    result.port = ntohs(address.sin6_port);
  } else {
    sockaddr_in address{};
    std::memcpy(&address, &storage_, sizeof address);
    std::memcpy(result.address.bytes.data(), &address.sin_addr, sizeof address.sin_addr);
    result.port = ntohs(address.sin_port);
  }
  return result;
}

std::optional<Interface> interface_of(const IpAddress& address) {
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) {
    return std::nullopt;
  }
  std::optional<Interface> found;
  for (const ifaddrs* one = all; one != nullptr && !found; one = one->ifa_next) {
    if (one->ifa_addr == nullptr ||
        (one->ifa_addr->sa_family != AF_INET && one->ifa_addr->sa_family != AF_INET6)) {
      continue;
    }
    SocketAddress own;
    own.assign(*one->ifa_addr);
    SocketAddress mask;
    if (one->ifa_netmask != nullptr) {
      mask.assign(*one->ifa_netmask);
    }
    // Linux's loopback answers on all of 127.0.0.0/8 though it has only the first address: any address in the
    // subnet of a loopback interface is an own one.
    bool same = own.endpoint().address == address;
    if (!same && (one->ifa_flags & IFF_LOOPBACK) != 0U && own.endpoint().address.v6 == address.v6) {
      same = true;
      const IpAddress net = own.endpoint().address;
      const IpAddress bits = mask.endpoint().address;
      for (std::size_t i = 0; i < net.bytes.size(); ++i) {
        same = same && ((net.bytes[i] ^ address.bytes[i]) & bits.bytes[i]) == 0;
      }
    }
    if (same) {
      found = Interface{one->ifa_name, if_nametoindex(one->ifa_name)};
    }
  }
  freeifaddrs(all);
  return found;
}

std::string to_string(const IpAddress& address) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  inet_ntop(address.v6 ? AF_INET6 : AF_INET, address.bytes.data(), text.data(), text.size());
  return text.data();
}

std::string to_string(const Endpoint& endpoint) {
  const std::string address = to_string(endpoint.address);
  return (endpoint.address.v6 ? "[" + address + "]" : address) + ":" + std::to_string(endpoint.port);
}

std::optional<IpAddress> parse_address(const std::string& text) {
  IpAddress address;
  if (inet_pton(AF_INET, text.c_str(), address.bytes.data()) == 1) {
    return address;
  }
  address = {};
  address.v6 = true;
  if (inet_pton(AF_INET6, text.c_str(), address.bytes.data()) == 1) {
    return address;
  }
  return std::nullopt;
}

}  // namespace trestle::someip
