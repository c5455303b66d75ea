// What others offer is not what is wanted: said once as a warning, and counted.
#include "someip/net/address_text.hpp"
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

// All services of others are looked through at most every 100 ms: what comes in between waits, and is told.
TEST_F(MismatchesTest, AreToldAlsoWhenTheyComeRightAfterOneAnother) {
  client.require({.service = service, .major = 9});
  for (std::uint16_t i = 1; i <= 5; ++i) {
    ServiceSpec other = offered();
    other.instance = InstanceId{i};
    server.offer(other);
    ASSERT_TRUE(hears(1));
  }
  EXPECT_TRUE(run_until([&] { return warnings.size() == 5; }));
}

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

TEST_F(MismatchesTest, AreInstancesThatTwoOffer) {
  client.offer(offered());
  ServiceSpec other = offered(2);  // another service for clients
  server.offer(other);
  other.instance = InstanceId{2};
  server.offer(other);
  ASSERT_TRUE(hears(5));
  EXPECT_THAT(warnings, IsEmpty());
  ServiceSpec same = offered();
  same.udp_port = 40231;
  const OfferHandle rival = server.offer(same);
  ASSERT_TRUE(run_until([&] { return !warnings.empty(); }));
  ASSERT_TRUE(hears(5));
  EXPECT_THAT(warnings,
              ElementsAre("0x1234.0x0001 version 1 is offered twice: by us, " +
                          someip::to_string(test::client_address) + ", and by " +
                          someip::to_string(test::server_address) + " at UDP " +
                          someip::to_string(test::server_address) + ":40231; clients may use either"));
  EXPECT_EQ(client.counters().offered_twice, 1U);
  // Likewise when the other one was first, and when it comes back.
  client.offer(other);
  EXPECT_EQ(warnings.size(), 2U);
  server.withdraw(rival);
  server.offer(offered());
  ASSERT_TRUE(run_until([&] { return warnings.size() == 3; }));
  EXPECT_EQ(client.counters().offered_twice, 3U);
}

TEST_F(MismatchesTest, KnowWhichServicesOthersOffer) {
  client.offer(offered());
  ServiceSpec other = offered(2);
  other.service = ServiceId{0x1235};
  const OfferHandle theirs = server.offer(other);
  ASSERT_TRUE(run_until([&] { return client.is_offered_by_others(ServiceId{0x1235}); }));
  EXPECT_FALSE(client.is_offered_by_others(service)) << "that is ours";
  server.withdraw(theirs);
  EXPECT_TRUE(run_until([&] { return !client.is_offered_by_others(ServiceId{0x1235}); }));
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
