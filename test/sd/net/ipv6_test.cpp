// Two nodes on IPv6. Loopback has one address of it only, so the test makes a network of its own.
#include <sched.h>

#include <cstdlib>

#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/net/two_nodes.hpp"

namespace trestle::sd {
namespace {

using someip::Message;
using someip::MethodId;
using test::covers;
using test::quick;
using namespace std::chrono_literals;

IpAddress v6(std::uint8_t first, std::uint8_t second, std::uint8_t last) {
  IpAddress address{.v6 = true};
  address.bytes[0] = first;
  address.bytes[1] = second;
  address.bytes[15] = last;
  return address;
}

class Ipv6Test : public test::TwoNodes {
 protected:
  static void SetUpTestSuite() {
    made = (unshare(CLONE_NEWNET) == 0 || unshare(CLONE_NEWUSER | CLONE_NEWNET) == 0) &&
           std::system(
               "ip link add v0 type veth peer name v1 && ip link set lo up && ip link set v1 up && "
               "ip link set v0 up && ip addr add fd00::1/64 dev v0 nodad && "
               "ip addr add fd00::2/64 dev v0 nodad && "
               // until it has its carrier, and the addresses are those of this host: before, it would be
               // asked for them on the link
               "timeout 60 sh -c 'until ip link show v0 | grep -q \"state UP\" && "
               "ip -6 route get fd00::1 | grep -q ^local && ip -6 route get fd00::2 | grep -q ^local; "
               "do sleep 0.01; done'") == 0;  // NOLINT(cert-env33-c)
  }
  void SetUp() override {
    if (!made) {
      GTEST_SKIP() << "cannot make a network of its own";
    }
  }
  static NodeConfig config(std::uint8_t host) {
    NodeConfig result = quick(v6(0xfd, 0, host));
    result.multicast = v6(0xff, 0x15, 0x77);
    return result;
  }
  /// See test::calm().
  static NodeConfig calm(std::uint8_t host) {
    NodeConfig result = config(host);
    result.timing = test::calm(result.address).timing;
    return result;
  }
  static inline bool made = false;
};

TEST_F(Ipv6Test, ServesMethodsAndEventsFromTheOfferedEndpoints) {
  covers({"feat_req_someipsd_852"});
  constexpr MethodId echo{1};
  constexpr MethodId over_udp{0x8001};
  constexpr MethodId over_tcp{0x8002};
  constexpr EventgroupId group{1};
  Node server{io, config(1)};
  Node client{io, config(2)};
  const OfferHandle offer =
      server.offer({.service = ServiceId{0x1234},
                    .instance = InstanceId{1},
                    .udp_port = 40240,
                    .tcp_port = 40241,
                    .methods = {{echo, [](const Message& request,
                                          Responder responder) { responder.respond(request.payload); }}},
                    .eventgroups = {{.id = group, .events = {over_udp, over_tcp}}},
                    .tcp_events = {over_tcp}});
  const RequirementId service = client.require({.service = ServiceId{0x1234}});
  const SubscriptionId subscription = client.subscribe({.service = ServiceId{0x1234},
                                                        .instance = InstanceId{1},
                                                        .eventgroup = group,
                                                        .events = {over_udp, over_tcp},
                                                        .tcp = true},
                                                       collect());
  ASSERT_TRUE(run_until([&] { return client.subscribed(subscription); }));
  const std::vector<RemoteService> servers = client.available(service);
  ASSERT_EQ(servers.size(), 1U);
  EXPECT_EQ(servers[0].udp, (Endpoint{v6(0xfd, 0, 1), 40240}));
  EXPECT_EQ(servers[0].tcp, (Endpoint{v6(0xfd, 0, 1), 40241}));

  EXPECT_EQ(server.notify(offer, over_udp, {}).subscribers, 1U);
  ASSERT_TRUE(run_until([&] { return events.size() == 1; }));
  EXPECT_EQ(events[0].from, servers[0].udp);
  EXPECT_EQ(server.notify(offer, over_tcp, {}).subscribers, 1U);
  ASSERT_TRUE(run_until([&] { return events.size() == 2; }));
  EXPECT_EQ(events[1].from, servers[0].tcp);

  const auto payload = test::numbers(100'000);
  const ByteView slice{payload};
  for (const Transport transport : {Transport::udp, Transport::tcp}) {
    outcomes.clear();
    client.call(service, {.method = echo, .transport = transport}, {&slice, 1}, note());
    ASSERT_TRUE(run_until([&] { return !outcomes.empty(); }));
    EXPECT_EQ(outcomes[0].payload, payload);
  }
}

// Here and not on loopback, all of whose addresses are this host's: nobody else can ask in their name.
TEST_F(Ipv6Test, RefusesLargeAnswersOverUdpToWhoHasNotShownToReceiveThere) {
  constexpr MethodId large{1};
  constexpr MethodId getter{2};
  NodeConfig careful = config(1);
  careful.unproven_answer_bytes = 10'000;
  careful.unproven_answer_rate = 1;
  const auto payload = test::numbers(6'000);
  std::vector<bool> sent;
  std::vector<std::string> warnings;
  Node server{io, careful, {}, into(warnings)};
  Node client{io, config(2)};
  server.offer(
      {.service = ServiceId{0x1234},
       .instance = InstanceId{1},
       .udp_port = 40240,
       .tcp_port = 40241,
       .methods = {{large, [&](const Message&,
                               Responder responder) { sent.push_back(responder.respond(payload)); }}},
       .fields = {{.getter = getter, .value = payload}}});
  const RequirementId service = client.require({.service = ServiceId{0x1234}});
  ASSERT_TRUE(run_until([&] { return !client.available(service).empty(); }));
  const auto call = [&](MethodId method, Transport transport = Transport::udp) {
    outcomes.clear();
    client.call(service, {.method = method, .timeout = 60s, .transport = transport}, {}, note());
    EXPECT_TRUE(run_until([&] { return !outcomes.empty(); }));
    return outcomes.empty() ? test::Outcome{} : outcomes.front();
  };

  EXPECT_EQ(call(large).payload, payload);
  EXPECT_EQ(server.counters().answers_refused, 0U);
  const test::Outcome refused = call(large);
  EXPECT_EQ(refused.fault, CallFault::error);
  EXPECT_EQ(refused.code, someip::ReturnCode::not_ok);
  EXPECT_THAT(sent, ::testing::ElementsAre(true, false)) << "the method is told";
  EXPECT_EQ(server.counters().answers_refused, 1U);
  std::erase_if(warnings, [](const std::string& line) { return line.find("refused") == line.npos; });
  EXPECT_THAT(warnings, ::testing::ElementsAre(::testing::AllOf(
                            ::testing::HasSubstr("refused an answer of 6000 bytes over UDP to fd00::2"),
                            ::testing::HasSubstr("(unproven_answer_bytes, unproven_answer_rate)"))));
  EXPECT_EQ(call(getter).code, someip::ReturnCode::not_ok);
  EXPECT_EQ(server.counters().answers_refused, 2U);

  EXPECT_EQ(call(large, Transport::tcp).payload, payload) << "whoever has a connection receives there";
  EXPECT_EQ(call(large).payload, payload);
  EXPECT_EQ(call(getter).payload, payload);
  EXPECT_EQ(server.counters().answers_refused, 2U);
}

// Somebody may subscribe in its name, again and again. Here in one message, by the groups that the field is
// in.
TEST_F(Ipv6Test, SendsALargeInitialValueToOneHostOnlySoOftenAtOnce) {
  constexpr MethodId large{0x8001};
  constexpr MethodId small{0x8002};
  NodeConfig careful = calm(1);
  careful.max_repeated_values = 3;
  std::vector<std::string> warnings;
  Node server{io, careful, {}, into(warnings)};
  Node client{io, calm(2)};
  std::vector<EventgroupSpec> groups;
  for (std::uint16_t i = 1; i <= 8; ++i) {
    groups.push_back({.id = EventgroupId{i}, .events = {large, small}});
  }
  server.offer({.service = ServiceId{0x1234},
                .instance = InstanceId{1},
                .udp_port = 40242,
                .fields = {{.notifier = large, .value = test::numbers(6'000)},
                           {.notifier = small, .value = test::numbers(60)}},
                .eventgroups = groups});
  run_for(std::chrono::milliseconds{30});  // its offer is over
  std::size_t large_ones = 0;
  std::size_t small_ones = 0;
  for (const EventgroupSpec& group : groups) {
    client.subscribe({.service = ServiceId{0x1234}, .eventgroup = group.id, .events = {large, small}},
                     [&, counts = group.id == EventgroupId{1}](const Message& message, const Endpoint&) {
                       if (counts) {
                         ++(message.payload.size() > 60 ? large_ones : small_ones);
                       }
                     });
  }
  EXPECT_TRUE(run_until([&] { return small_ones == 8 && server.counters().repeated_values_refused == 5; }));
  EXPECT_TRUE(run_until([&] { return large_ones == 3; }));
  EXPECT_THAT(warnings, ::testing::Contains(::testing::AllOf(
                            ::testing::HasSubstr("the initial value of event 0x8001 of 0x1234.0x0001, 6000 "
                                                 "bytes, was not sent to fd00::2"),
                            ::testing::HasSubstr("(max_repeated_values)"))));
}

}  // namespace
}  // namespace trestle::sd
