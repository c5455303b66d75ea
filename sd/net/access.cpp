#include "sd/net/access.hpp"

#include <algorithm>
#include <array>
#include <charconv>

#include "someip/net/address_text.hpp"
#include "someip/wire/enumerator_name.hpp"

namespace trestle::sd {
namespace {

std::uint8_t all_bits(const IpAddress& address) {
  return address.v6 ? 128 : 32;
}

// The bits of the byte at `index` that belong to the prefix.
std::uint8_t mask_of_byte(std::size_t index, std::uint8_t prefix_bits) {
  const std::size_t left = prefix_bits - std::min<std::size_t>(prefix_bits, 8 * index);
  return left >= 8 ? 0xff : static_cast<std::uint8_t>(0xff00U >> left);
}

}  // namespace

bool Subnet::has(const IpAddress& host) const noexcept {
  if (host.v6 != address.v6) {
    return false;
  }
  for (std::size_t i = 0; i < host.bytes.size() && 8 * i < prefix_bits; ++i) {
    if (((host.bytes[i] ^ address.bytes[i]) & mask_of_byte(i, prefix_bits)) != 0) {
      return false;
    }
  }
  return true;
}

std::optional<Subnet> parse_subnet(const std::string& text) {
  const std::size_t slash = text.find('/');
  const auto address = someip::parse_address(text.substr(0, slash));
  if (!address) {
    return std::nullopt;
  }
  Subnet subnet{*address, all_bits(*address)};
  if (slash != std::string::npos) {
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data() + slash + 1, end, subnet.prefix_bits);
    if (error != std::errc{} || stop != end || subnet.prefix_bits > all_bits(*address)) {
      return std::nullopt;
    }
  }
  for (std::size_t i = 0; i < address->bytes.size(); ++i) {
    if ((address->bytes[i] & ~mask_of_byte(i, subnet.prefix_bits)) != 0) {
      return std::nullopt;
    }
  }
  return subnet;
}

std::string to_string(const Subnet& subnet) {
  std::string text = someip::to_string(subnet.address);
  return subnet.prefix_bits == all_bits(subnet.address) ? text
                                                        : text + "/" + std::to_string(subnet.prefix_bits);
}

const char* to_string(Access access) noexcept {
  static constexpr std::array names{"offer", "subscribe", "call"};
  return someip::enumerator_name<Access::call>(names, access);
}

}  // namespace trestle::sd
