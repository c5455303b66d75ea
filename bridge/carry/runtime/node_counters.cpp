#include "bridge/carry/runtime/node_counters.hpp"

#include <utility>

namespace trestle::carry {

NodeCounts counts_of(const sd::Node& node) {
  return {node.counters(),
          node.sender_counters(),
          node.tcp_server_counters(),
          node.tcp_client_counters(),
          node.reassembly_counters(),
          node.discovery_counters()};
}

void append_counters(std::vector<CounterGroup>& groups, const NodeCounts& counts) {
  CounterGroup datagrams{"SOME/IP", {}};
  counts.node.for_each_counter(into(datagrams));
  counts.sender.for_each_counter(into(datagrams));
  groups.push_back(std::move(datagrams));

  CounterGroup streams{"SOME/IP over TCP", {}};
  counts.tcp_server.for_each_counter(into(streams));
  counts.tcp_client.for_each_counter(into(streams));
  groups.push_back(std::move(streams));

  CounterGroup segments{"SOME/IP-TP", {}};
  counts.reassembly.for_each_counter(into(segments));
  groups.push_back(std::move(segments));

  CounterGroup discovery{"SOME/IP-SD", {}};
  counts.discovery.for_each_counter(into(discovery));
  counts.node.for_each_discovery_counter(into(discovery));
  groups.push_back(std::move(discovery));
}

}  // namespace trestle::carry
