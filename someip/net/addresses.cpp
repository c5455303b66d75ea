#include "someip/net/addresses.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>

#include <array>
#include <bit>
#include <cstdio>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>

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

namespace {

/// An interface that has an address, and the mask of the subnet there.
struct OwnAddress {
  unsigned interface = 0;
  IpAddress mask;
};

/// Calls `visit(entry, address)` for each address of this host, until it returns true.
template <typename Visit>
void visit_own_addresses(const Visit& visit) {
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) {
    return;
  }
  const std::unique_ptr<ifaddrs, void (*)(ifaddrs*)> end{all, &freeifaddrs};
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr ||
        (one->ifa_addr->sa_family != AF_INET && one->ifa_addr->sa_family != AF_INET6)) {
      continue;
    }
    SocketAddress own;
    own.assign(*one->ifa_addr);
    if (visit(*one, own.endpoint().address)) {
      return;
    }
  }
}

bool in_one_subnet(const IpAddress& a, const IpAddress& b, const IpAddress& mask) {
  bool same = a.v6 == b.v6;
  for (std::size_t i = 0; i < a.bytes.size(); ++i) {
    same = same && ((a.bytes[i] ^ b.bytes[i]) & mask.bytes[i]) == 0;
  }
  return same;
}

std::optional<OwnAddress> own_address(const IpAddress& address) {
  std::optional<OwnAddress> found;
  visit_own_addresses([&](const ifaddrs& one, const IpAddress& own) {
    SocketAddress mask;
    if (one.ifa_netmask != nullptr) {
      mask.assign(*one.ifa_netmask);
    }
    // All addresses in the subnet of a loopback interface are this host's: Linux answers on all 127.0.0.0/8.
    const bool same = own == address || ((one.ifa_flags & IFF_LOOPBACK) != 0U &&
                                         in_one_subnet(own, address, mask.endpoint().address));
    if (same) {
      found = OwnAddress{if_nametoindex(one.ifa_name), mask.endpoint().address};
    }
    return same;
  });
  return found;
}

}  // namespace

std::vector<IpAddress> own_addresses() {
  std::vector<IpAddress> result;
  visit_own_addresses([&](const ifaddrs& /*one*/, const IpAddress& own) {
    result.push_back(own);
    return false;
  });
  return result;
}

unsigned interface_of(const IpAddress& address) {
  const auto own = own_address(address);
  return own ? own->interface : 0;
}

std::optional<IpAddress> address_beside(const std::string& interface, const IpAddress& peer) {
  std::optional<IpAddress> found;
  visit_own_addresses([&](const ifaddrs& one, const IpAddress& own) {
    SocketAddress mask;
    if (one.ifa_netmask != nullptr) {
      mask.assign(*one.ifa_netmask);
    }
    if (interface == one.ifa_name && in_one_subnet(own, peer, mask.endpoint().address)) {
      found = own;
    }
    return found.has_value();
  });
  return found;
}

IpAddress mask_with_neighbours(const IpAddress& address) {
  IpAddress bits{.v6 = address.v6};
  visit_own_addresses([&](const ifaddrs& one, const IpAddress& own) {
    const bool found = own == address && one.ifa_netmask != nullptr &&
                       (one.ifa_flags & (IFF_LOOPBACK | IFF_NOARP | IFF_POINTOPOINT)) == 0;
    if (found) {
      SocketAddress mask;
      mask.assign(*one.ifa_netmask);
      bits.bytes = mask.endpoint().address.bytes;
    }
    return found;
  });
  return bits;
}

std::optional<std::uint8_t> subnet_prefix_bits(const IpAddress& address) {
  const auto own = own_address(address);
  if (!own) {
    return std::nullopt;
  }
  int bits = 0;
  for (const std::uint8_t byte : own->mask.bytes) {
    bits += std::popcount(byte);
  }
  const bool whole = bits == (address.v6 ? 128 : 32);
  return bits == 0 || whole ? std::nullopt : std::optional{static_cast<std::uint8_t>(bits)};
}

bool udp_endpoint_in_use(const Endpoint& endpoint) {
  // In the form that the kernel uses: hexadecimal words of 32 bits in the host's byte order.
  std::string wanted;
  for (std::size_t word = 0; word < (endpoint.address.v6 ? 4U : 1U); ++word) {
    std::uint32_t number = 0;
    std::memcpy(&number, endpoint.address.bytes.data() + 4 * word, sizeof number);
    std::array<char, 9> digits{};
    std::snprintf(digits.data(), digits.size(), "%08X", number);
    wanted += digits.data();
  }
  std::array<char, 6> port{};
  std::snprintf(port.data(), port.size(), ":%04X", endpoint.port);
  wanted += port.data();

  std::ifstream table{endpoint.address.v6 ? "/proc/net/udp6" : "/proc/net/udp"};
  for (std::string line; std::getline(table, line);) {
    std::istringstream fields{line};
    std::string slot;
    std::string local;
    if (fields >> slot >> local && local == wanted) {
      return true;
    }
  }
  return false;
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
