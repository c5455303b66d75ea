#include "bridge/describe/address_text.hpp"

#include <fmt/format.h>

namespace trestle::describe {

std::string full_text(const IpAddress& address) {
  if (!address.v6) {
    return fmt::format("{}.{}.{}.{}", address.bytes[0], address.bytes[1], address.bytes[2], address.bytes[3]);
  }
  std::string all;
  for (std::size_t i = 0; i < 16; i += 2) {
    all += fmt::format("{}{:x}", i == 0 ? "" : ":", address.bytes.at(i) << 8U | address.bytes.at(i + 1));
  }
  return all;
}

}  // namespace trestle::describe
