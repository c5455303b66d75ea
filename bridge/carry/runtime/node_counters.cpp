#include "bridge/carry/runtime/node_counters.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

namespace trestle::carry {
namespace {

/// For for_each_counter(): appends a counter to the group, or adds it to the one of its name.
auto into(CounterGroup& group) {
  return [&group](const char* name, std::uint64_t count, Counter::Kind kind) {
    const auto same = std::ranges::find(group.counters, std::string_view{name},
                                        [](const Counter& one) { return std::string_view{one.name}; });
    if (same == group.counters.end()) {
      group.counters.push_back({name, count, kind});
    } else {
      same->count += count;
    }
  };
}

}  // namespace

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
