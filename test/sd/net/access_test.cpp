// Who may do what: access rules, and the rates that hold for each address.
#include "sd/net/access.hpp"

#include <boost/asio/ip/tcp.hpp>

#include "sd/net/access_guard.hpp"
#include "someip/net/address_text.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd::access_test {
namespace {
using namespace test;
using namespace std::chrono_literals;
using someip::EventgroupId;
using someip::InstanceId;
using someip::MethodId;
using someip::ServiceId;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

Subnet subnet(const std::string& text) {
  const auto parsed = parse_subnet(text);
  EXPECT_TRUE(parsed) << text;
  return parsed.value_or(Subnet{});
}

IpAddress address(const std::string& text) {
  return someip::parse_address(text).value();
}

TEST(Subnets, HaveTheAddressesThatBeginWithTheirBits) {
  EXPECT_TRUE(subnet("192.168.10.0/24").has(address("192.168.10.255")));
  EXPECT_FALSE(subnet("192.168.10.0/24").has(address("192.168.11.0")));
  EXPECT_TRUE(subnet("192.168.8.0/21").has(address("192.168.15.1")));
  EXPECT_FALSE(subnet("192.168.8.0/21").has(address("192.168.16.1")));
  EXPECT_TRUE(subnet("10.0.0.7").has(address("10.0.0.7")));
  EXPECT_FALSE(subnet("10.0.0.7").has(address("10.0.0.6")));
  EXPECT_TRUE(subnet("0.0.0.0/0").has(address("10.0.0.6")));
  EXPECT_TRUE(subnet("fd00::/8").has(address("fdff::1")));
  EXPECT_FALSE(subnet("fd00::/8").has(address("fe00::1")));
  EXPECT_TRUE(subnet("fd00::1").has(address("fd00::1")));
  EXPECT_FALSE(subnet("fd00::1").has(address("fd00::2")));
  EXPECT_FALSE(subnet("0.0.0.0/0").has(address("fd00::1")));  // of the other IP version
}

TEST(Subnets, AreWrittenAsTheyAreRead) {
  for (const char* const text : {"192.168.10.0/24", "10.0.0.7", "0.0.0.0/0", "fd00::/8", "fd00::1"}) {
    EXPECT_EQ(to_string(subnet(text)), text);
  }
  for (const char* const text :
       {"", "192.168.10", "192.168.10.0/33", "192.168.10.1/24", "fd00::/129", "fd00::1/8", "10.0.0.0/",
        "10.0.0.0/8x", "10.0.0.0/-1", "10.0.0.0/ 8", "/8", "host"}) {
    EXPECT_FALSE(parse_subnet(text)) << text;
  }
}

constexpr AccessGuard::Subject call_of(std::uint16_t service, std::uint16_t method) {
  return {Access::call, ServiceId{service}, InstanceId{1}, method};
}

/// A guard by itself.
struct Guarded {
  explicit Guarded(AccessControl access) : config{.address = server_address, .access = std::move(access)} {}
  NodeConfig config;
  NodeCounters counters{};
  std::vector<std::string> lines{};
  AccessGuard guard{config, counters, [this](const std::string& line) { lines.push_back(line); }};
};

const IpAddress near = IpAddress::v4(10, 0, 0, 1);
const IpAddress far = IpAddress::v4(10, 1, 0, 1);

TEST(AccessRules, NeedOneOfThoseThatAreAboutIt) {
  Guarded one{{.policies = {{.rules = {{.allow = {Access::call},
                                        .first_service = ServiceId{0x1000},
                                        .last_service = ServiceId{0x1fff},
                                        .methods = {MethodId{1}, MethodId{2}},
                                        .peers = {subnet("10.0.0.0/16")}},
                                       {.first_service = ServiceId{0x1000},
                                        .last_service = ServiceId{0x1000},
                                        .methods = {MethodId{2}},
                                        .peers = {subnet("10.1.0.0/16")}}}}}}};
  EXPECT_TRUE(one.guard.allows(call_of(0x1000, 1), near));
  EXPECT_FALSE(one.guard.allows(call_of(0x1000, 1), far));
  EXPECT_FALSE(one.guard.allows(call_of(0x1fff, 1), far));
  EXPECT_TRUE(one.guard.allows(call_of(0x2000, 1), far));  // no rule is about it
  EXPECT_TRUE(one.guard.allows(call_of(0x1000, 3), far));
  EXPECT_TRUE(one.guard.allows(call_of(0x1000, 2), near));  // each of two rules has one of them
  EXPECT_TRUE(one.guard.allows(call_of(0x1000, 2), far));
  // The second rule is about everything else, too.
  const AccessGuard::Subject offer{Access::offer, ServiceId{0x1000}, InstanceId{1}, 0};
  EXPECT_TRUE(one.guard.allows(offer, far));
  EXPECT_FALSE(one.guard.allows(offer, near));
  EXPECT_EQ(one.counters.calls_not_allowed, 2U);
  EXPECT_EQ(one.counters.offers_not_allowed, 1U);
}

TEST(AccessRules, DenyTheRestIfAskedTo) {
  Guarded one{{.policies = {{.rules = {{.allow = {Access::call},
                                        .first_service = ServiceId{0x1000},
                                        .last_service = ServiceId{0x1000},
                                        .peers = {subnet("10.0.0.1")}}},
                             .allow_others = false}}}};
  EXPECT_TRUE(one.guard.allows(call_of(0x1000, 1), near));
  EXPECT_FALSE(one.guard.allows(call_of(0x1001, 1), near));
  EXPECT_FALSE(one.guard.allows({Access::subscribe, ServiceId{0x1000}, InstanceId{1}, 1}, near));
}

TEST(AccessRules, OfSeveralPoliciesAllMustAllow) {
  const auto only = [](const char* peers) { return AccessPolicy{.rules = {{.peers = {subnet(peers)}}}}; };
  Guarded one{{.policies = {only("10.0.0.0/8"), only("10.0.0.0/16")}}};
  EXPECT_TRUE(one.guard.allows(call_of(1, 1), near));
  EXPECT_FALSE(one.guard.allows(call_of(1, 1), far));
}

TEST(AccessRules, AreAboutOneInstanceOrAll) {
  Guarded one{{.policies = {{.rules = {{.instance = InstanceId{2}, .peers = {}}}}}}};
  EXPECT_TRUE(one.guard.allows({Access::offer, ServiceId{1}, InstanceId{1}, 0}, near));
  EXPECT_FALSE(one.guard.allows({Access::offer, ServiceId{1}, InstanceId{2}, 0}, near));
}

TEST(AccessRules, WriteOneLineForMany) {
  Guarded one{{.policies = {{.allow_others = false}}}};
  EXPECT_FALSE(one.guard.allows(call_of(0x1234, 0x17), far));
  one.guard.say_what_was_refused();
  for (int i = 0; i < 100; ++i) {
    EXPECT_FALSE(one.guard.allows(call_of(0x1234, 0x17), far));
    one.guard.say_what_was_refused();
  }
  ASSERT_THAT(one.lines, SizeIs(1));
  EXPECT_EQ(one.lines.front(),
            "refused a call of method 0x0017 of 0x1234.0x0001 by 10.1.0.1: access control does not allow it");
  EXPECT_EQ(one.counters.calls_not_allowed, 101U);
}

TEST(PeerRates, GiveEachAddressItsOwnShare) {
  PeerRate rate{100, 1};
  const TimePoint start{1000s};
  int taken = 0;
  for (int i = 0; i < 1000; ++i) {
    taken += rate.take(near, 0, start) ? 1 : 0;
  }
  EXPECT_EQ(taken, 100);  // what a second brings may come at once
  EXPECT_TRUE(rate.take(far, 0, start));
  EXPECT_TRUE(rate.take(near, 1, start));  // another key
  EXPECT_FALSE(rate.take(near, 0, start + 9ms));
  EXPECT_TRUE(rate.take(near, 0, start + 11ms));
  PeerRate none{0, 1};
  EXPECT_FALSE(none.is_limited());
  EXPECT_TRUE(none.take(near, 0, start));
}

/// A server with a method and an event, and a client.
class GuardedNode : public TwoNodes {
 protected:
  static constexpr MethodId echo{0x11};
  static constexpr MethodId other{0x12};
  static constexpr MethodId event{0x8001};

