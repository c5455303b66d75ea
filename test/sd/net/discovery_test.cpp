// What nodes tell each other beside their endpoints, and how discovery copes with silence and a lost link.
#include "test/covers.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::discovery_test {
namespace {
using namespace std::chrono_literals;
using someip::Message;
using someip::MethodId;
using test::client_address;
using test::covers;
using test::numbers;
using test::other_address;
using test::quick;
using test::server_address;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr MethodId event{0x8001};
constexpr MethodId method{0x0001};

using DiscoveryTest = test::TwoNodes;

ServiceSpec service(std::uint16_t instance = 1) {
  return {.service = ServiceId{0x1234},
          .instance = someip::InstanceId{instance},
          .eventgroups = {{.id = EventgroupId{1}, .events = {event}}}};
}

const SubscribeSpec wanted{.service = ServiceId{0x1234},
                           .instance = someip::InstanceId{1},
                           .eventgroup = EventgroupId{1},
                           .events = {event}};

TEST_F(DiscoveryTest, ShowsTheConfigurationOfAService) {
  covers({"feat_req_someipsd_857", "feat_req_someipsd_684", "feat_req_someipsd_1147"});
  Node server{io, quick(server_address)};
  Node client{io, quick(client_address), into(client_log)};
  const std::vector<ConfigurationText> said{
      {"b", "2"}, {"flag", std::nullopt}, {"a", ""}, {"b", "1"}, {"otherserver", "x=y"}};
  ServiceSpec spec = service();
  spec.configuration = said;
  spec.options.load_balancing = LoadBalancingOption{.priority = 3, .weight = 4};
  const OfferHandle offer = server.offer(spec);
  const RequirementId requirement = client.require({.service = ServiceId{0x1234}});
  ASSERT_TRUE(run_until([&] { return !client.available(requirement).empty(); }));
  const RemoteService found = client.available(requirement).front();
  EXPECT_EQ(client.configuration(found), said);
  EXPECT_EQ(found.options.load_balancing, spec.options.load_balancing);
  EXPECT_THAT(client_log, Contains(HasSubstr(", priority 3 weight 4")));
  server.withdraw(offer);
  ASSERT_TRUE(run_until([&] { return client.available(requirement).empty(); }));
  EXPECT_THAT(client.configuration(found), IsEmpty());
}

TEST_F(DiscoveryTest, CallsTheServerOfTheLowestPriority) {
  Node first{io, quick(server_address)};
  Node second{io, quick(other_address)};
  Node client{io, quick(client_address)};
  const auto ranked = [](std::uint16_t instance, std::uint16_t priority) {
    ServiceSpec spec = service(instance);
    spec.options.load_balancing = LoadBalancingOption{.priority = priority, .weight = 1};
    spec.methods = {{.id = method, .handler = [instance](const Message&, Responder responder) {
                       const std::array answer{static_cast<std::byte>(instance)};
                       responder.respond(ByteView{answer});
                     }}};
    return spec;
  };
  first.offer(ranked(1, 9));
  const OfferHandle better = second.offer(ranked(2, 8));
  const RequirementId requirement = client.require({.service = ServiceId{0x1234}});
  ASSERT_TRUE(run_until([&] { return client.available(requirement).size() == 2; }));
  const auto answer = [&](const CallSpec& spec) {
    outcomes.clear();
    client.call(requirement, spec, {}, note());
    EXPECT_TRUE(run_until([&] { return outcomes.size() == 1; }));
    return outcomes.empty() || outcomes.front().payload.empty()
               ? 0
               : std::to_integer<int>(outcomes.front().payload.front());
  };
  EXPECT_EQ(answer({.method = method}), 2);
  EXPECT_EQ(answer({.method = method, .instance = someip::InstanceId{1}}), 1);
  second.withdraw(better);
  ASSERT_TRUE(run_until([&] { return client.available(requirement).size() == 1; }));
  EXPECT_EQ(answer({.method = method}), 1);
}

TEST_F(DiscoveryTest, StaysWithTheServerItHasChosen) {
  Node first{io, quick(server_address)};
  Node second{io, quick(other_address)};
  Node client{io, quick(client_address)};
  std::array<int, 3> calls{};
  const auto counting = [&calls](std::uint16_t instance) {
    ServiceSpec spec = service(instance);
    spec.methods = {
        {.id = method,
         .handler = [&calls, instance](const Message&, const Responder&) { ++calls.at(instance); },
         .kind = someip::MethodKind::fire_and_forget}};
    return spec;
  };
  first.offer(counting(1));
  second.offer(counting(2));
  const RequirementId requirement = client.require({.service = ServiceId{0x1234}});
  ASSERT_TRUE(run_until([&] { return client.available(requirement).size() == 2; }));
  for (int i = 0; i < 20; ++i) {
    EXPECT_TRUE(client.send(requirement, {.method = method}, {}));
  }
  ASSERT_TRUE(run_until([&] { return calls[1] + calls[2] == 20; }));
  EXPECT_TRUE(calls[1] == 0 || calls[2] == 0);
}

TEST_F(DiscoveryTest, ServesWhoBothSidesAreConfiguredWith) {
  covers({"feat_req_someipsd_444"});
  Node server{io, quick(server_address), into(server_log)};
  Node client{io, quick(client_address), into(client_log)};
  ServiceSpec spec = service();
  spec.eventgroups[0].configured_subscribers = {{client_address, 40131}};
  const OfferHandle offer = server.offer(spec);
  EXPECT_EQ(server.subscribers(offer, event), 1U);
  SubscribeSpec configured = wanted;
  configured.port = 40131;
  configured.configured = true;
  const SubscriptionId subscription = client.subscribe(configured, collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
  const auto payload = numbers(5);
  const ByteView slice{payload};
  EXPECT_EQ(server.notify(offer, event, {&slice, 1}).subscribers, 1U);
  ASSERT_TRUE(run_until([&] { return events.size() == 1; }));
  EXPECT_EQ(events[0].payload, payload);
  run_for(100ms);  // two cycles of offers, and no word about subscriptions
  EXPECT_THAT(server_log, Not(Contains(HasSubstr("subscri"))));
  EXPECT_THAT(client_log, Not(Contains(HasSubstr("subscri"))));
}

TEST_F(DiscoveryTest, StartsAnewWhenTheLinkComesBack) {
  covers({"feat_req_someipsd_23", "feat_req_someipsd_436", "feat_req_someipsd_437", "feat_req_someipsd_440"});
  Node server{io, quick(server_address), into(server_log)};
  Node client{io, quick(client_address), into(client_log)};
  ServiceSpec spec = service();
  spec.tcp_port = 0;
  spec.tcp_events = {event};
  const OfferHandle offer = server.offer(spec);
  SubscribeSpec by_tcp = wanted;
  by_tcp.udp = false;
  by_tcp.tcp = true;
  const SubscriptionId subscription = client.subscribe(by_tcp, collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
  EXPECT_EQ(server.tcp_server_counters().open, 1U);

  server.link(false);
  EXPECT_EQ(server.subscribers(offer, event), 0U);
  EXPECT_EQ(server.tcp_server_counters().open, 0U);
  EXPECT_THAT(server_log, Contains(HasSubstr("link down, no longer subscribed")));
  client.link(false);
  EXPECT_FALSE(client.subscribed(subscription));
  EXPECT_THAT(client_log, Contains(HasSubstr("is gone: link down")));
  const std::uint64_t sent = server.discovery_counters().datagrams_sent;
  run_for(150ms);  // three cycles of offers
  EXPECT_EQ(server.discovery_counters().datagrams_sent, sent);
  EXPECT_FALSE(client.subscribed(subscription));

  server.link(true);
  client.link(true);
  ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
  server.notify(offer, event, {});
  EXPECT_TRUE(run_until([&] { return events.size() == 1; }));
}

TEST_F(DiscoveryTest, FindsWhatIsNotSomeip) {
  covers({"feat_req_someip_624", "feat_req_someipsd_500", "feat_req_someipsd_503"});
  Node server{io, quick(server_address)};
  Node client{io, quick(client_address), into(client_log)};
  for (const std::string name : {"diag", "log"}) {
    server.offer({.service = other_protocols,
                  .instance = someip::InstanceId{1},
                  .configuration = {{"otherserv", name}}});
  }
  const MacGroupcastOption groupcast{.address = {0x91, 0xe0, 0xf0, 0x00, 0x0e, 0xfe}, .protocol = 0x22f0};
  server.offer({.service = other_protocols,
                .instance = someip::InstanceId{1},
                .udp_port = {},
                .configuration = {{"otherserv", "stream"}},
                .options = {.mac_groupcast = groupcast}});
  const RequirementId diag = client.require({.service = other_protocols, .otherserv = "diag"});
  const RequirementId stream = client.require({.service = other_protocols, .otherserv = "stream"});
  const RequirementId nothing = client.require({.service = other_protocols, .otherserv = "nothing"});
  ASSERT_TRUE(
      run_until([&] { return client.available(diag).size() == 1 && client.available(stream).size() == 1; }));
  EXPECT_THAT(client.configuration(client.available(diag).front()),
              ElementsAre(ConfigurationText{"otherserv", "diag"}));
  EXPECT_EQ(client.available(stream).front().options.mac_groupcast, groupcast);
  EXPECT_THAT(client.available(nothing), IsEmpty());
  EXPECT_THAT(client_log, Contains(HasSubstr(" is offered at MAC 91:e0:f0:00:0e:fe, protocol 0x22f0")));
}

TEST_F(DiscoveryTest, FollowsTheRulesOfItsConfiguration) {
  NodeConfig strict = quick(server_address);
  strict.discovery.max_subscribers_per_eventgroup = 0;
  Node server{io, strict, into(server_log)};
  Node client{io, quick(client_address), into(client_log)};
  server.offer(service());
  client.subscribe(wanted, collect());
  SubscribeSpec unknown = wanted;
  unknown.eventgroup = EventgroupId{2};
  client.subscribe(unknown, collect());
  ASSERT_TRUE(run_until([&] { return server.discovery_counters().nacks_sent >= 2; }));
  EXPECT_THAT(server_log, Contains(HasSubstr("refused a subscription of 127.")));
  EXPECT_THAT(server_log, Contains(HasSubstr(": no room")));
  EXPECT_THAT(server_log,
              Contains(testing::ContainsRegex("eventgroup 0x0002 of 0x1234.0x0001.*: unknown eventgroup")));
}

TEST_F(DiscoveryTest, RefusesWhatCannotBe) {
  Node node{io, quick(server_address)};
  ServiceSpec spec = service();
  spec.configuration = {{"", "x"}};
  EXPECT_THROW(node.offer(spec), std::invalid_argument);
  spec.configuration = {{"otherserv", "x"}};
  EXPECT_THROW(node.offer(spec), std::invalid_argument);
  spec.configuration.clear();
  spec.eventgroups[0].configured_subscribers = {{client_address, 1}, {client_address, 0}};
  EXPECT_THROW(node.offer(spec), std::invalid_argument);
  spec.eventgroups[0].configured_subscribers.pop_back();
  node.offer(spec);  // the failed attempts left nothing behind
  EXPECT_THROW(node.require({.service = other_protocols}), std::invalid_argument);
  SubscribeSpec configured = wanted;
  configured.configured = true;
  EXPECT_THROW(node.subscribe(configured, collect()), std::invalid_argument);
  configured.port = 40132;
  configured.tcp = true;
  EXPECT_THROW(node.subscribe(configured, collect()), std::invalid_argument);
}

}  // namespace
}  // namespace trestle::sd::discovery_test
