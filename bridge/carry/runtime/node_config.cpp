#include "bridge/carry/runtime/node_config.hpp"

#include <algorithm>
#include <chrono>
#include <map>
#include <set>

#include "bridge/carry/config/load_limits.hpp"
#include "someip/wire/header.hpp"

namespace trestle::carry {
namespace {

// Of a socket, for a message that comes or goes at once, but for the largest.
int room_for(std::size_t message, int least) {
  constexpr std::size_t most = std::size_t{32} << 20U;
  return std::max(least, static_cast<int>(std::min(message, most)));
}

constexpr std::size_t most_slots = 60'000;  // a table has a little less than 65535
constexpr std::size_t most_calls = 0x8000;

void raise(std::uint16_t& limit, std::size_t wanted) {
  limit = std::max(limit, static_cast<std::uint16_t>(std::min(wanted, most_slots)));
}

// All that has a part in discovery, as often as it may be there.
std::size_t parts_of(const BridgeConfig& config) {
  std::size_t parts = config.routes.size() + config.methods.size() + config.locked.size();
  for (const TopicPattern& pattern : config.patterns) {
    parts += pattern.route.direction == Direction::dds_to_someip ? pattern.max_routes : 0;
  }
  return std::min(parts, most_slots);
}

// One offer or requirement each at most, and one eventgroup; of others, room for as much again that is not
// ours.
void size_discovery(const BridgeConfig& config, sd::NodeConfig& node) {
  const std::size_t parts = parts_of(config);
  sd::Limits& limits = node.limits;
  raise(limits.max_offers, parts);
  raise(limits.max_eventgroups, parts);
  raise(limits.max_requirements, 2 * parts);        // two, to follow
  raise(limits.max_subscriptions, 2 * parts + 64);  // as many instances as there are, where any is wanted
  raise(limits.max_subscribers, 4 * parts);
  raise(limits.max_remote_services, 2 * parts + 256);
  raise(limits.max_peers, 256);
  raise(limits.max_configurations, parts);
  // A shutdown ends all of it, and a find may ask for all of it.
  raise(limits.max_pending_entries, 4 * parts);
  // A peer that is started anew ends a service and a subscription for each, and may have had them all.
  raise(limits.max_pending_events, 4 * parts);
  // Whoever subscribes to all does so anew with each offer, and first looks for all, several times.
  const auto offers_per_second = static_cast<std::size_t>(
      std::max(Duration{std::chrono::seconds{1}} / config.someip.sd.cyclic_offer_delay, Duration::rep{1}));
  sd::DiscoveryRules& rules = node.discovery;
  rules.max_entries_per_second = static_cast<std::uint32_t>(
      std::max<std::size_t>(rules.max_entries_per_second, 4 * parts * offers_per_second));
  rules.max_entries_at_once =
      static_cast<std::uint32_t>(std::max<std::size_t>(rules.max_entries_at_once, 20 * parts));
}

// TCP ports that clients connect to.
std::size_t tcp_ports_of(const BridgeConfig& config) {
  std::set<std::uint16_t> ports;
  std::size_t chosen = 0;  // by the system, each its own
  const auto add = [&](std::uint16_t port) {
    if (port == 0) {
      ++chosen;
    } else {
      ports.insert(port);
    }
  };
  const auto is_served = [](const Route& route) {
    return route.direction == Direction::dds_to_someip && route.transport == Transport::tcp;
  };
  for (const Route& route : config.routes) {
    if (is_served(route)) {
      add(route.port);
    }
  }
  for (const TopicPattern& pattern : config.patterns) {
    if (is_served(pattern.route)) {
      add(pattern.route.port);
    }
  }
  for (const MethodRoute& method : config.methods) {
    if (method.server == Server::ros && method.transport == Transport::tcp) {
      add(method.port);
    }
  }
  return ports.size() + chosen;
}

// Messages that may come to one UDP port, of events and answers or of requests.
std::size_t most_kinds_at_one_port(const BridgeConfig& config) {
  // All events without a port of their own come to one, the answers to calls to another or the same.
  std::map<std::uint16_t, std::size_t> expected;
  std::map<std::uint16_t, std::size_t> requests;
  for (const Route& route : config.routes) {
    if (route.direction == Direction::someip_to_dds && route.transport == Transport::udp) {
      ++expected[route.port];
    }
  }
  for (const MethodRoute& method : config.methods) {
    ++(method.server == Server::someip ? expected[0] : requests[method.port]);
  }
  std::size_t most = 0;
  for (const auto& [port, count] : expected) {
    most = std::max(most, count);
  }
  for (const auto& [port, count] : requests) {
    most = std::max(most, count);
  }
  return most;
}

}  // namespace

sd::NodeConfig node_config(const BridgeConfig& config) {
  const SdSettings& sd = config.someip.sd;
  sd::NodeConfig node{.address = config.someip.address,
                      .multicast_interface = config.someip.interface,
                      .multicast = sd.multicast,
                      .port = sd.port};
  node.timing = sd;
  node.check_subnet = sd.check_subnet;
  node.discovery.own_endpoints_only = sd.own_endpoints_only;
  node.foreign_endpoints = sd.foreign_endpoints;
  size_discovery(config, node);
  // Large messages of all routes may be under way at once, even if one server has them all.
  const std::size_t kinds = most_kinds_at_one_port(config);
  node.max_reassemblies_per_sender = std::max(node.max_reassemblies_per_sender, kinds);
  node.max_reassemblies = std::max(node.max_reassemblies, kinds + 16);
  std::size_t received = 0;
  std::size_t sent = 0;
  for (const Route& route : config.routes) {
    std::size_t& most = route.direction == Direction::someip_to_dds ? received : sent;
    most = std::max(most, route.tp.max_message);
  }
  for (const TopicPattern& pattern : config.patterns) {
    std::size_t& most = pattern.route.direction == Direction::someip_to_dds ? received : sent;
    most = std::max(most, pattern.route.tp.max_message);
  }
  std::size_t calls = node.max_calls;
  for (const MethodRoute& method : config.methods) {  // both have requests or answers
    received = std::max(received, method.tp.max_message);
    sent = std::max(sent, method.tp.max_message);
    calls += method.server == Server::someip ? method.max_calls : 0;
  }
  node.max_message_bytes = std::max(received, sent);
  node.receive_buffer_bytes = config.someip.receive_buffer ? static_cast<int>(*config.someip.receive_buffer)
                                                           : room_for(received, node.receive_buffer_bytes);
  node.send_buffer_bytes = config.someip.send_buffer ? static_cast<int>(*config.someip.send_buffer)
                                                     : room_for(sent, node.send_buffer_bytes);
  node.tcp_idle_timeout = config.someip.tcp_idle_timeout;
  node.busy_poll = std::chrono::ceil<std::chrono::microseconds>(config.someip.busy_poll);
  node.max_calls = static_cast<std::uint16_t>(std::min(calls, most_calls));
  // A route has up to two messages on their way at once.
  node.max_queued_bytes =
      std::max(node.max_queued_bytes, 2 * (node.max_message_bytes + someip::header_bytes));
  for (const LimitKey& key : limit_keys()) {
    if (const auto given = config.someip.limits.find(key.name); given != config.someip.limits.end()) {
      key.set(node, given->second);
    }
  }
  if (!config.someip.limits.contains("max_tcp_connections")) {
    // As many as the ports accept: who takes all that one address may have at each leaves the others theirs.
    raise(node.limits.max_tcp_connections,
          std::max<std::size_t>(256, tcp_ports_of(config) * node.max_tcp_clients));
  }
  raise(node.limits.max_pending_entries,  // a shutdown needs them
        std::size_t{node.limits.max_offers} + node.limits.max_subscriptions);
  return node;
}

}  // namespace trestle::carry
