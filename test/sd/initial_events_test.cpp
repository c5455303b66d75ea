// When initial events are asked for: once by each new subscription, and again only when that may have got
// lost.
#include <algorithm>

#include "test/covers.hpp"
#include "test/sd/machine.hpp"
#include "test/sim/network.hpp"

namespace trestle::sd::initial_events_test {
namespace {
using namespace test;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

constexpr Endpoint server_sd{IpAddress::v4(10, 0, 0, 2), 30490};
constexpr Endpoint server_udp{IpAddress::v4(10, 0, 0, 2), 30509};
constexpr Endpoint own_udp{IpAddress::v4(10, 0, 0, 1), 40000};
constexpr RequiredService required{.service = ServiceId{0x1234}, .instance = InstanceId{0x5678}, .major = 1};

// A client of eventgroup 1, whose server knows the flag that asks for initial events or not.
class InitialEvents : public testing::Test {
 protected:
  void SetUp() override {
    const auto requirement = machine.discovery.require(required, machine.now);
    ASSERT_TRUE(requirement);
    ASSERT_TRUE(machine.discovery.subscribe(*requirement, {.eventgroup = EventgroupId{1}, .udp = own_udp},
                                            machine.now));
    machine.run_to(200ms);
  }
  void offer_by_unicast() { machine.unicast(server, {offer({udp(server_udp)})}); }
  void offer_by_multicast() { machine.multicast(server, {offer({udp(server_udp)})}); }
  void answer(bool initial) {
    FakePeer::Said said = ack(1);
    said.entry.tail = Entry::eventgroup_tail(EventgroupId{1}, 0, initial);
    machine.unicast(server, {said});
  }

  static testing::Matcher<std::string> asks() {
    return AllOf(HasSubstr("counter 0 initial udp"), Not(HasSubstr(";")));
  }
  static testing::Matcher<std::string> asks_for_nothing() {
    return AllOf(HasSubstr("subscribe 1234.5678 v1 group 0001 ttl 3 counter 0 udp"), Not(HasSubstr(";")));
  }

