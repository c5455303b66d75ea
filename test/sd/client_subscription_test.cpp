// ServiceDiscovery as a client that subscribes, in virtual time, with peers made by hand.
#include <gmock/gmock.h>

#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/client_fixture.hpp"

namespace trestle::sd::client_subscription_test {
namespace {
using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

TEST_F(Client, SubscribesWhateverTheMinorVersion) {
  covers({"feat_req_someipcompat_1216"});
  require(required);
  subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp});
  FakePeer::Said newer = offer({udp(server_udp)});
  newer.entry.tail = 0x00c0ffee;
  machine.unicast(server, {newer});
  EXPECT_THAT(
      machine.sent(),
      ElementsAre("0ms -> 10.0.0.2:30490 s1 reboot: subscribe 1234.5678 v1 group 0001 ttl 3 counter 0 "
                  "initial udp 10.0.0.1:40000"));
}

TEST_F(Client, SubscribesWhenTheServiceIsOffered) {
  covers({"feat_req_someipsd_321", "feat_req_someipsd_322", "feat_req_someipsd_422", "feat_req_someipsd_428",
          "feat_req_someipsd_430", "feat_req_someipsd_766", "feat_req_someipsd_786", "feat_req_someipsd_798",
          "feat_req_someipsd_818", "feat_req_someipsd_848", "feat_req_someipsd_1191"});
  require(required);
  subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp, .tcp = own_tcp});
  machine.run_to(200ms);
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.sent(), IsEmpty());
  EXPECT_THAT(
      machine.run_to(300ms),
      ElementsAre("205ms -> 10.0.0.2:30490 s1 reboot: subscribe 1234.5678 v1 group 0001 ttl 3 counter 0 "
                  "initial udp 10.0.0.1:40000 tcp 10.0.0.1:41000"));
}

TEST(ClientWithRandomDelays, AnswersOffersByMulticastWithinTheBounds) {
  covers({"feat_req_someipsd_766", "feat_req_someipsd_84", "feat_req_someipsd_85"});
  std::array<int, 7> drawn{};  // of a millisecond each
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Settings settings = fixed_settings();
    settings.timing.request_response_delay_min = 2ms;
    settings.timing.request_response_delay_max = 9ms;
    settings.seed = seed;
    Machine<> machine{settings};
    FakePeer server{server_sd};
    const auto requirement = machine.discovery.require(required, machine.now);
    ASSERT_TRUE(requirement);
    ASSERT_TRUE(machine.discovery.subscribe(*requirement, {.eventgroup = EventgroupId{1}, .udp = own_udp},
                                            machine.now));
    machine.run_to(200ms);
    machine.multicast(server, {offer({udp(server_udp)})});
    const TimePoint due = *machine.discovery.deadline();
    ASSERT_GE(due, start + 202ms);
    ASSERT_LE(due, start + 209ms);
    EXPECT_THAT(machine.run_to(due - start - 1ns), IsEmpty());
    EXPECT_THAT(machine.run_to(due - start),
                ElementsAre(testing::HasSubstr("-> 10.0.0.2:30490 s1 reboot: subscribe 1234.5678")));
    ++drawn.at(static_cast<std::size_t>((due - start - 202ms) / 1ms) % drawn.size());
  }
  EXPECT_THAT(drawn, testing::Each(testing::Ge(1)));  // any of them
}

TEST_F(Client, WritesItsSubscribeByteForByte) {
  covers({"feat_req_someipsd_26", "feat_req_someipsd_322", "feat_req_someipsd_682", "feat_req_someipsd_946"});
  require(required);
  subscribe_to({.eventgroup = EventgroupId{0x4465}, .udp = own_udp});
  machine.unicast(server, {offer({udp(server_udp)})});
  std::array<std::byte, 1400> room{};
  const auto transmit = machine.discovery.poll_transmit(room, machine.now);
  ASSERT_TRUE(transmit);
  EXPECT_EQ(to_hex(transmit->bytes), to_hex(hex("ffff8100 00000030 00000001 01010200 e0000000 00000010"
                                                "06000010 12345678 01000003 00804465 0000000c"
                                                "000904000a00000100119c40")));
}

