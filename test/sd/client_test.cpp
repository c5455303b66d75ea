// ServiceDiscovery as a client, in virtual time, with peers made by hand.
#include <gmock/gmock.h>

#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/machine.hpp"

namespace trestle::sd {
namespace {
using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr Endpoint server_sd{IpAddress::v4(10, 0, 0, 2), 30490};
constexpr Endpoint server_udp{IpAddress::v4(10, 0, 0, 2), 30509};
constexpr Endpoint server_tcp{IpAddress::v4(10, 0, 0, 2), 30510};
constexpr Endpoint own_udp{IpAddress::v4(10, 0, 0, 1), 40000};
constexpr Endpoint own_tcp{IpAddress::v4(10, 0, 0, 1), 41000};
constexpr RequiredService required{.service = ServiceId{0x1234}, .instance = InstanceId{0x5678}, .major = 1};
constexpr RequiredService any_required{.service = ServiceId{0x1234}};

class Client : public testing::Test {
 protected:
  void require(const RequiredService& service) {
    const auto handle = machine.discovery.require(service, machine.now);
    ASSERT_TRUE(handle);
    requirement = *handle;
  }
  SubscriptionHandle subscribe_to(const EventgroupRequest& request) {
    const auto handle = machine.discovery.subscribe(requirement, request, machine.now);
    EXPECT_TRUE(handle);
    return handle.value_or(SubscriptionHandle{});
  }
  // A machine that is subscribed to eventgroup 1, at 200 ms, with nothing left to send or tell.
  SubscriptionHandle subscribed() {
    require(required);
    const SubscriptionHandle subscription = subscribe_to({.eventgroup = EventgroupId{1}, .udp = own_udp});
    machine.run_to(195ms);
    machine.multicast(server, {offer({udp(server_udp)})});
    machine.run_to(200ms);
    machine.unicast(server, {ack(1)});
    EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("available"), "subscribed"));
    return subscription;
  }

  Machine<> machine;
  FakePeer server{server_sd};
  RequirementHandle requirement;
};

TEST_F(Client, LooksForAServiceInTwoPhases) {
  covers({"feat_req_someipsd_18", "feat_req_someipsd_72", "feat_req_someipsd_812", "feat_req_someipsd_866",
          "feat_req_someipsd_877", "feat_req_someipcompat_1197", "feat_req_someipcompat_802"});
  require(required);
  EXPECT_THAT(machine.run_to(1h),
              ElementsAre("10ms -> 224.244.224.245:30490 s1 reboot: find 1234.5678 v1.* ttl 3",
                          "40ms -> 224.244.224.245:30490 s2 reboot: find 1234.5678 v1.* ttl 3",
                          "100ms -> 224.244.224.245:30490 s3 reboot: find 1234.5678 v1.* ttl 3"));
}

TEST_F(Client, WritesItsFindByteForByte) {
  covers({"feat_req_someipsd_26", "feat_req_someipsd_239", "feat_req_someipcompat_802",
          "feat_req_someipsd_946"});
  require(any_required);
  machine.now += 10ms;
  machine.discovery.on_time(machine.now);
  std::array<std::byte, 1400> room{};
  const auto transmit = machine.discovery.poll_transmit(room, machine.now);
  ASSERT_TRUE(transmit);
  EXPECT_EQ(to_hex(transmit->bytes), to_hex(hex("ffff8100 00000024 00000001 01010200 e0000000 00000010"
                                                "00000000 1234ffff ff000003 ffffffff 00000000")));
}

TEST_F(Client, StopsLookingWhenTheServiceIsOffered) {
  covers({"feat_req_someipsd_14", "feat_req_someipsd_238", "feat_req_someipsd_867", "feat_req_someipsd_779",
          "feat_req_someipsd_752"});
  require(required);
  EXPECT_THAT(machine.run_to(30ms), SizeIs(1));
  machine.multicast(server, {offer({udp(server_udp), tcp(server_tcp)})});
  EXPECT_THAT(machine.events(), ElementsAre("available 1234.5678 v1.0 udp 10.0.0.2:30509 tcp 10.0.0.2:30510 "
                                            "at 10.0.0.2:30490"));
  EXPECT_THAT(machine.run_to(3s), IsEmpty());
  machine.multicast(server, {offer({udp(server_udp), tcp(server_tcp)})});
  EXPECT_THAT(machine.events(), IsEmpty());  // nothing new
}