  void start(const AccessControl& server_access, const AccessControl& client_access = {}) {
    NodeConfig config = quick(server_address);
    config.access = server_access;
    server.emplace(io, config, DiscoveryLog{}, into(server_log));
    const auto answer = [](const someip::Message& request, Responder responder) {
      responder.respond(request.payload);
    };
    offered = server->offer({.service = ServiceId{0x1234},
                             .instance = InstanceId{1},
                             .tcp_port = 0,
                             .methods = {{.id = echo, .handler = answer}, {.id = other, .handler = answer}},
                             .eventgroups = {{.id = EventgroupId{1}, .events = {event}}}});
    config = quick(client_address);
    config.access = client_access;
    client.emplace(io, config, DiscoveryLog{}, into(client_log));
    hello = client->require({.service = ServiceId{0x1234}});
  }
  bool found() {
    return run_until([&] { return !client->available(hello).empty(); });
  }
  void call(MethodId method, Transport transport = Transport::udp, std::size_t bytes = 4,
            Duration timeout = std::chrono::seconds{60}) {
    const std::vector<std::byte> payload = numbers(bytes);
    const ByteView view{payload};
    client->call(hello, {.method = method, .timeout = timeout, .transport = transport}, {&view, 1}, note());
    EXPECT_TRUE(run_until([&] { return !outcomes.empty(); }));
  }