TEST_F(Client, AnswersAUnicastOfferAtOnce) {
  covers({"feat_req_someipsd_624", "feat_req_someipsd_816"});
  require(required);
  subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp});
  machine.unicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr("0ms -> 10.0.0.2:30490 s1 reboot: subscribe")));
}

TEST_F(Client, SubscribesOnceToOffersInQuickSuccession) {
  require(required);
  subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp});
  machine.run_to(200ms);
  machine.multicast(server, {offer({udp(server_udp)})});
  machine.run_to(203ms);
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.run_to(300ms),
              ElementsAre(testing::AllOf(HasSubstr("205ms -> 10.0.0.2:30490 s1 reboot: subscribe"),
                                         testing::Not(HasSubstr(";")))));
}

TEST_F(Client, DoesNotSubscribeToWhatWasStoppedMeanwhile) {
  covers({"feat_req_someipsd_831"});
  require(required);
  subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp});
  machine.run_to(200ms);
  machine.multicast(server, {offer({udp(server_udp)})});
  machine.multicast(server, {offer({udp(server_udp)}, 0)});
  EXPECT_THAT(machine.run_to(1s), IsEmpty());
}

TEST_F(Client, AnswersAllOffersOfAMessageInOne) {
  covers({"feat_req_someipsd_812", "feat_req_someipsd_836"});
  require(any_required);
  subscribe_to({.eventgroup = EventgroupId{1}, .instance = InstanceId{1}, .udp = own_udp});
  subscribe_to({.eventgroup = EventgroupId{1}, .instance = InstanceId{2}, .udp = own_udp});
  subscribe_to({.eventgroup = EventgroupId{2}, .instance = InstanceId{2}, .udp = own_udp});
  machine.run_to(200ms);
  machine.multicast(server, {offer({udp(server_udp)}, 3, 0x1234, 1), offer({udp(server_udp)}, 3, 0x1234, 2)});
  EXPECT_THAT(machine.run_to(205ms),
              ElementsAre("205ms -> 10.0.0.2:30490 s1 reboot: "
                          "subscribe 1234.0001 v1 group 0001 ttl 3 counter 0 initial udp 10.0.0.1:40000; "
                          "subscribe 1234.0002 v1 group 0001 ttl 3 counter 0 initial udp 10.0.0.1:40000; "
                          "subscribe 1234.0002 v1 group 0002 ttl 3 counter 0 initial udp 10.0.0.1:40000"));
}

TEST_F(Client, AnswersTheOfferWhenTheApplicationSubscribesOnTheEvent) {
  covers({"feat_req_someipsd_766"});
  require(required);
  machine.run_to(200ms);
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.events(), SizeIs(1));
  subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp});
  EXPECT_THAT(machine.run_to(300ms), ElementsAre(HasSubstr("205ms -> 10.0.0.2:30490")));
  machine.run_to(1s);
  subscribe_to({.eventgroup = EventgroupId{2}, .udp = own_udp});
  EXPECT_THAT(machine.sent(),
              ElementsAre(HasSubstr("1000ms -> 10.0.0.2:30490")));  // long after the offer: at once
}

TEST_F(Client, TellsOfTheAckWithItsMulticastEndpoint) {
  covers(
      {"feat_req_someipsd_441", "feat_req_someipsd_791", "feat_req_someipsd_812", "feat_req_someipsd_814"});
  require(required);
  subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp});
  machine.unicast(server, {offer({udp(server_udp)})});
  machine.sent();
  machine.events();
  const EndpointOption multicast{EndpointRole::multicast, {IpAddress::v4(224, 225, 226, 233), 32344}};
  machine.unicast(server, {ack(1, {multicast})});
  EXPECT_THAT(machine.events(), ElementsAre("subscribed multicast 224.225.226.233:32344"));
  machine.unicast(server, {ack(1, {multicast})});
  EXPECT_THAT(machine.events(), IsEmpty());
  machine.unicast(server, {ack(1)});
  EXPECT_THAT(machine.events(), ElementsAre("subscribed"));
}

