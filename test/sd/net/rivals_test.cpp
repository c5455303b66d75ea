// Two that offer the same service: the log names both, and who does not answer is not asked for long.
#include "test/sd/net/bare_peer.hpp"

namespace trestle::sd::net_rivals_test {
namespace {

using someip::Message;
using someip::MethodId;
using test::quick;
using ::testing::IsSupersetOf;
using namespace std::chrono_literals;

constexpr ServiceId service{0x1234};
constexpr ServiceId other_service{0x1235};
constexpr EventgroupId group{1};
constexpr MethodId event{0x8001};
constexpr MethodId method{1};

/// A server, and a rival of bare sockets that offers the same and answers nothing.
class RivalsTest : public test::BarePeer {
 protected:
  static ServiceSpec offered(ServiceId which) {
    return {
        .service = which,
        .instance = InstanceId{1},
        .methods = {{.id = method,
                     .handler = [](const Message&, Responder responder) { responder.respond(ByteView{}); }}},
        .eventgroups = {{.id = group, .events = {event}}}};
  }
  SubscriptionId subscribe(ServiceId which) {
    return client.subscribe(
        {.service = which, .instance = InstanceId{1}, .eventgroup = group, .events = {event}}, collect());
  }

  static constexpr const char* other_offer = "01 00 00 10 1235 0001 01 000258 00000000";
  Duration outcomes_within = 5ms;  ///< the calls' timeout
  std::vector<std::string> warnings;
  Node server{io, quick(test::server_address)};
  Node client{io, quick(test::client_address), into(client_log), into(warnings)};
};

TEST_F(RivalsTest, AreNamedWhenOneIsKeptAndAtOnceWhenOneGivesWay) {
  server.offer(offered(other_service));
  const SubscriptionId kept = subscribe(other_service);
  ASSERT_TRUE(run_until([&] { return client.subscribed(kept); }));
  send(other_offer, "11");
  ASSERT_TRUE(run_until([&] { return !warnings.empty(); }));
  const SubscriptionId moved = subscribe(service);
  for (int i = 0; i < 5; ++i) {
    const std::size_t before = count("0600001012340001");
    send(offer, "11");
    ASSERT_TRUE(run_until([&] { return count("0600001012340001") > before; })) << i;
  }
  EXPECT_EQ(warnings.size(), 1U);
  server.offer(offered(service));
  ASSERT_TRUE(run_until([&] { return client.subscribed(moved); }));
  const std::string honest = someip::to_string(test::server_address);
  const std::string rival = someip::to_string(test::other_address);
  EXPECT_THAT(warnings,
              IsSupersetOf({rival + " offers service 0x1235 instance 0x0001, which " + honest +
                                " offers, too; " + honest + " is used while it answers; 1 such offers",
                            honest + " offers service 0x1234 instance 0x0001, which " + rival +
                                " has offered before; " + rival + " does not answer and is used no more"}));
}

TEST_F(RivalsTest, LoseCallsToAnyInstanceWhenTheyDoNotAnswer) {
  const RequirementId required = client.require({.service = service});
  const auto call = [&] {
    outcomes.clear();
    client.call(required, {.method = method, .timeout = outcomes_within}, {}, note());
    EXPECT_TRUE(run_until([&] { return !outcomes.empty(); }));
    return outcomes.empty() ? CallFault::not_sent : outcomes[0].fault;
  };
  send(offer, "11");
  ASSERT_TRUE(run_until([&] { return client.available(required).size() == 1; }));
  EXPECT_EQ(call(), CallFault::timed_out);
  ServiceSpec honest = offered(service);
  honest.instance = InstanceId{2};
  server.offer(honest);
  ASSERT_TRUE(run_until([&] { return client.available(required).size() == 2; }));
  EXPECT_EQ(call(), CallFault::timed_out) << "calls stay together";
  EXPECT_EQ(call(), CallFault::timed_out);
  outcomes_within = 60s;
  EXPECT_EQ(call(), std::nullopt);
}

// What only the one that came first could be asked is not what we need.
class UselessRivalsTest : public RivalsTest {
 protected:
  void SetUp() override {
    RivalsTest::SetUp();
    honest.tcp_port = 40240;
  }
  /// Until one is answered.
  void call_until_answered(RequirementId required, Transport transport) {
    EXPECT_TRUE(run_until([&] {
      if (outcomes.size() == asked) {
        ++asked;
        client.call(required, {.method = method, .timeout = 1s, .transport = transport}, {}, note());
      }
      return !outcomes.empty() && !outcomes.back().fault;
    }));
  }
  ServiceSpec honest = offered(service);
  std::size_t asked = 0;
};

TEST_F(UselessRivalsTest, LoseASubscriptionOverTcpWhenTheyOfferOnlyUdp) {
  const SubscriptionId subscription = client.subscribe(wanted, collect());
  send(offer, "11");
  ASSERT_TRUE(run_until([&] { return client.subscription_faults(subscription).other_transport == 1; }));
  honest.tcp_events = {event};
  server.offer(honest);
  EXPECT_TRUE(run_until([&] { return client.subscribed(subscription); }));
}

TEST_F(UselessRivalsTest, LoseCallsOverTcpWhenTheyOfferOnlyUdp) {
  const RequirementId required = client.require({.service = service, .instance = InstanceId{1}});
  send(offer, "11");
  ASSERT_TRUE(run_until([&] { return client.available(required).size() == 1; }));
  server.offer(honest);
  call_until_answered(required, Transport::tcp);
}

TEST_F(UselessRivalsTest, LoseCallsOverUdpWhenTheyOfferOnlyTcp) {
  const RequirementId required = client.require({.service = service, .instance = InstanceId{1}});
  send(offer, "06");
  ASSERT_TRUE(run_until([&] { return client.available(required).size() == 1; }));
  server.offer(honest);
  call_until_answered(required, Transport::udp);
}

TEST_F(UselessRivalsTest, LoseCallsOverTcpWhenTheyRefuseTheConnection) {
  acceptor.close();
  const RequirementId required = client.require({.service = service, .instance = InstanceId{1}});
  send(offer, "06");
  ASSERT_TRUE(run_until([&] { return client.available(required).size() == 1; }));
  server.offer(honest);
  call_until_answered(required, Transport::tcp);
}

TEST_F(RivalsTest, AreCountedAsHostsWhenTheyAreHeard) {
  EXPECT_EQ(client.seen_hosts(), 0U);
  send(offer, "11");
  EXPECT_TRUE(run_until([&] { return client.seen_hosts() == 1; }));
  server.offer(offered(service));
  EXPECT_TRUE(run_until([&] { return client.seen_hosts() == 2; }));
}

}  // namespace
}  // namespace trestle::sd::net_rivals_test
