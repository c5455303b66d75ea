// What others offer is not what is wanted: said once as a warning, and counted.
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::mismatches_test {
namespace {

using someip::MethodId;
using test::quick;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::MatchesRegex;

constexpr ServiceId service{0x1234};
constexpr InstanceId instance{1};
constexpr EventgroupId group{1};
constexpr MethodId event{0x8001};

class MismatchesTest : public test::TwoNodes {
 protected:
  static ServiceSpec offered(std::uint8_t major = 1) {
    return {.service = service,
            .instance = instance,
            .major = major,
            .eventgroups = {{.id = group, .events = {event}}}};
  }
  static SubscribeSpec wanted() {
    return {.service = service, .instance = instance, .eventgroup = group, .events = {event}};
  }
  /// Until the client has heard this many more of the server's datagrams, so of its offers.
  [[nodiscard]] bool hears(std::uint64_t offers) {
    const std::uint64_t end = client.discovery_counters().datagrams_received + offers;
    return run_until([&] { return client.discovery_counters().datagrams_received >= end; });
  }

  /// Nothing expires that is only late.
  static NodeConfig patient(const IpAddress& address) {
    NodeConfig config = quick(address);
    config.timing.ttl_s = 30;
    return config;
  }

  std::vector<std::string> warnings;
  Node server{io, patient(test::server_address)};
  Node client{io, patient(test::client_address), into(client_log), into(warnings)};
};

TEST_F(MismatchesTest, OfTheProtocolNameWhatIsOffered) {
  const OfferHandle over_udp = server.offer(offered());
  SubscribeSpec over_tcp = wanted();
  over_tcp.udp = false;
  over_tcp.tcp = true;
  const SubscriptionId subscription = client.subscribe(over_tcp, collect());
  ASSERT_TRUE(run_until([&] { return !warnings.empty(); }));
  ASSERT_TRUE(hears(5));
  EXPECT_THAT(warnings, ElementsAre(MatchesRegex("cannot subscribe to eventgroup 0x0001 of 0x1234.0x0001 "
                                                 "over TCP: it is not offered over TCP, only at "
                                                 "UDP 127\\.[0-9.]+:[0-9]+")));
  EXPECT_EQ(client.subscription_faults(subscription).other_transport, 1U);
  EXPECT_EQ(client.subscription_faults(subscription).refused, 0U);
  // When it comes back without, that is said again; when it has what is wanted, nothing is.
  server.withdraw(over_udp);
  const OfferHandle again = server.offer(offered());
  ASSERT_TRUE(run_until([&] { return client.subscription_faults(subscription).other_transport == 2; }));
  EXPECT_EQ(warnings.size(), 2U);
  server.withdraw(again);
  ServiceSpec right = offered();
  right.tcp_port = 0;
  right.tcp_events = {event};
  server.offer(right);
  ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
  EXPECT_EQ(warnings.size(), 2U);
}

TEST_F(MismatchesTest, ThatTheServerRefusesNameBothSides) {
  ServiceSpec spec = offered();
  spec.tcp_port = 0;
  spec.tcp_events = {event};
  server.offer(spec);
  const SubscriptionId subscription = client.subscribe(wanted(), collect());
  ASSERT_TRUE(run_until([&] { return !warnings.empty(); }));
  ASSERT_TRUE(hears(5));
  EXPECT_THAT(warnings, ElementsAre(MatchesRegex(
                            "subscription to eventgroup 0x0001 of 0x1234.0x0001 refused by the server; "
                            "trying again with its next offer; wanted over UDP, offered at UDP "
                            "127[0-9.:]+ and TCP 127[0-9.:]+; it may want a TCP endpoint, too")));
  EXPECT_EQ(client.subscription_faults(subscription).refused, 1U);
  EXPECT_EQ(client.subscription_faults(subscription).other_transport, 0U);
}

TEST_F(MismatchesTest, OfTheVersionNameTheOneThatIsThere) {
  const OfferHandle other = server.offer(offered(2));
  const SubscriptionId subscription = client.subscribe(wanted(), collect());
  client.require({.service = service, .instance = instance});  // which says nothing new
  ASSERT_TRUE(run_until([&] { return !warnings.empty(); }));
  ASSERT_TRUE(hears(5));
  EXPECT_THAT(warnings, ElementsAre(MatchesRegex("0x1234.0x0001 is wanted in version 1.any, but 127[0-9.]+ "
                                                 "offers it in version 2.0")));
  EXPECT_EQ(client.subscription_faults(subscription).other_version, 1U);
  // Beside the right one another is no matter, until that one goes.
  const OfferHandle right = server.offer(offered());
  ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
  EXPECT_EQ(warnings.size(), 1U);
  server.withdraw(right);
  ASSERT_TRUE(run_until([&] { return client.subscription_faults(subscription).other_version == 2; }));
  EXPECT_EQ(warnings.size(), 2U);
  server.withdraw(other);
}

TEST_F(MismatchesTest, AreNoneWithOtherInstancesAndServices) {
  ServiceSpec far = offered(2);
  far.instance = InstanceId{2};
  server.offer(far);
  ServiceSpec stranger = offered(2);
  stranger.service = ServiceId{0x1235};
  server.offer(stranger);
  const SubscriptionId subscription = client.subscribe(wanted(), collect());
  ASSERT_TRUE(hears(5));
  EXPECT_THAT(warnings, IsEmpty());
  server.offer(offered());
  EXPECT_TRUE(run_until([&] { return client.subscribed(subscription); }));
}

TEST_F(MismatchesTest, GoToTheLogOfWhoAskedForNoWarnings) {
  server.offer(offered(2));
  Node other{io, quick(test::other_address), into(server_log)};
  other.subscribe(wanted(), collect());
  EXPECT_TRUE(run_until([&] {
    return std::ranges::any_of(
        server_log, [](const std::string& line) { return line.ends_with("offers it in version 2.0"); });
  }));
}

}  // namespace
}  // namespace trestle::sd::mismatches_test
