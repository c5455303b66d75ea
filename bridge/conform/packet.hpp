#pragma once
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "someip/wire/endpoint.hpp"

namespace trestle::conform {

/// Wall-clock time, as the kernel stamps what comes.
using WallTime = std::chrono::sys_time<std::chrono::nanoseconds>;

/// What the tester sent or received: a UDP datagram, or one message of a TCP connection. Bytes of a
/// connection that are no message, or not the whole of one, are a packet, too.
struct Packet {
  std::uint64_t number = 0;  ///< from 1, as Wireshark counts them in the evidence
  WallTime time{};
  bool sent = false;
  Transport transport = Transport::udp;
  Endpoint from{};
  Endpoint to{};
  std::vector<std::byte> bytes{};
  bool ends = false;      ///< it is the end of a TCP connection, and has no bytes
  std::string comment{};  ///< what is to be said of it in the evidence
};

}  // namespace trestle::conform
