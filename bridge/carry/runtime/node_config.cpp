#include "bridge/carry/runtime/node_config.hpp"

#include <algorithm>
#include <chrono>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "bridge/carry/config/load_limits.hpp"
#include "bridge/guest/host.hpp"
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

// What one item of the configuration asks of the Node.
struct Demand {
  std::size_t parts = 1;                        // in discovery, as often as it may be there
  std::optional<std::uint16_t> tcp_port{};      // that clients connect to; 0: one that the system chooses
  std::optional<std::uint16_t> expected_at{};   // the UDP port of its events or answers
  std::optional<std::uint16_t> requested_at{};  // that of its requests
  std::size_t received = 0;                     // bytes of the largest message
  std::size_t sent = 0;
  std::size_t calls = 0;  // of ours, under way at once
};

Demand demand_of(const Route& route) {
  const bool served = route.direction == Direction::dds_to_someip;
  const bool by_tcp = route.transport == Transport::tcp;
  Demand demand;
  (served ? demand.sent : demand.received) = route.tp.max_message;
  if (served && by_tcp) {
    demand.tcp_port = route.port;
  } else if (!served && !by_tcp) {
    demand.expected_at = route.port;
  }
  return demand;
}

Demand demand_of(const TopicPattern& pattern) {
  Demand demand = demand_of(pattern.route);
  demand.parts = pattern.route.direction == Direction::dds_to_someip ? pattern.max_routes : 0;
  demand.expected_at.reset();  // the routes that it makes are in the list of routes
  return demand;
}

Demand demand_of(const MethodRoute& method) {
  Demand demand{.received = method.tp.max_message, .sent = method.tp.max_message};  // requests or answers
  if (method.server == Server::someip) {
    demand.expected_at = std::uint16_t{0};  // answers come where events without a port of their own do
    demand.calls = method.max_calls;
  } else {
    demand.requested_at = method.port;
    if (method.transport == Transport::tcp) {
      demand.tcp_port = method.port;
    }
  }
  return demand;
}

Demand demand_of(const LockedTopic& /*topic*/) {
  return {};
}

std::vector<Demand> demands_of(const BridgeConfig& config) {
  std::vector<Demand> demands;
  const auto add = [&](const auto& items) {
    for (const auto& item : items) {
      demands.push_back(demand_of(item));
    }
  };
  add(config.routes);
  add(config.methods);
  add(config.patterns);
  add(config.locked);
  return demands;
}

// One offer or requirement each at most, and one eventgroup; of others, room for as much again that is not
// ours.
void size_discovery(const BridgeConfig& config, std::size_t parts, sd::NodeConfig& node) {
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
  const auto offers_per_second = static_cast<std::size_t>(std::max(
      Duration{std::chrono::seconds{1}} / config.someip.timing.cyclic_offer_delay, Duration::rep{1}));
  sd::DiscoveryRules& rules = node.discovery;
  rules.max_entries_per_second = static_cast<std::uint32_t>(
      std::max<std::size_t>(rules.max_entries_per_second, 4 * parts * offers_per_second));
  rules.max_entries_at_once =
      static_cast<std::uint32_t>(std::max<std::size_t>(rules.max_entries_at_once, 20 * parts));
}

// TCP ports that clients connect to.
std::size_t tcp_ports_of(const std::vector<Demand>& demands) {
  std::set<std::uint16_t> ports;
  std::size_t chosen = 0;  // by the system, each its own
  for (const Demand& one : demands) {
    if (one.tcp_port == std::uint16_t{0}) {
      ++chosen;
    } else if (one.tcp_port) {
      ports.insert(*one.tcp_port);
    }
  }
  return ports.size() + chosen;
}

// Messages that may come to one UDP port, of events and answers or of requests.
std::size_t most_kinds_at_one_port(const std::vector<Demand>& demands) {
  std::map<std::uint16_t, std::size_t> expected;
  std::map<std::uint16_t, std::size_t> requests;
  std::size_t most = 0;
  for (const Demand& one : demands) {
    if (one.expected_at) {
      most = std::max(most, ++expected[*one.expected_at]);
    }
    if (one.requested_at) {
      most = std::max(most, ++requests[*one.requested_at]);
    }
  }
  return most;
}