TEST_F(Client, SendsOneFindThoughAnInstanceIsKnown) {
  covers({"feat_req_someipsd_239", "feat_req_someip_636", "feat_req_someip_1079"});
  require(any_required);
  machine.multicast(server, {offer({udp(server_udp)}), offer({udp(server_udp)}, 3, 0x1234, 0x5679)});
  EXPECT_THAT(machine.run_to(1s),
              ElementsAre("10ms -> 224.244.224.245:30490 s1 reboot: find 1234.ffff v*.* ttl 3"));
  EXPECT_THAT(machine.events(),
              ElementsAre(HasSubstr("available 1234.5678"), HasSubstr("available 1234.5679")));
}

TEST_F(Client, KnowsWhatWasOfferedBeforeItAsks) {
  covers({"feat_req_someipsd_17", "feat_req_someipsd_238"});
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.events(), IsEmpty());
  require(required);
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("available 1234.5678")));
  EXPECT_THAT(machine.run_to(2s), IsEmpty());
}

TEST_F(Client, MatchesVersions) {
  covers({"feat_req_someipcompat_804"});
  require({.service = ServiceId{0x1234}, .major = 2});
  require({.service = ServiceId{0x1234}, .minor = 1});
  require({.service = ServiceId{0x1234}, .instance = InstanceId{1}});
  machine.multicast(server, {offer({udp(server_udp)})});  // 1234.5678 version 1.0
  EXPECT_THAT(machine.events(), IsEmpty());
  require({.service = ServiceId{0x1234}, .minor = 0});
  EXPECT_THAT(machine.events(), SizeIs(1));
}

TEST_F(Client, AsksForEveryMinorVersionAndComparesItself) {
  covers({"feat_req_someipcompat_1197"});
  require({.service = ServiceId{0x1234}, .major = 1, .minor = 3});
  EXPECT_THAT(machine.run_to(10ms),
              ElementsAre("10ms -> 224.244.224.245:30490 s1 reboot: find 1234.ffff v1.* ttl 3"));
}

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

struct BadOffer {
  const char* why;
  FakePeer::Said said;
};

TEST_F(Client, IgnoresOffersThatCannotBe) {
  covers({"feat_req_someipsd_102", "feat_req_someipsd_681", "feat_req_someipsd_1135",
          "feat_req_someipsd_1145", "feat_req_someipsd_1164", "feat_req_someipsd_1233"});
  require(any_required);
  for (const auto& [why, said] : {
           BadOffer{"no endpoint", offer({})},
           BadOffer{"two UDP ports", offer({udp(server_udp), udp({server_udp.address, 1})})},
           BadOffer{"port 0", offer({udp({server_udp.address, 0})})},
           BadOffer{"our own address", offer({udp(own_udp)})},
           BadOffer{"loopback", offer({udp({IpAddress::v4(127, 0, 0, 1), 30509})})},
           BadOffer{"multicast address", offer({udp({group.address, 30509})})},
           BadOffer{"every instance", offer({udp(server_udp)}, 3, 0x1234, 0xffff)},
       }) {
    machine.multicast(server, {said});
    EXPECT_THAT(machine.events(), IsEmpty()) << why;
  }
  EXPECT_EQ(machine.discovery.counters().ignored_bad_options, 7U);
}

TEST(ClientInASubnet, ChecksItOnlyWhenTold) {
  covers({"feat_req_someipsd_1135", "feat_req_someipsd_1149"});
  for (const bool check : {false, true}) {
    Settings settings = fixed_settings();
    if (check) {
      settings.subnet_prefix_bits = 24;
    }
    Machine<> machine{settings};
    FakePeer server{server_sd};
    ASSERT_TRUE(machine.discovery.require(any_required, machine.now));
    machine.multicast(server, {offer({udp({IpAddress::v4(10, 0, 1, 2), 30509})})});
    EXPECT_THAT(machine.events(), SizeIs(check ? 0 : 1));
    machine.multicast(server, {offer({udp({IpAddress::v4(10, 0, 0, 255), 30509})}, 3, 0x1234, 1)});
    EXPECT_THAT(machine.events(), SizeIs(check ? 0 : 1));
    machine.multicast(server, {offer({udp(server_udp)}, 3, 0x1234, 2)});
    EXPECT_THAT(machine.events(), SizeIs(1));
    FakePeer far{{IpAddress::v4(10, 0, 1, 2), 30490}};
    machine.multicast(far, {offer({udp(server_udp)}, 3, 0x1234, 3)});
    EXPECT_THAT(machine.events(), SizeIs(check ? 0 : 1));
    EXPECT_EQ(machine.discovery.counters().dropped_source, check ? 1U : 0U);
  }
}