TEST_F(Client, IgnoresAcksItDidNotAskFor) {
  covers({"feat_req_someipsd_818", "feat_req_someipsd_102"});
  require(required);
  subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp});
  machine.unicast(server, {ack(1)});  // before any offer
  machine.unicast(server, {offer({udp(server_udp)})});
  machine.events();
  FakePeer stranger{{IpAddress::v4(10, 0, 0, 3), 30490}};
  machine.unicast(stranger, {ack(1)});
  machine.unicast(server, {ack(2), ack(1, {}, 3, 1)});
  FakePeer::Said other_version = ack(1);
  other_version.entry.major = 2;
  machine.unicast(server, {other_version});
  EXPECT_EQ(machine.discovery.counters().ignored_unexpected_ack, 5U);
  machine.multicast(server, {ack(1)});
  EXPECT_EQ(machine.discovery.counters().ignored_wrong_transport, 1U);
  machine.unicast(server, {ack(1, {{EndpointRole::multicast, server_udp}})});  // no multicast address
  EXPECT_EQ(machine.discovery.counters().ignored_bad_options, 1U);
  EXPECT_THAT(machine.events(), IsEmpty());
}

TEST_F(Client, IgnoresAcksWhoseMulticastEndpointCannotBe) {
  covers({"feat_req_someipsd_790", "feat_req_someipsd_1144"});
  require(required);
  subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp});
  machine.unicast(server, {offer({udp(server_udp)})});
  machine.events();
  const Endpoint at{IpAddress::v4(224, 225, 226, 233), 32344};
  const EndpointOption multicast{EndpointRole::multicast, at, Transport::udp};
  const EndpointOption another{EndpointRole::multicast, {at.address, 32345}, Transport::udp};
  machine.unicast(server, {ack(1, {{EndpointRole::multicast, at, Transport::tcp}})});
  EXPECT_EQ(machine.discovery.counters().ignored_bad_options, 1U);
  machine.unicast(server, {ack(1, {multicast, another})});
  EXPECT_EQ(machine.discovery.counters().ignored_bad_options, 2U);
  EXPECT_THAT(machine.events(), IsEmpty());
  machine.unicast(server, {ack(1, {multicast, multicast})});  // equal ones are no conflict
  EXPECT_THAT(machine.events(), ElementsAre("subscribed multicast 224.225.226.233:32344"));
}

TEST_F(Client, RenewsWithEachOfferAndAsksForNoInitialDataThen) {
  covers({"feat_req_someipsd_431", "feat_req_someipsd_631", "feat_req_someipsd_1192"});
  subscribed();
  EXPECT_THAT(machine.run_to(1s), IsEmpty());  // no cycle of its own
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(
      machine.run_to(1100ms),
      ElementsAre("1005ms -> 10.0.0.2:30490 s2 reboot: subscribe 1234.5678 v1 group 0001 ttl 3 counter 0 "
                  "udp 10.0.0.1:40000"));
  machine.unicast(server, {ack(1)});
  EXPECT_THAT(machine.events(), IsEmpty());
}

TEST_F(Client, StopsAndSubscribesWhenTheAckIsMissing) {
  covers({"feat_req_someipsd_844", "feat_req_someipsd_1178", "feat_req_someipsd_1177"});
  subscribed();
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.run_to(1s), SizeIs(1));
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.run_to(1100ms),
              ElementsAre("1005ms -> 10.0.0.2:30490 s3 reboot: "
                          "stop_subscribe 1234.5678 v1 group 0001 ttl 0 counter 0 udp 10.0.0.1:40000; "
                          "subscribe 1234.5678 v1 group 0001 ttl 3 counter 0 udp 10.0.0.1:40000"));
}

// Behind the StopSubscribe it does not ask: the TTL of the first runs on. Which pysomeip needs, that drops a
// message with the request for initial events, a reserved bit to it.
TEST_F(Client, AsksForInitialEventsInTheOldWayWhenTheFlagIsNotAnswered) {
  covers({"feat_req_someipsd_844", "feat_req_someipsd_1191", "feat_req_someipsd_1192"});
  require(required);
  subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp});
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.run_to(100ms), ElementsAre(HasSubstr("counter 0 initial udp 10.0.0.1:40000")));
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.run_to(200ms),
              ElementsAre("105ms -> 10.0.0.2:30490 s2 reboot: "
                          "stop_subscribe 1234.5678 v1 group 0001 ttl 0 counter 0 udp 10.0.0.1:40000; "
                          "subscribe 1234.5678 v1 group 0001 ttl 3 counter 0 udp 10.0.0.1:40000"));
}