// Who may do what according to the `peers` of routes and methods. Where several are about the same, each adds
// its own.
sd::AccessPolicy policy_of(const BridgeConfig& config) {
  sd::AccessPolicy policy;
  const auto add = [&](const std::vector<sd::Subnet>& peers, sd::AccessRule rule) {
    if (!peers.empty()) {
      rule.peers = peers;
      policy.rules.push_back(std::move(rule));
    }
  };
  const auto add_route = [&](const Route& route, const ServiceRange& services) {
    sd::AccessRule rule{.allow = {sd::Access::offer},
                        .first_service = services.first,
                        .last_service = services.last,
                        .instance = route.instance};
    if (route.direction == Direction::dds_to_someip) {
      rule.allow = {sd::Access::subscribe};
      rule.eventgroups = {route.eventgroup};
    }
    add(route.peers, rule);
    if (route.getter) {
      rule.allow = {sd::Access::call};
      rule.eventgroups.clear();
      rule.methods = {route.getter->id};
      add(route.peers, rule);
    }
  };
  for (const Route& route : config.routes) {
    add_route(route, {route.service, route.service});
  }
  for (const TopicPattern& pattern : config.patterns) {
    if (pattern.route.direction == Direction::dds_to_someip) {  // others have made their routes
      add_route(pattern.route, pattern.services);
    }
  }
  for (const MethodRoute& method : config.methods) {
    sd::AccessRule rule{.allow = {sd::Access::offer},
                        .first_service = method.service,
                        .last_service = method.service,
                        .instance = method.instance};
    if (method.server == Server::ros) {
      rule.allow = {sd::Access::call};
      rule.methods = {method.method};
    }
    add(method.peers, rule);
  }
  return policy;
}

// For tools that use the bridge's address, beside what the configuration says, so that a route which wants
// something later finds its place.
void make_room_for_guests(sd::NodeConfig& node) {
  constexpr std::size_t things = guest::Host::most_guests * guest::Host::most_requests;
  node.limits.max_requirements = static_cast<std::uint16_t>(node.limits.max_requirements + things);
  node.limits.max_subscriptions = static_cast<std::uint16_t>(node.limits.max_subscriptions + things);
  node.max_calls = static_cast<std::uint16_t>(std::min(node.max_calls + things, most_calls));
}

}  // namespace

sd::NodeConfig node_config(const BridgeConfig& config, std::size_t descriptors) {
  sd::NodeConfig node = config.someip;
  if (sd::AccessPolicy policy = policy_of(config); !policy.rules.empty()) {
    node.access.policies.push_back(std::move(policy));
  }
  if (config.someip.tell_dds_domain) {
    // Where participants of this domain look for each other, unless told otherwise (DDSI-RTPS, 9.6.1).
    constexpr std::uint32_t first_port = 7400;
    constexpr std::uint32_t ports_per_domain = 250;
    node.gateway_to = {IpAddress::v4(239, 255, 0, 1),
                       static_cast<std::uint16_t>(first_port + ports_per_domain * config.dds.domain)};
  }
  const std::vector<Demand> demands = demands_of(config);
  std::size_t parts = 0;
  std::size_t received = 0;
  std::size_t sent = 0;
  std::size_t calls = node.max_calls;
  for (const Demand& one : demands) {
    parts += one.parts;
    received = std::max(received, one.received);
    sent = std::max(sent, one.sent);
    calls += one.calls;
  }
  size_discovery(config, std::min(parts, most_slots), node);
  // Large messages of all routes may be under way at once, even if one server has them all.
  const std::size_t kinds = most_kinds_at_one_port(demands);
  node.max_reassemblies_per_sender = std::max(node.max_reassemblies_per_sender, kinds);
  node.max_reassemblies = std::max(node.max_reassemblies, kinds + 16);
  node.max_message_bytes = std::max(received, sent);
  node.receive_buffer_bytes = config.someip.receive_buffer ? static_cast<int>(*config.someip.receive_buffer)
                                                           : room_for(received, node.receive_buffer_bytes);
  node.send_buffer_bytes = config.someip.send_buffer ? static_cast<int>(*config.someip.send_buffer)
                                                     : room_for(sent, node.send_buffer_bytes);
  node.max_calls = static_cast<std::uint16_t>(std::min(calls, most_calls));
  // A route has up to two messages on their way at once.
  node.max_queued_bytes =
      std::max(node.max_queued_bytes, 2 * (node.max_message_bytes + someip::header_bytes));
  for (const LimitKey& key : limit_keys()) {
    if (const auto given = config.someip.given_limits.find(key.name);
        given != config.someip.given_limits.end()) {
      key.set(node, given->second);
    }
  }
  if (!config.someip.given_limits.contains("max_tcp_connections")) {
    // As many as the ports accept: who takes all that one address may have at each leaves the others theirs.
    raise(node.limits.max_tcp_connections,
          std::max<std::size_t>(256, tcp_ports_of(demands) * node.max_tcp_clients));
    node.limits.max_tcp_connections = static_cast<std::uint16_t>(
        std::min<std::size_t>(node.limits.max_tcp_connections, descriptors - descriptors / 4));
  }
  make_room_for_guests(node);
  raise(node.limits.max_pending_entries,  // a shutdown needs them
        std::size_t{node.limits.max_offers} + node.limits.max_subscriptions);
  return node;
}

}  // namespace trestle::carry
