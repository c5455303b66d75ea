#pragma once
#include <array>
#include <compare>
#include <cstdint>
#include <optional>

#include "someip/wire/types.hpp"

namespace trestle {

/// An IPv4 or IPv6 address, without a socket library.
struct IpAddress {
  /// Network order; IPv4 uses the first four bytes, the rest is zero.
  std::array<std::uint8_t, 16> bytes{};
  bool v6 = false;

  [[nodiscard]] static constexpr IpAddress v4(std::uint8_t a, std::uint8_t b, std::uint8_t c,
                                              std::uint8_t d) noexcept {
    return IpAddress{{a, b, c, d}, false};
  }
  [[nodiscard]] constexpr bool is_multicast() const noexcept {
    return v6 ? bytes[0] == 0xff : (bytes[0] & 0xf0U) == 0xe0;
  }
  [[nodiscard]] constexpr bool is_unspecified() const noexcept {
    return bytes == std::array<std::uint8_t, 16>{};
  }
  /// Of this host alone: 127.0.0.0/8, ::1.
  [[nodiscard]] constexpr bool is_loopback() const noexcept {
    return v6 ? *this == IpAddress{{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1}, true} : bytes[0] == 127;
  }
  /// Neither of a group nor of nobody.
  [[nodiscard]] constexpr bool is_unicast() const noexcept { return !is_multicast() && !is_unspecified(); }
  friend constexpr auto operator<=>(const IpAddress&, const IpAddress&) = default;
};

/// Address and port of a UDP or TCP endpoint. Aligned so that it is copied by whole words.
struct alignas(4) Endpoint {
  IpAddress address;
  std::uint16_t port = 0;
  friend constexpr auto operator<=>(const Endpoint&, const Endpoint&) = default;
};

/// Whether both are the same endpoint, or none. Not std::optional's operator, which GCC always inlines.
[[nodiscard]] TRESTLE_ONCE constexpr bool are_same(const std::optional<Endpoint>& a,
                                                   const std::optional<Endpoint>& b) noexcept {
  return a == b;
}

/// The protocol of an endpoint, with its number in SD options.  [feat_req_someipsd_128]
enum class Transport : std::uint8_t { tcp = 0x06, udp = 0x11 };

}  // namespace trestle