TEST_F(Client, KeepsStopAndSubscribeInOneDatagram) {
  covers({"feat_req_someipsd_1178"});
  require(required);
  for (std::uint16_t eventgroup = 1; eventgroup <= 3; ++eventgroup) {
    subscribe_to({.eventgroup = EventgroupId{eventgroup}, .udp = own_udp});
  }
  machine.room_bytes = 28 + 3 * 16 + 12 + 4;  // three entries that share an option
  machine.run_to(200ms);
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.run_to(300ms), SizeIs(1));
  machine.multicast(server, {offer({udp(server_udp)})});
  const auto sent = machine.run_to(400ms);
  ASSERT_THAT(sent, SizeIs(3));
  for (const std::string& datagram : sent) {
    EXPECT_THAT(datagram,
                testing::ContainsRegex(
                    "reboot: stop_subscribe .* udp 10.0.0.1:40000; subscribe .* udp 10.0.0.1:40000$"));
  }
}

TEST_F(Client, AsksForInitialDataWhenTheAckIsMissingAndTheServerUnderstands) {
  covers({"feat_req_someipsd_844", "feat_req_someipsd_1193", "feat_req_someipsd_1194"});
  server = FakePeer{server_sd, unicast_flag | explicit_initial_data_flag};
  subscribed();
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.run_to(1s), SizeIs(1));
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.run_to(1100ms),
              ElementsAre("1005ms -> 10.0.0.2:30490 s3 reboot: "
                          "subscribe 1234.5678 v1 group 0001 ttl 3 counter 0 initial udp 10.0.0.1:40000"));
}

// Each message tells anew: another stack may run there meanwhile.
TEST_F(Client, AsksInTheOldWayWhenTheServerNoLongerUnderstands) {
  covers({"feat_req_someipsd_844", "feat_req_someipsd_1188"});
  server = FakePeer{server_sd, unicast_flag | explicit_initial_data_flag};
  require(required);
  subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp});
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.run_to(100ms), SizeIs(1));
  machine.receive(hex("ffff8100 00000030 00000002 01010200 c0000000 00000010"
                      "01000010 12345678 01000003 00000000 0000000c"
                      "000904000a000002001177 2d"),
                  server_sd, true);
  EXPECT_THAT(machine.run_to(200ms),
              ElementsAre("105ms -> 10.0.0.2:30490 s2 reboot: "
                          "stop_subscribe 1234.5678 v1 group 0001 ttl 0 counter 0 udp 10.0.0.1:40000; "
                          "subscribe 1234.5678 v1 group 0001 ttl 3 counter 0 udp 10.0.0.1:40000"));
}

TEST_F(Client, SubscribesAnewAfterASilenceOfItsEvents) {
  covers({"feat_req_someipsd_439", "feat_req_someipsd_691", "feat_req_someipsd_442"});
  require(required);
  const SubscriptionHandle watched = subscribe_to(
      {.eventgroup = EventgroupId{1}, .udp = own_udp, .ttl_s = infinite_ttl_s, .silence_timeout = 2s});
  const SubscriptionHandle other =
      subscribe_to({.eventgroup = EventgroupId{2}, .udp = own_udp, .ttl_s = infinite_ttl_s});
  machine.run_to(195ms);
  machine.unicast(server, {offer({udp(server_udp)}, infinite_ttl_s)});
  machine.run_to(5s);  // before the Ack nothing counts as silence
  machine.unicast(server, {ack(1, {}, infinite_ttl_s), ack(2, {}, infinite_ttl_s)});
  machine.events();
  // Silent from the Ack on, and again from there on.
  const std::string again =
      "subscribe 1234.5678 v1 group 0001 ttl 16777215 counter 0 initial udp 10.0.0.1:40000";
  EXPECT_THAT(machine.run_to(9500ms), ElementsAre("7000ms -> 10.0.0.2:30490 s2 reboot: " + again,
                                                  "9000ms -> 10.0.0.2:30490 s3 reboot: " + again));
  EXPECT_EQ(machine.discovery.counters().silences, 2U);
  // An Ack is no event: it neither ends the silence nor starts it anew.
  machine.unicast(server, {ack(1, {}, infinite_ttl_s)});
  EXPECT_THAT(machine.events(), IsEmpty());
  // Events put it off.
  machine.run_to(10900ms);
  machine.discovery.event_received(watched, machine.now);
  machine.discovery.event_received(other, machine.now);
  EXPECT_THAT(machine.run_to(12899ms), IsEmpty());
  EXPECT_THAT(machine.run_to(12900ms), ElementsAre(HasSubstr("12900ms")));
  // After its end nothing is asked for.
  machine.unicast(server, {offer({udp(server_udp)}, 0)});
  machine.events();
  machine.discovery.event_received(watched, machine.now);
  EXPECT_THAT(machine.run_to(1h), IsEmpty());
}

