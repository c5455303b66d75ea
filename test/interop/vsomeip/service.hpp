#pragma once
// The service that Trestle and vsomeip use of each other, and the payloads that they exchange. Used by both
// sides, so it knows neither stack.
#include <cstddef>
#include <cstdint>
#include <vector>

namespace trestle::interop {

inline constexpr std::uint16_t service = 0x4711;
inline constexpr std::uint16_t instance = 0x0001;
inline constexpr std::uint8_t major_version = 1;
inline constexpr std::uint16_t udp_port = 30509;
inline constexpr std::uint16_t tcp_port = 30510;

// Methods
inline constexpr std::uint16_t echo = 0x0001;  ///< gives back what it gets
/// Answers with the error that is as large as what it gets is long.
inline constexpr std::uint16_t fail = 0x0002;
inline constexpr std::uint16_t tell = 0x0003;  ///< fire and forget: makes event_udp of what it gets
/// Gets an event id (16 bits) and a size (32 bits): sends that event with that many bytes of pattern().
inline constexpr std::uint16_t emit = 0x0004;
inline constexpr std::uint16_t getter = 0x0011;
inline constexpr std::uint16_t setter = 0x0012;

// Events, each with an eventgroup of its own
inline constexpr std::uint16_t event_udp = 0x8001;  ///< in segments, if it is large
inline constexpr std::uint16_t event_tcp = 0x8002;
inline constexpr std::uint16_t event_multicast = 0x8003;
inline constexpr std::uint16_t notifier = 0x8011;

inline constexpr std::uint16_t group_udp = 1;
inline constexpr std::uint16_t group_tcp = 2;
inline constexpr std::uint16_t group_multicast = 3;
inline constexpr std::uint16_t group_field = 4;

inline constexpr const char* multicast_address = "224.225.226.233";
inline constexpr const char* multicast_address_v6 = "ff15::233";
inline constexpr std::uint16_t multicast_port = 32344;

/// Bytes of which no two stretches of a segment's length are equal, so that none can be swapped unnoticed.
inline std::vector<std::uint8_t> pattern(std::size_t size) {
  std::vector<std::uint8_t> bytes(size);
  std::uint32_t state = 1;
  for (std::uint8_t& byte : bytes) {
    state = state * 1664525U + 1013904223U;
    byte = static_cast<std::uint8_t>(state >> 24U);
  }
  return bytes;
}

/// FNV-1a, to compare payloads across a pipe.
inline std::uint32_t checksum(const std::uint8_t* bytes, std::size_t size) {
  std::uint32_t hash = 2166136261U;
  for (std::size_t i = 0; i < size; ++i) {
    hash = (hash ^ bytes[i]) * 16777619U;
  }
  return hash;
}

}  // namespace trestle::interop
