#include "dds_adapter/interfaces.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <netinet/in.h>

#include <algorithm>
#include <array>

#include "dds_adapter/participant.hpp"

namespace trestle::dds::detail {
namespace {

/// All IPv4 addresses of this host, as text.
std::vector<std::string> host_addresses() {
  std::vector<std::string> result;
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) {
    return result;
  }
  for (const ifaddrs* entry = list; entry != nullptr; entry = entry->ifa_next) {
    if (entry->ifa_addr != nullptr && entry->ifa_addr->sa_family == AF_INET) {
      const void* address = entry->ifa_addr;
      std::array<char, INET_ADDRSTRLEN> text{};
      if (inet_ntop(AF_INET, &static_cast<const sockaddr_in*>(address)->sin_addr, text.data(), text.size()) !=
          nullptr) {
        result.emplace_back(text.data());
      }
    }
  }
  freeifaddrs(list);
  return result;
}

std::string not_ours(const std::string& address, const std::vector<std::string>& own) {
  std::string text =
      "no interface of this host has the address " + address + ", which DDS is to use; there are:";
  for (const std::string& one : own) {
    text.append(" ").append(one);
  }
  return text;
}

}  // namespace

void check_interfaces(const std::vector<std::string>& interfaces) {
  if (interfaces.empty()) {
    return;
  }
  const std::vector<std::string> own = host_addresses();
  for (const std::string& address : interfaces) {
    in_addr parsed{};
    if (inet_pton(AF_INET, address.c_str(), &parsed) != 1) {
      throw DdsError{"DDS interface '" + address + "' is not an IPv4 address"};
    }
    if (std::ranges::find(own, address) == own.end()) {
      throw DdsError{not_ours(address, own)};
    }
  }
}

}  // namespace trestle::dds::detail