TEST_F(Client, WaitsForNoEventsOfWhatIsRefused) {
  covers({"feat_req_someipsd_439"});
  require(required);
  subscribe_to(
      {.eventgroup = EventgroupId{1}, .udp = own_udp, .ttl_s = infinite_ttl_s, .silence_timeout = 2s});
  machine.run_to(195ms);
  machine.unicast(server, {offer({udp(server_udp)}, infinite_ttl_s)});
  machine.run_to(300ms);
  machine.unicast(server, {ack(1, {}, infinite_ttl_s)});
  machine.run_to(400ms);
  machine.unicast(server, {ack(1, {}, 0)});
  EXPECT_THAT(machine.run_to(1min), IsEmpty());
  EXPECT_EQ(machine.discovery.counters().silences, 0U);
}

TEST_F(Client, AsksOnceWhenAnOfferComesInASilence) {
  covers({"feat_req_someipsd_439"});
  require(required);
  subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp, .silence_timeout = 3ms});
  machine.unicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.sent(), SizeIs(1));
  machine.unicast(server, {ack(1)});
  machine.multicast(server, {offer({udp(server_udp)})});  // its answer is due in 5 ms
  EXPECT_THAT(machine.run_to(5ms), ElementsAre(HasSubstr("5ms -> 10.0.0.2:30490 s2 reboot: subscribe")));
}

TEST_F(Client, DoesNotWatchForAcksAfterUnicastOffers) {
  covers({"feat_req_someipsd_1169", "feat_req_someipsd_1176"});
  subscribed();
  // Triggered by unicast: not watched when the next multicast offer comes.
  machine.unicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.sent(), ElementsAre(testing::Not(HasSubstr("stop_subscribe"))));
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.run_to(1s), ElementsAre(testing::Not(HasSubstr("stop_subscribe"))));
  // Triggered by multicast, and followed by a unicast offer: no pair either.
  machine.unicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.sent(), ElementsAre(testing::Not(HasSubstr("stop_subscribe"))));
}

TEST(ClientWithoutExplicitInitialData, NeverSetsTheFlags) {
  covers({"feat_req_someipsd_1188", "feat_req_someipsd_1187"});
  Settings settings = fixed_settings();
  settings.explicit_initial_data = false;
  Machine<> machine{settings};
  FakePeer server{server_sd, unicast_flag | explicit_initial_data_flag};
  const auto requirement = machine.discovery.require(required, machine.now);
  ASSERT_TRUE(requirement);
  ASSERT_TRUE(machine.discovery.subscribe(*requirement, {.eventgroup = EventgroupId{1}, .udp = own_udp},
                                          machine.now));
  machine.multicast(server, {offer({udp(server_udp)})});
  const std::string first =
      "5ms -> 10.0.0.2:30490 s1 reboot no-explicit: subscribe 1234.5678 v1 group 0001 ttl 3 counter 0 "
      "udp 10.0.0.1:40000";
  EXPECT_THAT(machine.run_to(9ms), ElementsAre(first));
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.run_to(100ms), ElementsAre(HasSubstr("stop_subscribe")));
}