  std::optional<Node> server;
  std::optional<Node> client;
  OfferHandle offered{};
  RequirementId hello{};
};

AccessRule only(const IpAddress& peer) {
  return {.peers = {{peer, 32}}};
}

TEST_F(GuardedNode, AnswersACallThatIsNotAllowedWithAnError) {
  AccessRule rule = only(other_address);
  rule.methods = {echo};
  rule.allow = {Access::call};
  start({.policies = {{.rules = {rule}}}});
  ASSERT_TRUE(found());
  for (const Transport transport : {Transport::udp, Transport::tcp}) {
    outcomes.clear();
    call(echo, transport);
    EXPECT_EQ(outcomes.front().fault, CallFault::error);
    EXPECT_EQ(outcomes.front().code, someip::ReturnCode::not_ok);
  }
  EXPECT_EQ(server->counters().calls_not_allowed, 2U);
  EXPECT_EQ(server->counters().requests, 0U);
  EXPECT_EQ(server->counters().unexpected, 0U);
  EXPECT_THAT(server_log, SizeIs(1));
  outcomes.clear();
  call(other);
  EXPECT_FALSE(outcomes.front().fault);
}

// Also in segments: nothing is put together, and one answer goes to all.
TEST_F(GuardedNode, AnswersALargeCallThatIsNotAllowedOnce) {
  start({.policies = {{.rules = {only(other_address)}}}});
  ASSERT_TRUE(found());
  call(echo, Transport::udp, 5000);
  EXPECT_EQ(outcomes.front().code, someip::ReturnCode::not_ok);
  run_for(20ms);
  EXPECT_EQ(server->counters().requests_answered, 1U);
  EXPECT_EQ(server->counters().calls_not_allowed, 4U);  // segments
}

TEST_F(GuardedNode, DropsACallThatIsNotAllowedIfAskedTo) {
  start({.policies = {{.rules = {only(other_address)}}}, .answer_calls = false});
  ASSERT_TRUE(found());
  call(echo, Transport::udp, 4, 300ms);
  EXPECT_EQ(outcomes.front().fault, CallFault::timed_out);
  EXPECT_TRUE(run_until([&] { return server->counters().calls_not_allowed == 1; }));
  EXPECT_EQ(server->counters().requests_answered, 0U);
  EXPECT_EQ(server->counters().unexpected, 0U);
}

TEST_F(GuardedNode, RefusesASubscriptionWithANack) {
  AccessRule rule = only(other_address);
  rule.allow = {Access::subscribe};
  rule.eventgroups = {EventgroupId{1}};
  start({.policies = {{.rules = {rule}}}});
  const auto subscription = client->subscribe(
      {.service = ServiceId{0x1234}, .eventgroup = EventgroupId{1}, .events = {event}}, collect());
  ASSERT_TRUE(run_until([&] { return client->subscription_faults(subscription).refused > 0; }));
  EXPECT_FALSE(client->subscribed(subscription));
  EXPECT_GE(server->counters().subscriptions_not_allowed, 1U);
  EXPECT_EQ(server->subscribers(offered, event), 0U);
  EXPECT_THAT(server_log,
              Contains(HasSubstr("refused a subscription to eventgroup 0x0001 of 0x1234.0x0001")));
  EXPECT_THAT(server_log, SizeIs(1));
}

TEST_F(GuardedNode, UsesNoServiceWhoseOfferIsNotAllowed) {
  AccessRule rule = only(other_address);
  rule.allow = {Access::offer};
  start({}, {.policies = {{.rules = {rule}}}});
  ASSERT_TRUE(run_until([&] { return client->counters().offers_not_allowed > 1; }));
  EXPECT_THAT(client->available(hello), IsEmpty());
  EXPECT_THAT(client_log, Contains(HasSubstr("refused an offer of 0x1234.0x0001 by " +
                                             someip::to_string(server_address))));
}

TEST_F(GuardedNode, HearsNobodyButItsPeers) {
  start({.peers = {{other_address, 32}}});
  ASSERT_TRUE(found());  // whom it does not hear may hear it
  call(echo, Transport::udp, 4, 300ms);
  EXPECT_EQ(outcomes.front().fault, CallFault::timed_out);
  outcomes.clear();
  call(echo, Transport::tcp, 4, 300ms);
  EXPECT_NE(outcomes.front().fault, std::nullopt);
  EXPECT_TRUE(run_until([&] { return server->counters().peers_not_allowed >= 2; }));
  EXPECT_EQ(server->counters().requests, 0U);
  EXPECT_EQ(server->tcp_server_counters().accepted, 0U);
  EXPECT_EQ(server->discovery_counters().messages_received, 0U);
  EXPECT_THAT(server_log, SizeIs(1));
}

TEST_F(GuardedNode, HearsItsPeers) {
  start({.peers = {{other_address, 32}, {client_address, 32}}});
  ASSERT_TRUE(found());
  call(echo, Transport::tcp);
  EXPECT_FALSE(outcomes.front().fault);
  EXPECT_EQ(server->counters().peers_not_allowed, 0U);
}

TEST_F(TwoNodes, HearsAsManyRequestsOfOneAddressAsItMay) {
  NodeConfig config = quick(server_address);
  config.max_requests_per_second = 3;
  Node server{io, config, {}, into(server_log)};
  int heard = 0;
  server.offer({.service = ServiceId{0x1234},
                .instance = InstanceId{1},
                .methods = {{.id = MethodId{1},
                             .handler = [&](const someip::Message&, const Responder&) { ++heard; },
                             .kind = someip::MethodKind::fire_and_forget}}});
  Node client{io, quick(client_address)};
  const RequirementId wanted = client.require({.service = ServiceId{0x1234}});
  ASSERT_TRUE(run_until([&] { return !client.available(wanted).empty(); }));
  for (int i = 0; i < 100; ++i) {
    EXPECT_TRUE(client.send(wanted, {.method = MethodId{1}}, {}));
  }
  ASSERT_TRUE(run_until(
      [&] { return server.counters().too_many_requests + static_cast<std::uint64_t>(heard) == 100; }));
  EXPECT_GE(heard, 3);
  EXPECT_GE(server.counters().too_many_requests, 1U);
  EXPECT_THAT(server_log, SizeIs(1));
}

TEST_F(TwoNodes, AcceptsAsManyConnectionsOfOneAddressAsItMayMake) {
  NodeConfig config = quick(server_address);
  config.max_tcp_connects_per_second = 2;
  Node server{io, config, {}, into(server_log)};
  constexpr std::uint16_t port = 40377;
  server.offer({.service = ServiceId{0x1234}, .instance = InstanceId{1}, .udp_port = {}, .tcp_port = port});
  std::vector<boost::asio::ip::tcp::socket> clients;
  for (int i = 0; i < 20; ++i) {
    clients.emplace_back(io).connect(
        {boost::asio::ip::make_address(someip::to_string(server_address)), port});
  }
  ASSERT_TRUE(run_until(
      [&] { return server.tcp_server_counters().accepted + server.counters().too_many_connects == 20; }));
  EXPECT_GE(server.counters().too_many_connects, 1U);
  EXPECT_GE(server.tcp_server_counters().accepted, 2U);
  EXPECT_THAT(server_log, SizeIs(1));
}

}  // namespace
}  // namespace trestle::sd::access_test
