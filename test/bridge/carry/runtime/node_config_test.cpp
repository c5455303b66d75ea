#include "bridge/carry/runtime/node_config.hpp"

#include <gmock/gmock.h>

#include "bridge/carry/config/load.hpp"
#include "bridge/carry/config/load_limits.hpp"
#include "sd/core/service_discovery.hpp"

namespace trestle::test::node_config_test {
namespace {

using namespace carry;
using namespace std::chrono_literals;

BridgeConfig load(const std::string& text) {
  const auto loaded = parse_config(text, "bridge.yaml", {});
  EXPECT_TRUE(loaded) << (loaded ? "" : to_string(loaded.error().front()));
  return loaded ? loaded->config : BridgeConfig{};
}

std::string routes(int count, const std::string& direction) {
  std::string text = "routes:\n";
  for (int i = 0; i < count; ++i) {
    text += "  - {topic: /t" + std::to_string(i) + ", type: std_msgs/msg/String, direction: " + direction +
            ", service: " + std::to_string(0x1000 + i) + ", instance: 1, eventgroup: 1, event: 0x8001" +
            (direction == "dds_to_someip" ? ", port: 40001}\n" : "}\n");
  }
  return text;
}

const std::string one_route = routes(1, "someip_to_dds");

TEST(NodeConfigOfABridge, HasRoomForAllThatItCarries) {
  for (const char* const direction : {"someip_to_dds", "dds_to_someip"}) {
    const BridgeConfig config = load("someip: {address: 127.0.0.1}\n" + routes(1000, direction));
    const sd::NodeConfig node = node_config(config);
    EXPECT_GE(node.limits.max_offers, 1000);
    EXPECT_GE(node.limits.max_eventgroups, 1000);
    EXPECT_GE(node.limits.max_requirements, 1000);
    EXPECT_GE(node.limits.max_subscriptions, 1000);
    EXPECT_GE(node.limits.max_remote_services, 1000 + 256);  // others offer something, too
    EXPECT_GE(node.limits.max_subscribers, 3 * 1000);
    EXPECT_GE(node.limits.max_configurations, 1000);
    EXPECT_GE(node.limits.max_pending_entries, node.limits.max_offers + node.limits.max_subscriptions);
    EXPECT_GE(node.limits.max_pending_events, 3 * 1000);  // of a peer that is started anew
    EXPECT_GE(node.discovery.max_entries_per_second, 2 * 1000U);
    EXPECT_GE(node.discovery.max_entries_at_once, 10 * 1000U);
  }
}

TEST(NodeConfigOfABridge, TakesWhoeverSubscribesAsOftenAsItOffers) {
  const std::string sd = "someip: {address: 127.0.0.1, sd: {cyclic_offer_delay: 100 ms}}\n";
  EXPECT_GE(node_config(load(sd + routes(1000, "dds_to_someip"))).discovery.max_entries_per_second, 10'000U);
  const std::string slow = "someip: {address: 127.0.0.1, sd: {cyclic_offer_delay: 3600 s, ttl: 7200 s}}\n";
  EXPECT_EQ(node_config(load(slow + one_route)).discovery.max_entries_per_second,
            sd::DiscoveryRules{}.max_entries_per_second);
}

TEST(NodeConfigOfABridge, KeepsTheDefaultsWithFewRoutes) {
  const sd::NodeConfig node = node_config(load("someip: {address: 127.0.0.1}\n" + one_route));
  EXPECT_EQ(node.limits.max_offers, sd::Limits{}.max_offers);
  EXPECT_EQ(node.limits.max_pending_events, sd::Limits{}.max_pending_events);
  EXPECT_EQ(node.discovery.max_entries_at_once, sd::DiscoveryRules{}.max_entries_at_once);
}

TEST(NodeConfigOfABridge, HasTheLimitsThatAreGiven) {
  const sd::NodeConfig node = node_config(
      load("someip: {address: 127.0.0.1, limits: {max_peers: 1000, max_subscribers_per_eventgroup: 7, "
           "max_queued_bytes: 5 MiB, max_pending_entries: 16}}\n" +
           one_route));
  EXPECT_EQ(node.limits.max_peers, 1000);
  EXPECT_EQ(node.discovery.max_subscribers_per_eventgroup, 7);
  EXPECT_EQ(node.max_queued_bytes, std::size_t{5} << 20U);
  EXPECT_EQ(node.limits.max_pending_entries, node.limits.max_offers + node.limits.max_subscriptions);
}

// So a tool cannot take the place of what a route wants later.
TEST(NodeConfigOfABridge, HasPlacesForToolsBesideThoseThatAreGiven) {
  const sd::NodeConfig node =
      node_config(load("someip: {address: 127.0.0.1, limits: {max_requirements: 7, max_subscriptions: 60000, "
                       "max_calls: 32736}}\n" +
                       one_route));
  EXPECT_EQ(node.limits.max_requirements, 7 + 32);
  EXPECT_EQ(node.limits.max_subscriptions, 60'032);
  EXPECT_EQ(node.max_calls, 32'768);
}

TEST(NodeConfigOfABridge, HasTheTimesThatAreGiven) {
  const sd::NodeConfig node = node_config(
      load("someip: {address: 127.0.0.1, limits: {reassembly_timeout: 200 ms, tcp_message_timeout: 2 s, "
           "tcp_unanswered_timeout: 7200 s, tcp_dead_after: 20 s, duplicate_window: 0 s, "
           "silent_after: 20 s, reboot_pause: 0 s, reassembly_protected_rate: 2 MiB, "
           "max_udp_receive_bytes: 64 MiB}}\n" +
           one_route));
  EXPECT_EQ(node.reassembly_timeout, 200ms);
  EXPECT_EQ(node.tcp_message_timeout, 2s);
  EXPECT_EQ(node.tcp_unanswered_timeout, 2h);
  EXPECT_EQ(node.tcp_dead_after, 20s);
  EXPECT_EQ(node.discovery.duplicate_window, 0s);
  EXPECT_EQ(node.discovery.silent_after, 20s);
  EXPECT_EQ(node.discovery.reboot_pause, 0s);
  EXPECT_EQ(node.reassembly_protected_rate, std::uint32_t{2} << 20U);
  EXPECT_EQ(node.max_udp_receive_bytes, std::size_t{64} << 20U);
}

TEST(NodeConfigOfABridge, NamesItsDdsDomainByTheEndpointOfItsDiscovery) {
  const auto network = [](const std::string& sd, const std::string& dds) {
    return node_config(load("someip: {address: 127.0.0.1" + sd + "}\n" + dds + one_route)).gateway_to;
  };
  const IpAddress group = IpAddress::v4(239, 255, 0, 1);
  EXPECT_EQ(network("", ""), (Endpoint{group, 7400}));
  EXPECT_EQ(network("", "dds: {domain: 232}\n"), (Endpoint{group, 65400}));
  EXPECT_EQ(network(", sd: {tell_dds_domain: false}", ""), std::nullopt);
}

// A thousand services of one method each have a thousand ports, and events a direction of their own.
TEST(NodeConfigOfABridge, HasPlacesForLargeMessagesByTheRoutesOfAPort) {
  const auto places = [](const std::string& text) {
    return node_config(load("someip: {address: 127.0.0.1}\n" + text)).max_reassemblies;
  };
  EXPECT_EQ(places(routes(1000, "dds_to_someip")), sd::NodeConfig{}.max_reassemblies) << "nothing comes";
  EXPECT_EQ(places(routes(1000, "someip_to_dds")), 1016U) << "all come to one port";
  const auto services = [](const std::string& server, const std::string& more) {
    std::string text = "methods:\n";
    for (int i = 0; i < 100; ++i) {
      text += "  - {ros_service: /s" + std::to_string(i) + ", type: std_srvs/srv/SetBool, server: " + server +
              ", service: " + std::to_string(0x1000 + i) + ", instance: 1, method: 1" +
              (more.ends_with('#') ? more.substr(0, more.size() - 1) + std::to_string(1000 + i) : more) +
              "}\n";
    }
    return text;
  };
  EXPECT_EQ(places(services("ros", ", port: 4#")), sd::NodeConfig{}.max_reassemblies);
  EXPECT_EQ(places(services("ros", ", port: 40001")), 116U);
  EXPECT_EQ(places(services("someip", "")), 116U);
}

TEST(NodeConfigOfABridge, HasRoomForAllTcpClientsThatItsPortsTake) {
  const auto places = [](const std::string& limits, int ports) {
    std::string text = "someip: {address: 127.0.0.1" + limits + "}\nroutes:\n";
    for (int i = 0; i < ports; ++i) {
      const std::string number = std::to_string(i);
      text += "  - {topic: /t" + number + ", type: std_msgs/msg/String, direction: dds_to_someip, service: " +
              std::to_string(0x1000 + i) +
              ", instance: 1, eventgroup: 1, event: 0x8001, transport: tcp, port: " +
              std::to_string(41000 + i / 2) + "}\n";  // two services at each
    }
    text +=
        "methods:\n  - {ros_service: /s, type: std_srvs/srv/SetBool, server: ros, service: 1, instance: 1, "
        "method: 1, transport: tcp, port: 40001}\n";
    return node_config(load(text)).limits.max_tcp_connections;
  };
  EXPECT_EQ(places("", 2), 256U);
  EXPECT_EQ(places("", 600), 301U * 64);
  EXPECT_EQ(places(", limits: {max_tcp_clients: 5}", 600), 301U * 5);
  EXPECT_EQ(places(", limits: {max_tcp_clients: 60000}", 600), 60'000U);
  EXPECT_EQ(places(", limits: {max_tcp_connections: 7}", 600), 7U);
}

TEST(NodeConfigOfABridge, LeavesDescriptorsToOthersThanTcpClients) {
  const BridgeConfig config = load("someip: {address: 127.0.0.1}\n" + one_route);
  EXPECT_EQ(node_config(config, 1024).limits.max_tcp_connections, 256U);
  EXPECT_EQ(node_config(config, 200).limits.max_tcp_connections, 150U);
}

// Each key must change something, so that none is forgotten.
TEST(NodeConfigOfABridge, KnowsEachKey) {
  for (const LimitKey& key : limit_keys()) {
    BridgeConfig config = load("someip: {address: 127.0.0.1}\n" + one_route);
    const auto ns = [](Duration time) { return static_cast<std::uint64_t>(time.count()); };
    const auto text_of = [&](std::uint64_t value) {
      config.someip.given_limits[key.name] = value;
      const sd::NodeConfig node = node_config(config);
      const sd::Limits& l = node.limits;
      const sd::DiscoveryRules& d = node.discovery;
      return std::vector<std::uint64_t>{l.max_peers,
                                        l.max_remote_services,
                                        l.max_subscribers,
                                        l.max_offers,
                                        l.max_eventgroups,
                                        l.max_requirements,
                                        l.max_subscriptions,
                                        l.max_tcp_connections,
                                        l.max_configurations,
                                        l.max_configuration_bytes,
                                        l.max_pending_entries,
                                        l.max_pending_events,
                                        l.max_silent_hosts,
                                        d.max_peers_per_address,
                                        d.max_subscribers_per_eventgroup,
                                        d.max_subscribers_per_eventgroup_and_address,
                                        d.max_entries_per_second,
                                        d.max_entries_at_once,
                                        d.max_reboots_at_once,
                                        node.max_calls,
                                        node.max_tcp_clients,
                                        node.max_tcp_clients_per_address,
                                        node.unproven_answer_bytes,
                                        node.unproven_answer_rate,
                                        node.max_repeated_values,
                                        node.max_unread_answer_bytes,
                                        node.max_tcp_queued_bytes,
                                        node.max_tcp_receive_bytes,
                                        node.max_reassemblies,
                                        node.max_reassemblies_per_sender,
                                        node.max_queued_bytes,
                                        node.max_waiting_discovery,
                                        node.max_udp_receive_bytes,
                                        node.reassembly_protected_rate,
                                        node.max_tcp_connects_per_second,
                                        node.max_requests_per_second,
                                        ns(node.reassembly_timeout),
                                        ns(node.tcp_message_timeout),
                                        ns(node.tcp_unanswered_timeout),
                                        ns(node.tcp_dead_after),
                                        ns(d.duplicate_window),
                                        ns(d.silent_after),
                                        ns(d.reboot_pause)};
    };
    EXPECT_NE(text_of(key.max), text_of(key.max - 1)) << key.name;
  }
}

// What the log names can be set.
TEST(NodeConfigOfABridge, HasAKeyForEachLimitOfDiscovery) {
  for (std::size_t i = 0; i < sd::limit_count; ++i) {
    const std::string name = to_string(static_cast<sd::Limit>(i));
    EXPECT_TRUE(std::ranges::any_of(limit_keys(), [&](const LimitKey& key) { return key.name == name; }))
        << name;
  }
}

}  // namespace
}  // namespace trestle::test::node_config_test