TEST_F(Client, TriesAgainAfterARefusal) {
  covers({"feat_req_someipsd_618", "feat_req_someipsd_869", "feat_req_someipsd_431"});
  require(required);
  subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp});
  machine.unicast(server, {offer({udp(server_udp)})});
  machine.sent();
  machine.events();
  machine.unicast(server, {ack(1, {}, 0)});
  EXPECT_THAT(machine.events(), ElementsAre("refused"));
  EXPECT_THAT(machine.run_to(1s), IsEmpty());
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(
      machine.run_to(1100ms),
      ElementsAre("1005ms -> 10.0.0.2:30490 s2 reboot: subscribe 1234.5678 v1 group 0001 ttl 3 counter 0 "
                  "initial udp 10.0.0.1:40000"));
  machine.unicast(server, {ack(1, {}, 0)});
  EXPECT_THAT(machine.events(), IsEmpty());  // told already
  machine.unicast(server, {ack(1)});
  EXPECT_THAT(machine.events(), ElementsAre("subscribed"));
  machine.unicast(server, {ack(1, {}, 0)});
  EXPECT_THAT(machine.events(), ElementsAre("refused"));
}

TEST_F(Client, LosesASubscriptionThatIsNotAcknowledgedAnyMore) {
  covers({"feat_req_someipsd_322"});
  require(required);
  subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp});
  machine.unicast(server, {offer({udp(server_udp)}, 100)});
  machine.unicast(server, {ack(1)});
  machine.sent();
  machine.events();
  machine.run_to(2999ms);
  EXPECT_THAT(machine.events(), IsEmpty());
  machine.run_to(3s);
  EXPECT_THAT(machine.events(), ElementsAre("subscription lost expired"));
  machine.unicast(server, {offer({udp(server_udp)}, 100)});
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr("counter 0 initial")));
}

TEST_F(Client, StartsAnewWhenTheServerReboots) {
  covers(
      {"feat_req_someipsd_863", "feat_req_someipsd_871", "feat_req_someipsd_872", "feat_req_someipsd_1193"});
  subscribed();
  machine.multicast(server, {find(0x9999)});  // else its first message would come twice
  server.reboot();
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.events(), ElementsAre("subscription lost rebooted", "lost 1234.5678 v1 rebooted",
                                            HasSubstr("available 1234.5678")));
  EXPECT_THAT(machine.run_to(300ms),
              ElementsAre("205ms -> 10.0.0.2:30490 s2 reboot: "
                          "stop_subscribe 1234.5678 v1 group 0001 ttl 0 counter 0 udp 10.0.0.1:40000; "
                          "subscribe 1234.5678 v1 group 0001 ttl 3 counter 0 initial udp 10.0.0.1:40000"));
  machine.unicast(server, {ack(1)});  // the first of its unicast sessions: the same reboot
  EXPECT_THAT(machine.events(), ElementsAre("subscribed"));
}

TEST_F(Client, HoldsATcpSubscriptionUntilItIsConnectedAgain) {
  covers({"feat_req_someipsd_767", "feat_req_someipsd_872"});
  require(required);
  const SubscriptionHandle subscription = subscribe_to({.eventgroup = EventgroupId{1}, .tcp = own_tcp});
  machine.unicast(server, {offer({tcp(server_tcp)})});
  EXPECT_THAT(machine.sent(), SizeIs(1));
  machine.unicast(server, {ack(1)});
  machine.events();
  machine.unicast(server, {offer({tcp(server_tcp)}, 0)});
  EXPECT_THAT(machine.events(), ElementsAre("subscription lost stopped", "lost 1234.5678 v1 stopped"));
  machine.unicast(server, {offer({tcp(server_tcp)})});
  EXPECT_THAT(machine.sent(), IsEmpty());
  machine.discovery.reconnected(subscription, {own_tcp.address, 41001}, machine.now);
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr("tcp 10.0.0.1:41001")));
}

TEST_F(Client, Unsubscribes) {
  covers({"feat_req_someipsd_332", "feat_req_someipsd_333", "feat_req_someipsd_433", "feat_req_someipsd_1177",
          "feat_req_someipsd_442"});
  const SubscriptionHandle subscription = subscribed();
  machine.multicast(server, {offer({udp(server_udp)})});  // its Subscribe is due in 5 ms
  machine.discovery.unsubscribe(subscription, machine.now);
  EXPECT_THAT(
      machine.run_to(1s),
      ElementsAre("200ms -> 10.0.0.2:30490 s2 reboot: stop_subscribe 1234.5678 v1 group 0001 ttl 0 counter 0 "
                  "udp 10.0.0.1:40000"));
  machine.discovery.unsubscribe(subscription, machine.now);
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.run_to(2s), IsEmpty());
  EXPECT_THAT(machine.events(), IsEmpty());
}