  Machine<> machine;
  FakePeer server{server_sd, unicast_flag | explicit_initial_data_flag};
};

// The answer to a Find and the cyclic offer come together, before the first Subscribe can be answered.
TEST_F(InitialEvents, AreAskedForOnceThoughTwoOffersCome) {
  covers({"feat_req_someipsd_1192", "feat_req_someipsd_1191", "feat_req_someipsd_1169"});
  offer_by_unicast();
  EXPECT_THAT(machine.sent(), ElementsAre(asks()));
  offer_by_multicast();
  EXPECT_THAT(machine.run_to(300ms), ElementsAre(asks_for_nothing()));
}

TEST_F(InitialEvents, AreNotAskedForAgainByAUnicastOffer) {
  covers({"feat_req_someipsd_1192", "feat_req_someipsd_1169"});
  offer_by_multicast();
  EXPECT_THAT(machine.run_to(300ms), ElementsAre(asks()));
  offer_by_unicast();
  EXPECT_THAT(machine.sent(), ElementsAre(asks_for_nothing()));
}

// "does not arrive before the next SubscribeEventgroup entry is sent": not before it is queued.
TEST_F(InitialEvents, AreNotAskedForAgainWhenTheAnswerComesInTime) {
  covers({"feat_req_someipsd_844", "feat_req_someipsd_1192"});
  offer_by_multicast();
  EXPECT_THAT(machine.run_to(300ms), ElementsAre(asks()));
  offer_by_multicast();
  answer(true);
  EXPECT_THAT(machine.run_to(400ms), ElementsAre(asks_for_nothing()));
}

TEST_F(InitialEvents, NeedNoStopSubscribeWhenTheAnswerComesInTime) {
  covers({"feat_req_someipsd_844"});
  server = FakePeer{server_sd};
  offer_by_multicast();
  EXPECT_THAT(machine.run_to(300ms), ElementsAre(asks()));
  offer_by_multicast();
  answer(true);
  EXPECT_THAT(machine.run_to(400ms), ElementsAre(asks_for_nothing()));
}

// The server heard the second Subscribe alone, by which it need not send any: its Ack shows it.
TEST_F(InitialEvents, AreAskedForAgainWhenTheFirstRequestWasLost) {
  covers({"feat_req_someipsd_1193", "feat_req_someipsd_614"});
  offer_by_unicast();
  EXPECT_THAT(machine.sent(), ElementsAre(asks()));
  offer_by_multicast();
  EXPECT_THAT(machine.run_to(300ms), ElementsAre(asks_for_nothing()));
  answer(false);
  offer_by_multicast();
  EXPECT_THAT(machine.run_to(400ms), ElementsAre(asks()));
  answer(true);
  offer_by_multicast();
  EXPECT_THAT(machine.run_to(500ms), ElementsAre(asks_for_nothing()));
}

TEST_F(InitialEvents, AreNotAskedForAgainWhenBothAreAnswered) {
  covers({"feat_req_someipsd_1192", "feat_req_someipsd_614"});
  offer_by_unicast();
  EXPECT_THAT(machine.sent(), ElementsAre(asks()));
  offer_by_multicast();
  EXPECT_THAT(machine.run_to(300ms), ElementsAre(asks_for_nothing()));
  answer(true);
  answer(false);
  offer_by_multicast();
  EXPECT_THAT(machine.run_to(400ms), ElementsAre(asks_for_nothing()));
}

// A server that does not know the flag sends them to each new subscription, whichever Subscribe that was.
TEST_F(InitialEvents, AreNotAskedForAgainWhereTheFlagMeansNothing) {
  covers({"feat_req_someipsd_1192"});
  server = FakePeer{server_sd};
  offer_by_unicast();
  EXPECT_THAT(machine.sent(), ElementsAre(asks()));
  offer_by_multicast();
  EXPECT_THAT(machine.run_to(300ms), ElementsAre(asks_for_nothing()));
  answer(false);
  offer_by_multicast();
  EXPECT_THAT(machine.run_to(400ms), ElementsAre(asks_for_nothing()));
}

TEST_F(InitialEvents, AreAskedForAgainAfterTheTimeToLive) {
  covers({"feat_req_someipsd_1191", "feat_req_someipsd_1192"});
  offer_by_unicast();
  EXPECT_THAT(machine.sent(), ElementsAre(asks()));
  machine.run_to(3100ms);
  offer_by_unicast();
  EXPECT_THAT(machine.sent(), ElementsAre(asks_for_nothing()));
  machine.run_to(6100ms);
  EXPECT_THAT(machine.events(), testing::Not(testing::Contains(HasSubstr("subscription lost"))))
      << "there was none";
  offer_by_unicast();
  EXPECT_THAT(machine.sent(), ElementsAre(asks()));
}

TEST_F(InitialEvents, AreAskedForByWhatFollowsARefusal) {
  covers({"feat_req_someipsd_1191", "feat_req_someipsd_618"});
  offer_by_unicast();
  EXPECT_THAT(machine.sent(), ElementsAre(asks()));
  offer_by_multicast();
  machine.unicast(server, {ack(1, {}, 0)});
  EXPECT_THAT(machine.run_to(300ms), ElementsAre(asks())) << "the server has no subscription";
  offer_by_unicast();
  EXPECT_THAT(machine.sent(), ElementsAre(asks_for_nothing()));
  machine.unicast(server, {ack(1, {}, 0)});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("available"), "refused")) << "told once";
}

TEST_F(InitialEvents, AreAskedForByARenewalThatComesTooLate) {
  covers({"feat_req_someipsd_1191", "feat_req_someipsd_253"});
  machine.unicast(server, {offer({udp(server_udp)}, 100)});
  EXPECT_THAT(machine.sent(), ElementsAre(asks()));
  answer(true);
  machine.run_to(3199ms);  // its subscription ends at 3200 ms, before the next one is due
  machine.multicast(server, {offer({udp(server_udp)}, 100)});
  EXPECT_THAT(machine.run_to(3300ms), ElementsAre(asks()));
}

