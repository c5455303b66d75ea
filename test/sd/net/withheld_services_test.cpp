// How long the services of other gateways to our network are withheld.
#include "sd/net/withheld_services.hpp"

#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::withheld_services_test {
namespace {

using test::quick;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using namespace std::chrono_literals;

constexpr TimePoint start{1000s};
constexpr Endpoint network{IpAddress::v4(239, 255, 0, 1), 7400};

RemoteService service(std::uint16_t place, std::uint16_t generation = 1) {
  RemoteService result;
  result.service = ServiceId{0x1234};
  result.instance = InstanceId{static_cast<std::uint16_t>(place + 1)};
  result.handle = {place, generation};
  return result;
}

TEST(WithheldServices, AreAdmittedWhenTheirTimeIsOver) {
  WithheldServices withheld{3s, {}};
  EXPECT_THAT(withheld.to_admit({service(7)}, start), IsEmpty());
  EXPECT_TRUE(withheld.waits());
  EXPECT_THAT(withheld.to_admit({service(7), service(2)}, start + 1s), IsEmpty());
  EXPECT_THAT(withheld.to_admit({service(2), service(7)}, start + 3s - 1ms), IsEmpty());
  EXPECT_THAT(withheld.to_admit({service(2), service(7)}, start + 3s), ElementsAre(service(7).handle));
  EXPECT_THAT(withheld.to_admit({service(2)}, start + 4s), ElementsAre(service(2).handle));
  EXPECT_FALSE(withheld.waits());
  EXPECT_EQ(withheld.count(), 2U);
}

TEST(WithheldServices, AreAdmittedAsSoonAsTheyAreKnown) {
  bool known = false;
  WithheldServices withheld{3s,
                            [&](const RemoteService& one) { return known && one.instance == InstanceId{2}; }};
  EXPECT_THAT(withheld.to_admit({service(1), service(2)}, start), IsEmpty());
  known = true;
  EXPECT_THAT(withheld.to_admit({service(1), service(2)}, start + 20ms), ElementsAre(service(1).handle));
  EXPECT_THAT(withheld.to_admit({service(1)}, start + 40ms), ElementsAre(service(1).handle)) << "another one";
  EXPECT_EQ(withheld.count(), 2U);
}

TEST(WithheldServices, WaitAnewWhenTheyHaveGoneAndCome) {
  WithheldServices withheld{3s, {}};
  EXPECT_THAT(withheld.to_admit({service(1)}, start), IsEmpty());
  EXPECT_THAT(withheld.to_admit({service(1, 2)}, start + 3s), IsEmpty());
  EXPECT_THAT(withheld.to_admit({}, start + 4s), IsEmpty());
  EXPECT_FALSE(withheld.waits()) << "nothing is remembered of those that are gone";
  EXPECT_THAT(withheld.to_admit({service(1, 2)}, start + 6s), IsEmpty());
}

class WithheldTest : public test::TwoNodes {
 protected:
  static NodeConfig gateway(const IpAddress& address) {
    NodeConfig config = quick(address);
    config.gateway_to = network;
    return config;
  }
  ServiceSpec spec() {
    return {.service = ServiceId{0x1234},
            .instance = InstanceId{1},
            .fields = {{.notifier = someip::MethodId{0x8001}, .value = std::vector{std::byte{7}}}},
            .eventgroups = {{.id = EventgroupId{1}, .events = {someip::MethodId{0x8001}}}}};
  }
  SubscriptionId subscribe(Node& client) {
    return client.subscribe({.service = ServiceId{0x1234},
                             .instance = InstanceId{1},
                             .eventgroup = EventgroupId{1},
                             .events = {someip::MethodId{0x8001}}},
                            collect());
  }
};

TEST_F(WithheldTest, ANodeUsesAServiceOnceItIsKnown) {
  bool known = false;
  int asked = 0;
  NodeConfig config = gateway(test::client_address);
  config.max_withheld = std::chrono::hours{1};
  config.is_way_back_known = [&](const RemoteService& one) {
    EXPECT_EQ(one.instance, InstanceId{1});
    ++asked;
    return known;
  };
  Node client{io, config};
  Node server{io, gateway(test::server_address)};
  server.offer(spec());
  const RequirementId requirement = client.require({.service = ServiceId{0x1234}});
  const SubscriptionId subscription = subscribe(client);
  ASSERT_TRUE(run_until([&] { return asked >= 5; }));
  EXPECT_THAT(client.seen_offers(), SizeIs(1));
  EXPECT_THAT(client.available(requirement), IsEmpty());
  EXPECT_FALSE(client.subscribed(subscription));
  EXPECT_EQ(client.counters().withheld, 1U);
  known = true;
  EXPECT_TRUE(run_until([&] { return client.subscribed(subscription) && !events.empty(); }));
  EXPECT_THAT(client.available(requirement), SizeIs(1));
}

TEST_F(WithheldTest, ANodeTakesItAsAnyOtherWhenItsTimeIsOver) {
  NodeConfig config = gateway(test::client_address);
  config.max_withheld = 50ms;
  Node client{io, config};
  Node server{io, gateway(test::server_address)};
  server.offer(spec());
  const SubscriptionId subscription = subscribe(client);
  EXPECT_TRUE(run_until([&] { return client.subscribed(subscription) && !events.empty(); }));
  EXPECT_EQ(client.counters().withheld, 1U);
}

TEST_F(WithheldTest, ANodeThatIsNoGatewayWaitsForNobody) {
  NodeConfig config = quick(test::client_address);
  config.max_withheld = std::chrono::hours{1};
  Node client{io, config};
  Node server{io, gateway(test::server_address)};
  server.offer(spec());
  const SubscriptionId subscription = subscribe(client);
  EXPECT_TRUE(run_until([&] { return client.subscribed(subscription); }));
}

TEST_F(WithheldTest, ANetworkIsNamedByAMulticastEndpoint) {
  NodeConfig config = quick(test::client_address);
  config.gateway_to = Endpoint{IpAddress::v4(10, 0, 0, 1), 7400};
  EXPECT_THROW((Node{io, config}), std::invalid_argument);
  config.gateway_to = Endpoint{network.address, 0};
  EXPECT_THROW((Node{io, config}), std::invalid_argument);
}

}  // namespace
}  // namespace trestle::sd::withheld_services_test
