#pragma once
#include <vector>

#include "bridge/carry/runtime/counters.hpp"
#include "sd/net/node.hpp"

namespace trestle::carry {

/// What a Node counted, for all routes together.
struct NodeCounts {
  sd::NodeCounters node{};
  someip::SenderCounters sender{};
  someip::TcpServerCounters tcp_server{};
  someip::TcpClientCounters tcp_client{};
  someip::TpCounters reassembly{};
  sd::SdCounters discovery{};
};
[[nodiscard]] NodeCounts counts_of(const sd::Node& node);

/// Four groups with every counter: messages over UDP and TCP, their segments, and discovery. What the streams
/// of TCP servers and clients counted is added.
void append_counters(std::vector<CounterGroup>& groups, const NodeCounts& counts);

}  // namespace trestle::carry
