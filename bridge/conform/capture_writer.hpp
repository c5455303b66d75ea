#pragma once
#include <deque>
#include <string>

#include "bridge/conform/packet.hpp"

namespace trestle::conform {

/// Packets as a pcapng capture of raw IP, each with its comment, which Wireshark shows. IP, UDP and TCP
/// headers are made for it, because the tester reads from sockets: no right to capture is needed.
[[nodiscard]] std::string pcapng(const std::deque<Packet>& packets, const std::string& title);

}  // namespace trestle::conform