TEST(ClientOnLoopback, HearsOtherLoopbackAddresses) {
  Settings settings = fixed_settings();
  settings.unicast = {IpAddress::v4(127, 0, 0, 1), 30490};
  Machine<> machine{settings};
  FakePeer server{{IpAddress::v4(127, 0, 0, 2), 30490}};
  ASSERT_TRUE(machine.discovery.require(any_required, machine.now));
  machine.multicast(server, {offer({udp({IpAddress::v4(127, 0, 0, 2), 30509})})});
  EXPECT_THAT(machine.events(), SizeIs(1));
}

TEST_F(Client, IgnoresWhatItSentItself) {
  require(any_required);
  FakePeer self{own};
  machine.multicast(self, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.events(), IsEmpty());
  EXPECT_EQ(machine.discovery.counters().dropped_own, 1U);
}

TEST_F(Client, LosesAServiceWithItsTtlAndLooksAgain) {
  covers({"feat_req_someipsd_253", "feat_req_someipsd_630"});
  require(required);
  machine.multicast(server, {offer({udp(server_udp)})});
  machine.run_to(2999ms);
  EXPECT_THAT(machine.events(), SizeIs(1));
  EXPECT_THAT(machine.run_to(3010ms),
              ElementsAre(HasSubstr("3010ms -> 224.244.224.245:30490 s1 reboot: find")));
  EXPECT_THAT(machine.events(), ElementsAre("lost 1234.5678 v1 expired"));
}

TEST_F(Client, DoesNotLookAgainWhileAnotherInstanceIsThere) {
  require(any_required);
  machine.multicast(server, {offer({udp(server_udp)}, 1, 0x1234, 1), offer({udp(server_udp)}, 9, 0x1234, 2)});
  EXPECT_THAT(machine.run_to(500ms), SizeIs(1));
  EXPECT_THAT(machine.run_to(8s), IsEmpty());
  EXPECT_THAT(machine.events(),
              ElementsAre(HasSubstr("1234.0001"), HasSubstr("1234.0002"), "lost 1234.0001 v1 expired"));
  EXPECT_THAT(machine.run_to(9100ms),
              ElementsAre(HasSubstr("9010ms"), HasSubstr("9040ms"), HasSubstr("9100ms")));
}

TEST_F(Client, KeepsAnEndlessOffer) {
  covers({"feat_req_someipsd_253"});
  require(required);
  machine.multicast(server, {offer({udp(server_udp)}, infinite_ttl_s)});
  machine.events();
  machine.run_to(1000h);
  EXPECT_THAT(machine.events(), IsEmpty());
}

TEST_F(Client, WaitsInSilenceAfterAStopOffer) {
  covers({"feat_req_someipsd_261", "feat_req_someipsd_831", "feat_req_someipsd_834"});
  subscribed();
  machine.multicast(server, {offer({udp(server_udp)}, 0)});
  EXPECT_THAT(machine.events(), ElementsAre("subscription lost stopped", "lost 1234.5678 v1 stopped"));
  EXPECT_THAT(machine.run_to(1h), IsEmpty());
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.events(), SizeIs(1));
  EXPECT_THAT(machine.run_to(1h + 5ms),
              ElementsAre(HasSubstr("subscribe 1234.5678 v1 group 0001 ttl 3 counter 0 initial")));
}

TEST_F(Client, BelievesAStopOfferOnlyOfTheServerItself) {
  require(required);
  machine.multicast(server, {offer({udp(server_udp)})});
  machine.events();
  FakePeer liar{{IpAddress::v4(10, 0, 0, 3), 30490}};
  machine.multicast(liar, {offer({udp(server_udp)}, 0)});
  machine.multicast(liar, {offer({udp({IpAddress::v4(10, 0, 0, 3), 30509})})});
  EXPECT_THAT(machine.events(), IsEmpty());
  EXPECT_EQ(machine.discovery.counters().ignored_conflicting_offer, 1U);
}