TEST_F(InitialEvents, AreAskedForAfterARebootOfTheServer) {
  covers({"feat_req_someipsd_1193", "feat_req_someipsd_871"});
  offer_by_multicast();
  EXPECT_THAT(machine.run_to(250ms), ElementsAre(asks()));
  answer(true);
  machine.multicast(server, {find(0x9999)});  // else its first message would come twice
  server.reboot();
  offer_by_multicast();
  answer(true);  // to what is not even sent
  EXPECT_THAT(machine.run_to(300ms), ElementsAre(asks()));
  offer_by_unicast();
  EXPECT_THAT(machine.sent(), ElementsAre(asks_for_nothing()));
}

// --- Server and client, with all that is random
// -------------------------------------------------------------

Settings settings_of(std::uint8_t number, std::uint64_t seed) {
  Settings settings;
  settings.unicast = {IpAddress::v4(10, 0, 0, number), 30490};
  settings.seed = seed * 2 + number;
  return settings;
}

void serve(SimNode& node, TimePoint now) {
  static constexpr std::array groups{Eventgroup{.id = EventgroupId{1}}};
  ASSERT_TRUE(node.discovery().offer(
      {.service = ServiceId{0x1234}, .instance = InstanceId{1}, .udp = server_udp, .eventgroups = groups},
      now));
}

void use(SimNode& node, TimePoint now) {
  const auto requirement =
      node.discovery().require({.service = ServiceId{0x1234}, .instance = InstanceId{1}}, now);
  ASSERT_TRUE(requirement);
  ASSERT_TRUE(node.discovery().subscribe(*requirement, {.eventgroup = EventgroupId{1}, .udp = own_udp}, now));
}

// How often a server was to send initial events.
std::size_t initial_events(const SimNode& server) {
  return static_cast<std::size_t>(std::ranges::count_if(
      server.log, [](const std::string& event) { return event.find("initial") != std::string::npos; }));
}

TEST(InitialEventsOfANetwork, AreSentOnceWheneverTheClientStarts) {
  covers({"feat_req_someipsd_1191", "feat_req_someipsd_1192", "feat_req_someipsd_833"});
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    SimNetwork network{seed};
    network.conditions = {.delay_min = 20ms, .delay_max = 20ms};  // so that offers come before answers
    SimNode& server = network.add(settings_of(2, seed), serve);
    // In the repetition phase a missing Ack would be one by the rules, with a way that is so long.
    network.run_for(500ms + std::chrono::milliseconds{network.random().next() % 1000});
    SimNode& client = network.add(settings_of(1, seed), use);
    network.run_for(3s);
    EXPECT_EQ(client.subscribed.size(), 1U) << "seed " << seed;
    EXPECT_EQ(initial_events(server), 1U) << "seed " << seed;
  }
}

TEST(InitialEventsOfANetwork, AreSentHoweverMuchGetsLostAtFirst) {
  covers({"feat_req_someipsd_1193", "feat_req_someipsd_844"});
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    SimNetwork network{seed};
    SimNode& server = network.add(settings_of(2, seed), serve);
    SimNode& client = network.add(settings_of(1, seed), use);
    network.conditions.loss_percent = 50;
    network.run_for(1500ms);
    network.conditions.loss_percent = 0;
    network.run_for(4s);
    EXPECT_EQ(client.subscribed.size(), 1U) << "seed " << seed;
    EXPECT_GE(initial_events(server), 1U) << "seed " << seed;
    const std::size_t so_far = initial_events(server);
    network.run_for(5s);
    EXPECT_EQ(initial_events(server), so_far) << "not again and again, seed " << seed;
  }
}

}  // namespace
}  // namespace trestle::sd::initial_events_test
