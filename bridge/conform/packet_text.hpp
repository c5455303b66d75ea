#pragma once
#include <deque>
#include <string>
#include <vector>

#include "bridge/conform/packet.hpp"
#include "sd/wire/message.hpp"

/// Packets in one line each, for people.
namespace trestle::conform {

/// "SD session 3: Offer 0x0101.0x0001 v1.0 TTL 5 [udp 192.0.2.1:30501]"; "response 0x0101.0x0008 session 7
/// E_OK: 2a".
[[nodiscard]] std::string packet_text(const Packet& packet);
/// "Subscribe 0x0101.0x0001 eventgroup 0x0002 TTL 30 [udp 192.0.2.2:40001]"
[[nodiscard]] std::string entry_text(const sd::SdMessage& message, const sd::Entry& entry);
[[nodiscard]] std::string message_text(const someip::Message& message);

/// A packet as reports show it.
struct PacketLine {
  std::uint64_t number = 0;
  std::chrono::nanoseconds since_first{0};
  bool sent = false;
  Transport transport = Transport::udp;
  std::string from{};
  std::string to{};
  std::string text{};
  std::string comment{};
  std::string hex{};  ///< cut after some
};

/// Of many packets the first ones, and those that have a comment.
struct Timeline {
  std::vector<PacketLine> lines{};
  std::size_t left_out = 0;
};
[[nodiscard]] Timeline timeline(const std::deque<Packet>& packets);

}  // namespace trestle::conform
