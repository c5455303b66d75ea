// When somebody is refused or ignored, a line names the setting that helps.
#include <functional>

#include "test/sd/net/bare_peer.hpp"

namespace trestle::sd::warnings_test {
namespace {

using boost::asio::ip::tcp;
using someip::MethodId;
using test::quick;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using namespace std::chrono_literals;

constexpr EventgroupId group{1};
constexpr std::uint16_t service_tcp_port = 40245;

/// The tests' node is at client_address, whatever its part: the bare peer speaks to that one.
class WarningsTest : public test::BarePeer {
 protected:
  using BarePeer::send;

  /// @param change  of the limits, before the node starts.
  void start(const std::function<void(NodeConfig&)>& change = {}) {
    NodeConfig config = quick(test::client_address);
    config.discovery.silent_after = 1h;  // so that a machine that stalls makes nobody give way
    if (change) {
      change(config);
    }
    node.emplace(io, config, DiscoveryLog{}, into(warnings));
  }
  void serve() {
    node->offer({.service = ServiceId{0x1234},
                 .instance = InstanceId{1},
                 .udp_port = 0,
                 .tcp_port = service_tcp_port,
                 .eventgroups = {{.id = group, .events = {MethodId{0x8001}}}}});
  }
  tcp::socket connect() {
    tcp::socket result{io};
    result.connect(
        {boost::asio::ip::make_address(someip::to_string(test::client_address)), service_tcp_port});
    return result;
  }
  static std::string endpoint_at(const IpAddress& address) {
    return "0009 04 00" + test::to_hex(std::as_bytes(std::span{address.bytes})).substr(0, 8) + "00 11 9d26";
  }
  /// One of a peer that has several: the counter tells them apart.
  static std::string subscribe(char counter = '0') {
    return std::string{"06 00 00 10 1234 0001 01 000258 000"} + counter + " 0001";
  }
  static std::string repeat(const std::string& entry, int times) {
    std::string result;
    for (int i = 0; i < times; ++i) {
      result += entry;
    }
    return result;
  }
  [[nodiscard]] bool has(const std::string& part) const {
    return std::ranges::any_of(warnings,
                               [&](const std::string& line) { return line.find(part) != line.npos; });
  }
  [[nodiscard]] bool warned_of(const std::string& part) {
    return run_until([&] { return has(part); });
  }
  void expect_reached(Limit limit) {
    const std::string name = to_string(limit);
    EXPECT_TRUE(
        warned_of(": " + name + " is reached; raise it for more (in a bridge: someip: limits: " + name + ")"))
        << ::testing::PrintToString(warnings);
  }