TEST_F(Client, TakesChangedEndpointsForANewService) {
  covers({"feat_req_someipsd_778"});
  require(required);
  machine.multicast(server, {offer({udp(server_udp)})});
  machine.events();
  machine.multicast(server, {offer({udp({server_udp.address, 30600})})});
  EXPECT_THAT(machine.events(), ElementsAre("lost 1234.5678 v1 replaced", HasSubstr("udp 10.0.0.2:30600")));
  EXPECT_THAT(machine.run_to(1s), IsEmpty());  // no Find for it
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

// pysomeip drops a message with the request for initial events, which is a reserved bit to it: the second try
// has to do without.
TEST_F(Client, AsksForInitialEventsInTheOldWayWhenTheFlagIsNotAnswered) {
  covers({"feat_req_someipsd_844", "feat_req_someipsd_1191"});
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

TEST_F(Client, SubscribesAnewAfterASilenceOfItsEvents) {
  covers({"feat_req_someipsd_439", "feat_req_someipsd_691"});
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
  server.reboot();
  machine.multicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.events(), ElementsAre("subscription lost rebooted", "lost 1234.5678 v1 rebooted",
                                            HasSubstr("available 1234.5678")));
  EXPECT_THAT(machine.run_to(300ms),
              ElementsAre("205ms -> 10.0.0.2:30490 s2 reboot: "
                          "stop_subscribe 1234.5678 v1 group 0001 ttl 0 counter 0 udp 10.0.0.1:40000; "
                          "subscribe 1234.5678 v1 group 0001 ttl 3 counter 0 udp 10.0.0.1:40000"));
  machine.unicast(server, {ack(1)});  // the first of its unicast sessions: the same reboot
  EXPECT_THAT(machine.events(), ElementsAre("subscribed"));
}

TEST_F(Client, LooksAgainForWhatARebootedServerNoLongerOffers) {
  covers({"feat_req_someipsd_871"});
  subscribed();
  server.reboot();
  machine.multicast(server, {find(0x9999)});
  EXPECT_THAT(machine.events(), ElementsAre("subscription lost rebooted", "lost 1234.5678 v1 rebooted"));
  EXPECT_THAT(machine.run_to(300ms), ElementsAre(HasSubstr("210ms -> 224.244.224.245:30490 s4 reboot: find"),
                                                 HasSubstr("240ms"), HasSubstr("300ms")));
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
  covers(
      {"feat_req_someipsd_332", "feat_req_someipsd_333", "feat_req_someipsd_433", "feat_req_someipsd_1177"});
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

TEST_F(Client, StartsAnewWhenTheLinkComesBack) {
  covers({"feat_req_someipsd_23", "feat_req_someipsd_440"});
  subscribed();
  machine.discovery.link_down();
  EXPECT_THAT(machine.events(), ElementsAre("subscription lost link down", "lost 1234.5678 v1 link down"));
  EXPECT_THAT(machine.run_to(1s), IsEmpty());
  machine.discovery.link_up(machine.now);
  EXPECT_THAT(machine.run_to(1010ms),
              ElementsAre(HasSubstr("1010ms -> 224.244.224.245:30490 s4 reboot: find")));
}

TEST_F(Client, ShutsDownBothSides) {
  covers({"feat_req_someipsd_821"});
  subscribed();
  ASSERT_TRUE(machine.discovery.offer(
      {.service = ServiceId{0x4711}, .instance = InstanceId{1}, .udp = own_udp}, machine.now));
  machine.run_to(250ms);
  machine.discovery.shutdown(machine.now);
  EXPECT_THAT(
      machine.sent(),
      ElementsAre("250ms -> 10.0.0.2:30490 s2 reboot: stop_subscribe 1234.5678 v1 group 0001 ttl 0 counter 0 "
                  "udp 10.0.0.1:40000",
                  "250ms -> 224.244.224.245:30490 s6 reboot: stop_offer 4711.0001 v1.0 ttl 0 "
                  "udp 10.0.0.1:40000"));
  EXPECT_FALSE(machine.discovery.deadline());
  machine.unicast(server, {offer({udp(server_udp)})});
  EXPECT_THAT(machine.sent(), IsEmpty());
  EXPECT_THAT(machine.events(), IsEmpty());
}

TEST_F(Client, WrapsItsSessionAndThenClearsTheRebootFlag) {
  covers({"feat_req_someipsd_26", "feat_req_someipsd_41", "feat_req_someipsd_765"});
  require(required);
  for (unsigned i = 0; i < 0xffff; ++i) {
    // Nothing we have: a Nack each time, by unicast.
    machine.unicast(server, {subscribe(1, {udp(server_udp)})});
    const auto sent = machine.sent();
    ASSERT_THAT(sent, SizeIs(1));
    if (i == 0 || i == 0xfffe) {
      EXPECT_THAT(sent.front(), HasSubstr(i == 0 ? " s1 reboot: " : " s65535 reboot: "));
    }
  }
  machine.unicast(server, {subscribe(1, {udp(server_udp)})});
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr(" s1: nack")));
  // Multicast counts for itself.
  EXPECT_THAT(machine.run_to(10ms), ElementsAre(HasSubstr(" s1 reboot: find")));
}

}  // namespace
}  // namespace trestle::sd