TEST_F(Client, EndsItsSubscriptionsWhenTheServiceIsReleased) {
  covers({"feat_req_someipsd_822"});
  subscribed();
  subscribe_to({.eventgroup = EventgroupId{2}, .udp = own_udp});
  machine.sent();
  machine.discovery.release(requirement, machine.now);
  EXPECT_THAT(machine.sent(),
              ElementsAre("200ms -> 10.0.0.2:30490 s3 reboot: "
                          "stop_subscribe 1234.5678 v1 group 0001 ttl 0 counter 0 udp 10.0.0.1:40000; "
                          "stop_subscribe 1234.5678 v1 group 0002 ttl 0 counter 0 udp 10.0.0.1:40000"));
  machine.multicast(server, {offer({udp(server_udp)}, 0)});
  EXPECT_THAT(machine.events(), IsEmpty());
}

TEST_F(Client, TellsParallelSubscriptionsApart) {
  covers({"feat_req_someipsd_109", "feat_req_someipsd_322"});
  require(required);
  for (std::uint16_t port = 1; port <= 16; ++port) {
    subscribe_to({.eventgroup = EventgroupId{1}, .udp = Endpoint{own.address, port}});
  }
  const EventgroupRequest one_more{.eventgroup = EventgroupId{1}, .udp = own_udp};
  EXPECT_EQ(machine.discovery.subscribe(requirement, one_more, machine.now).error(), SdError::table_full);
  machine.unicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.sent(), ElementsAre(testing::AllOf(HasSubstr("counter 0 initial udp 10.0.0.1:1;"),
                                                         HasSubstr("counter 15 initial udp 10.0.0.1:16"))));
  machine.events();
  machine.unicast(server, {ack(1, {}, 3, 7)});
  EXPECT_THAT(machine.events(), ElementsAre("subscribed"));
}

TEST_F(Client, TakesNoImpossibleSubscription) {
  covers({"feat_req_someip_627"});
  require(any_required);
  const auto error_of = [&](EventgroupRequest request) {
    const auto handle = machine.discovery.subscribe(requirement, request, machine.now);
    return handle ? std::nullopt : std::optional{handle.error()};
  };
  const EventgroupRequest good{.eventgroup = EventgroupId{1}, .instance = InstanceId{1}, .udp = own_udp};
  const auto changed = [&](auto change) {
    EventgroupRequest request = good;
    change(request);
    return error_of(request);
  };
  using R = EventgroupRequest;
  EXPECT_EQ(changed([](R& r) { r.instance.reset(); }), SdError::bad_argument);
  EXPECT_EQ(changed([](R& r) { r.ttl_s = 0; }), SdError::bad_argument);
  EXPECT_EQ(changed([](R& r) { r.udp->port = 0; }), SdError::bad_argument);
  EXPECT_EQ(changed([](R& r) { r.silence_timeout = 0ms; }), SdError::bad_argument);
  EXPECT_EQ(changed([](R& r) { r.udp->address = group.address; }), SdError::bad_argument);
  EXPECT_EQ(error_of(good), std::nullopt);
  require(required);
  EXPECT_EQ(changed([](R& r) { r.instance = InstanceId{1}; }),
            SdError::bad_argument);  // not the required one
  machine.discovery.release(requirement, machine.now);
  EXPECT_EQ(error_of(good), SdError::unknown_handle);
  for (const RequiredService& impossible :
       {RequiredService{.service = ServiceId{0xffff}}, RequiredService{.service = ServiceId{0}},
        RequiredService{.service = ServiceId{1}, .instance = InstanceId{0}}}) {
    EXPECT_EQ(machine.discovery.require(impossible, machine.now).error(), SdError::bad_argument);
  }
}

}  // namespace
}  // namespace trestle::sd::client_subscription_test