  std::vector<std::string> warnings;
  std::optional<Node> node;
  const std::string own_endpoint = endpoint_at(test::other_address);
};

// --- Limits of service discovery --------------------------------------------------------------------------

TEST_F(WarningsTest, NameTheLimitOfPeers) {
  start([](NodeConfig& config) { config.limits.max_peers = 1; });
  serve();
  Node first{io, quick(test::server_address)};
  const SubscriptionId subscription = first.subscribe({.service = ServiceId{0x1234},
                                                       .instance = InstanceId{1},
                                                       .eventgroup = group,
                                                       .events = {MethodId{0x8001}}},
                                                      collect());
  ASSERT_TRUE(run_until([&] { return first.subscribed(subscription); }));
  // Until it is known that the first one stays.
  EXPECT_TRUE(run_until([&] {
    answer(subscribe(), own_endpoint);
    return has("is reached");
  }));
  expect_reached(Limit::peers);
}

TEST_F(WarningsTest, NameTheLimitOfSubscribers) {
  start([](NodeConfig& config) { config.limits.max_subscribers = 1; });
  serve();
  answer(subscribe('0') + subscribe('1'), own_endpoint);
  expect_reached(Limit::subscribers);
}

TEST_F(WarningsTest, NameTheLimitOfSubscribersOfAnEventgroup) {
  start([](NodeConfig& config) { config.discovery.max_subscribers_per_eventgroup = 1; });
  serve();
  answer(subscribe('0') + subscribe('1'), own_endpoint);
  expect_reached(Limit::subscribers_per_eventgroup);
}

TEST_F(WarningsTest, NameTheLimitOfSubscribersOfAnEventgroupAtOneAddress) {
  start([](NodeConfig& config) { config.discovery.max_subscribers_per_eventgroup_and_address = 1; });
  serve();
  answer(subscribe('0') + subscribe('1'), own_endpoint);
  expect_reached(Limit::subscribers_per_eventgroup_and_address);
}

TEST_F(WarningsTest, NameTheLimitOfRemoteServices) {
  start([](NodeConfig& config) { config.limits.max_remote_services = 1; });
  node->require({.service = ServiceId{0x1234}});
  send("01 00 00 10 1234 0001 01 000258 00000000 01 00 00 10 1234 0002 01 000258 00000000");
  expect_reached(Limit::remote_services);
}

TEST_F(WarningsTest, NameTheLimitOfConnections) {
  start([](NodeConfig& config) { config.limits.max_tcp_connections = 1; });
  serve();
  const tcp::socket first = connect();
  const tcp::socket second = connect();
  expect_reached(Limit::tcp_connections);
}

TEST_F(WarningsTest, NameTheLimitsOfConfigurations) {
  const std::string offers =
      "01 00 01 11 1234 0001 01 000258 00000000 01 00 02 11 1234 0002 01 000258 00000000";
  const std::string options = own_endpoint + "0006 01 00 03613d62 00" + "0006 01 00 03613d63 00";
  start([](NodeConfig& config) { config.limits.max_configurations = 1; });
  node->require({.service = ServiceId{0x1234}});
  answer(offers, options);
  expect_reached(Limit::configurations);

  start([](NodeConfig& config) { config.limits.max_configuration_bytes = 4; });
  node->require({.service = ServiceId{0x1234}});
  answer(offers, options);
  expect_reached(Limit::configuration_bytes);
}

TEST_F(WarningsTest, NameTheLimitOfEntriesThatWait) {
  start([](NodeConfig& config) { config.limits.max_pending_entries = 1; });
  serve();
  answer(subscribe('0') + subscribe('1'), own_endpoint);
  expect_reached(Limit::pending_entries);
}

TEST_F(WarningsTest, NameTheLimitOfEventsThatWait) {
  start([](NodeConfig& config) { config.limits.max_pending_events = 1; });
  serve();
  answer(subscribe('0') + subscribe('1'), own_endpoint);
  expect_reached(Limit::pending_events);
}

TEST_F(WarningsTest, NameTheLimitsOfRates) {
  const std::string find = "00 00 00 00 4321 ffff ff 000003 ffffffff";
  start([](NodeConfig& config) {
    config.discovery.max_entries_per_second = 1;
    config.discovery.max_entries_at_once = 1;
    config.discovery.max_reboots_at_once = 1;
    config.discovery.reboot_pause = 1h;
  });
  answer(repeat(find, 40));
  expect_reached(Limit::entries_per_second);
  EXPECT_THAT(warnings, Not(Contains(HasSubstr("reboot"))));
  for (const std::size_t with_session : {std::size_t{9}, std::size_t{8}, std::size_t{7}}) {
    send({test::client_address, sd_port}, with_session, find, "");
  }
  expect_reached(Limit::reboots);
}

// --- Others -----------------------------------------------------------------------------------------------

TEST_F(WarningsTest, NameTheLimitOfOwnSubscriptions) {
  start([](NodeConfig& config) { config.limits.max_subscriptions = 1; });
  node->subscribe({.service = ServiceId{0x1234}, .eventgroup = EventgroupId{1}, .events = {MethodId{0x8001}}},
                  collect());
  node->subscribe({.service = ServiceId{0x1234}, .eventgroup = EventgroupId{2}, .events = {MethodId{0x8001}}},
                  collect());
  answer(offer, own_endpoint);
  EXPECT_TRUE(
      warned_of("of 0x1234.0x0001: table full: max_subscriptions (1), or 16 to one "
                "eventgroup (of a bridge: someip: limits: max_subscriptions)"))
      << ::testing::PrintToString(warnings);
}

TEST_F(WarningsTest, NameTheLimitOfRequirementsAndOffers) {
  start([](NodeConfig& config) { config.limits.max_requirements = config.limits.max_offers = 1; });
  serve();
  node->require({.service = ServiceId{0x1234}});
  const auto refusal = [](const auto& wish) -> std::string {
    try {
      wish();
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refusal([&] { node->require({.service = ServiceId{0x4321}}); }), HasSubstr("max_requirements"));
  EXPECT_THAT(
      refusal([&] { node->offer({.service = ServiceId{0x4321}, .instance = InstanceId{1}, .udp_port = 0}); }),
      HasSubstr("max_offers"));
}

TEST_F(WarningsTest, NameTheLimitOfTcpClients) {
  start([](NodeConfig& config) { config.max_tcp_clients_per_address = 1; });
  serve();
  const tcp::socket first = connect();
  const tcp::socket second = connect();
  EXPECT_TRUE(warned_of(": its address has all that one may have (max_tcp_clients_per_address)"))
      << ::testing::PrintToString(warnings);
  EXPECT_TRUE(warned_of("no TCP connection for 127."));

  warnings.clear();
  start([](NodeConfig& config) { config.max_tcp_clients = 1; });
  serve();
  // The one that is there gives way if it has said nothing for a second.
  std::vector<tcp::socket> others;
  EXPECT_TRUE(run_until([&] {
    others.push_back(connect());
    return has("no TCP connection");
  }));
  EXPECT_TRUE(warned_of(": all are taken (max_tcp_clients)")) << ::testing::PrintToString(warnings);
}

TEST_F(WarningsTest, NameWhatAllowsForeignEndpoints) {
  start();
  serve();
  answer(subscribe(), endpoint_at(test::server_address));
  EXPECT_TRUE(warned_of("ignored an offer, subscription or SD endpoint of " +
                        someip::to_string(test::other_address) +
                        ": it names another address (foreign_endpoints would allow that)"))
      << ::testing::PrintToString(warnings);
  ASSERT_TRUE(run_until([&] { return count("07000000123400010100000000000001") == 1; })) << "a Nack";

  warnings.clear();
  start([](NodeConfig& config) {
    config.foreign_endpoints = {{.peer = test::other_address, .named = test::server_address}};
  });
  serve();
  answer(subscribe(), endpoint_at(test::server_address));
  EXPECT_TRUE(run_until([&] { return count("07000000123400010100025800000001") == 1; })) << "an Ack";
  EXPECT_THAT(warnings, Not(Contains(HasSubstr("foreign_endpoints"))));
}

}  // namespace
}  // namespace trestle::sd::warnings_test
