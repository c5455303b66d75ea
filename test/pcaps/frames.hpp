#pragma once
#include <string>

#include "pcaps/network.hpp"
#include "test/bytes.hpp"

namespace trestle::test {

/// A frame of an Ethernet recording; `bytes` must live as long as it.
inline pcaps::Frame ethernet_frame(ByteView bytes, std::uint64_t number = 1) {
  return {number, pcaps::Timestamp{}, pcaps::LinkType::ethernet, bytes, bytes.size()};
}

/// Number in hexadecimal with `bytes` bytes.
inline std::string number_hex(std::uint64_t number, int bytes) {
  std::string result;
  for (int i = bytes - 1; i >= 0; --i) {
    const std::byte byte{static_cast<unsigned char>(number >> (8 * i))};
    result += to_hex({&byte, 1});
  }
  return result;
}

/// Ethernet and IPv4 headers for a payload of that size, from 10.0.0.1 to 10.0.0.2.
inline std::string ipv4_hex(std::size_t payload_bytes, int protocol, std::uint16_t id = 0,
                            std::uint16_t flags_and_offset = 0) {
  return "020000000002 020000000001 0800 4500" + number_hex(20 + payload_bytes, 2) + number_hex(id, 2) +
         number_hex(flags_and_offset, 2) + "40" + number_hex(static_cast<std::uint64_t>(protocol), 1) +
         "0000 0a000001 0a000002";
}

/// A whole frame with a UDP datagram; `payload` in hexadecimal.
inline std::vector<std::byte> udp_frame(const std::string& payload, std::uint16_t from_port,
                                        std::uint16_t to_port) {
  const std::size_t size = 8 + hex(payload).size();
  return hex(ipv4_hex(size, 17) + number_hex(from_port, 2) + number_hex(to_port, 2) + number_hex(size, 2) +
             "0000" + payload);
}

inline constexpr int syn = 2;
inline constexpr int ack = 16;

/// A whole frame with a TCP segment; `payload` in hexadecimal.
inline std::vector<std::byte> tcp_frame(const std::string& payload, std::uint16_t from_port,
                                        std::uint16_t to_port, std::uint32_t sequence, int flags = ack) {
  const std::size_t size = 20 + hex(payload).size();
  return hex(ipv4_hex(size, 6) + number_hex(from_port, 2) + number_hex(to_port, 2) + number_hex(sequence, 4) +
             "00000000 50" + number_hex(static_cast<std::uint64_t>(flags), 1) + "ffff 0000 0000" + payload);
}

}  // namespace trestle::test
