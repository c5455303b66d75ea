// Ports and TCP connections that services share, and instances must not.
#include "test/covers.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::sharing_test {
namespace {

using someip::MethodId;
using test::covers;
using test::quick;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using ::testing::UnorderedElementsAre;
using namespace std::chrono_literals;

constexpr MethodId who{0x0001};
constexpr MethodId event{0x8001};
constexpr EventgroupId group{1};

class SharingTest : public test::TwoNodes {
 protected:
  /// Answers with `name`.
  static ServiceSpec spec(std::uint16_t service, std::uint16_t instance, std::byte name) {
    return {.service = ServiceId{service},
            .instance = InstanceId{instance},
            .udp_port = {},
            .tcp_port = 0,
            .methods = {{who,
                         [name](const someip::Message&, Responder responder) {
                           const std::array answer{name};
                           responder.respond(answer);
                         }}},
            .eventgroups = {{.id = group, .events = {event}}},
            .tcp_events = {event}};
  }
  static SubscribeSpec events_of(std::uint16_t service, std::uint16_t instance) {
    return {.service = ServiceId{service},
            .instance = InstanceId{instance},
            .eventgroup = group,
            .events = {event},
            .udp = false,
            .tcp = true};
  }
  RequirementId require(std::uint16_t service, std::uint16_t instance) {
    return client.require({.service = ServiceId{service}, .instance = InstanceId{instance}});
  }
  Endpoint endpoint_of(RequirementId service) {
    EXPECT_TRUE(run_until([&] { return !client.available(service).empty(); }));
    return client.available(service).at(0).tcp.value_or(Endpoint{});
  }
  std::vector<std::byte> ask(RequirementId service) {
    outcomes.clear();
    client.call(service, {.method = who}, {}, note());
    EXPECT_TRUE(run_until([&] { return !outcomes.empty(); }));
    return outcomes.empty() ? std::vector<std::byte>{} : outcomes.front().payload;
  }

  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address)};
};

TEST_F(SharingTest, ServicesAtOneTcpPortShareAConnection) {
  covers({"feat_req_someip_645", "feat_req_someip_644", "feat_req_someip_445"});
  const OfferHandle one = server.offer(spec(0x1234, 1, std::byte{0x0a}));
  const OfferHandle two = server.offer(spec(0x4321, 1, std::byte{0x0b}));
  const RequirementId first = require(0x1234, 1);
  const RequirementId second = require(0x4321, 1);
  EXPECT_EQ(endpoint_of(first), endpoint_of(second));
  EXPECT_THAT(ask(first), ElementsAre(std::byte{0x0a}));
  EXPECT_THAT(ask(second), ElementsAre(std::byte{0x0b}));
  const SubscriptionId of_first = client.subscribe(events_of(0x1234, 1), collect());
  const SubscriptionId of_second = client.subscribe(events_of(0x4321, 1), collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(of_first) && client.subscribed(of_second); }));
  EXPECT_EQ(server.notify(one, event, {}).subscribers, 1U);
  EXPECT_EQ(server.notify(two, event, {}).subscribers, 1U);
  ASSERT_TRUE(run_until([&] { return events.size() == 2; }));
  EXPECT_EQ(events[0].header.service, ServiceId{0x1234});
  EXPECT_EQ(events[1].header.service, ServiceId{0x4321});
  EXPECT_EQ(client.tcp_client_counters().connections, 1U);
  EXPECT_EQ(server.tcp_server_counters().accepted, 1U);
  // When one of them ends, the other keeps it.
  server.withdraw(one);
  ASSERT_TRUE(run_until([&] { return client.available(first).empty(); }));
  EXPECT_THAT(ask(second), ElementsAre(std::byte{0x0b}));
  EXPECT_EQ(server.tcp_server_counters().open, 1U);
  EXPECT_EQ(client.tcp_client_counters().connections, 1U);
}

TEST_F(SharingTest, InstancesHaveATcpPortAndAConnectionEach) {
  covers({"feat_req_someip_644", "feat_req_someip_445", "feat_req_someip_967"});
  const OfferHandle one = server.offer(spec(0x1234, 1, std::byte{0x0a}));
  const OfferHandle two = server.offer(spec(0x1234, 2, std::byte{0x0b}));
  const RequirementId first = require(0x1234, 1);
  const RequirementId second = require(0x1234, 2);
  EXPECT_NE(endpoint_of(first), endpoint_of(second));
  EXPECT_THAT(ask(first), ElementsAre(std::byte{0x0a}));
  EXPECT_THAT(ask(second), ElementsAre(std::byte{0x0b}));
  const SubscriptionId of_first = client.subscribe(events_of(0x1234, 1), collect());
  const SubscriptionId of_second = client.subscribe(events_of(0x1234, 2), collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(of_first) && client.subscribed(of_second); }));
  server.notify(one, event, {});
  server.notify(two, event, {});
  ASSERT_TRUE(run_until([&] { return events.size() == 2; }));
  const std::vector<Endpoint> senders{events[0].from, events[1].from};
  EXPECT_THAT(senders, UnorderedElementsAre(endpoint_of(first), endpoint_of(second)));
  EXPECT_EQ(client.tcp_client_counters().connections, 2U) << "each for methods and events";
  EXPECT_EQ(server.tcp_server_counters().accepted, 2U);
}

TEST_F(SharingTest, InstancesGetNoTcpPortThatIsNamedTwice) {
  covers({"feat_req_someip_445", "feat_req_someip_967"});
  ServiceSpec named = spec(0x1234, 1, std::byte{0x0a});
  named.tcp_port = 40270;
  server.offer(named);
  named.instance = InstanceId{2};
  try {
    server.offer(named);
    FAIL();
  } catch (const std::exception& error) {
    EXPECT_THAT(error.what(), HasSubstr(":40270"));
  }
  // Another service may, and the same instance in another version, which its messages tell.
  named.service = ServiceId{0x4321};
  server.offer(named);
  named.service = ServiceId{0x1234};
  named.instance = InstanceId{1};
  named.major = 2;
  server.offer(named);
}

}  // namespace
}  // namespace trestle::sd::sharing_test
