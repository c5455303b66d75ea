// ServiceDiscovery as a server that offers, in virtual time, with peers made by hand.
#include <gmock/gmock.h>

#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/server_fixture.hpp"

namespace trestle::sd::server_test {
namespace {
using namespace test;
using testing::ElementsAre;
using testing::IsEmpty;

TEST_F(Server, OffersInItsThreePhases) {
  covers({"feat_req_someipsd_22", "feat_req_someipsd_72", "feat_req_someipsd_252", "feat_req_someipsd_429",
          "feat_req_someipsd_681", "feat_req_someipsd_811", "feat_req_someipsd_41", "feat_req_someipsd_1187",
          "feat_req_someipsd_87"});
  ASSERT_TRUE(machine.discovery.offer(udp_service, machine.now));
  EXPECT_THAT(
      machine.run_to(2200ms),
      ElementsAre(
          "10ms -> 224.244.224.245:30490 s1 reboot: offer 1234.5678 v1.7 ttl 3 udp 10.0.0.1:30509",
          "40ms -> 224.244.224.245:30490 s2 reboot: offer 1234.5678 v1.7 ttl 3 udp 10.0.0.1:30509",
          "100ms -> 224.244.224.245:30490 s3 reboot: offer 1234.5678 v1.7 ttl 3 udp 10.0.0.1:30509",
          "1100ms -> 224.244.224.245:30490 s4 reboot: offer 1234.5678 v1.7 ttl 3 udp 10.0.0.1:30509",
          "2100ms -> 224.244.224.245:30490 s5 reboot: offer 1234.5678 v1.7 ttl 3 udp 10.0.0.1:30509"));
}

TEST_F(Server, WritesItsOfferByteForByte) {
  covers({"feat_req_someipsd_26", "feat_req_someipsd_100", "feat_req_someipsd_253", "feat_req_someipsd_756",
          "feat_req_someipsd_849", "feat_req_someipsd_87", "feat_req_someipsd_780", "feat_req_someipsd_1180",
          "feat_req_someipsd_946", "feat_req_someipsd_502"});
  ASSERT_TRUE(machine.discovery.offer(tcp_service, machine.now));
  machine.now += 10ms;
  machine.discovery.on_time(machine.now);
  std::array<std::byte, 1400> room{};
  const auto transmit = machine.discovery.poll_transmit(room, machine.now);
  ASSERT_TRUE(transmit);
  EXPECT_EQ(transmit->destination, group);
  EXPECT_EQ(to_hex(transmit->bytes), to_hex(hex("ffff8100 0000003c 00000001 01010200 e0000000 00000010"
                                                "01000020 12345678 01000003 00000000 00000018"
                                                "000904000a0000010011772d 000904000a0000010006772e")));
}

TEST_F(Server, PacksOffersThatStartTogether) {
  covers({"feat_req_someipsd_65", "feat_req_someipsd_836", "feat_req_someipsd_900"});
  OfferedService second = udp_service;
  second.instance = InstanceId{0x5679};
  ASSERT_TRUE(machine.discovery.offer(udp_service, machine.now));
  ASSERT_TRUE(machine.discovery.offer(second, machine.now));
  ASSERT_TRUE(machine.discovery.require({.service = ServiceId{0x4711}}, machine.now));
  EXPECT_THAT(machine.run_to(39ms),
              ElementsAre("10ms -> 224.244.224.245:30490 s1 reboot: "
                          "offer 1234.5678 v1.7 ttl 3 udp 10.0.0.1:30509; "
                          "offer 1234.5679 v1.7 ttl 3 udp 10.0.0.1:30509; find 4711.ffff v*.* ttl 3"));
}

TEST(ServerWithRandomDelays, StartsItsOffersWithinTheBounds) {
  covers({"feat_req_someipsd_63", "feat_req_someipsd_64", "feat_req_someipsd_65"});
  std::array<int, 9> drawn{};  // of ten milliseconds each
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    Settings settings = fixed_settings();
    settings.timing.initial_delay_min = 10ms;
    settings.timing.initial_delay_max = 100ms;
    settings.seed = seed;
    Machine<> machine{settings};
    ASSERT_TRUE(machine.discovery.offer(udp_service, machine.now));
    const TimePoint first = *machine.discovery.deadline();
    EXPECT_GE(first, start + 10ms);
    EXPECT_LE(first, start + 100ms);
    ++drawn.at(static_cast<std::size_t>((first - start - 10ms) / 10ms) % drawn.size());
    // Another one a millisecond later joins, unless that would make its own wait too short.
    OfferedService second = udp_service;
    second.instance = InstanceId{2};
    ASSERT_TRUE(machine.discovery.offer(second, start + 1ms));
    const auto sent = machine.run_to(*machine.discovery.deadline() - start);
    ASSERT_THAT(sent, testing::SizeIs(1));
    EXPECT_EQ(
        sent.front().find("5678") != std::string::npos && sent.front().find("1234.0002") != std::string::npos,
        first >= start + 11ms)
        << seed;
  }
  EXPECT_THAT(drawn, testing::Each(testing::Ge(1)));  // any of them
}

// Whichever comes first, and whatever delay it has drawn.
TEST(ServerWithRandomDelays, SharesTheDelayOfAFindThatWaits) {
  covers({"feat_req_someipsd_65", "feat_req_someipsd_836"});
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Settings settings = fixed_settings();
    settings.timing.initial_delay_min = 10ms;
    settings.timing.initial_delay_max = 900ms;
    settings.seed = seed;
    for (const bool find_first : {true, false}) {
      Machine<> machine{settings};
      const auto look = [&] {
        EXPECT_TRUE(machine.discovery.require({.service = ServiceId{0x4711}}, machine.now));
      };
      const auto give = [&] { EXPECT_TRUE(machine.discovery.offer(udp_service, machine.now)); };
      find_first ? look() : give();
      find_first ? give() : look();
      const auto sent = machine.run_to(900ms);
      ASSERT_FALSE(sent.empty());
      EXPECT_THAT(sent[0], testing::EndsWith("offer 1234.5678 v1.7 ttl 3 udp 10.0.0.1:30509; "
                                             "find 4711.ffff v*.* ttl 3"));
    }
  }
}

TEST_F(Server, SpreadsEntriesOverDatagramsOfTheGivenSize) {
  covers({"feat_req_someipsd_836"});
  machine.room_bytes = 28 + 2 * 16 + 12 + 4;  // two entries that share an option
  for (std::uint16_t instance = 1; instance <= 5; ++instance) {
    OfferedService service = udp_service;
    service.instance = InstanceId{instance};
    ASSERT_TRUE(machine.discovery.offer(service, machine.now));
  }
  const auto sent = machine.run_to(10ms);
  ASSERT_THAT(sent, testing::SizeIs(3));
  EXPECT_THAT(sent[0], testing::HasSubstr(
                           "s1 reboot: offer 1234.0001 v1.7 ttl 3 udp 10.0.0.1:30509; offer 1234.0002"));
  EXPECT_THAT(sent[2], testing::EndsWith("s3 reboot: offer 1234.0005 v1.7 ttl 3 udp 10.0.0.1:30509"));
}

TEST_F(Server, AnswersAFindByUnicastAfterTheDelayForMulticast) {
  covers({"feat_req_someipsd_83", "feat_req_someipsd_824", "feat_req_someipsd_811"});
  offer(udp_service);
  machine.multicast(client, {find(0x1234)});
  EXPECT_THAT(machine.sent(), IsEmpty());
  EXPECT_THAT(
      machine.run_to(300ms),
      ElementsAre("205ms -> 10.0.0.2:30490 s1 reboot: offer 1234.5678 v1.7 ttl 3 udp 10.0.0.1:30509"));
}

TEST(ServerWithRandomDelays, AnswersFindsByMulticastWithinTheBounds) {
  covers({"feat_req_someipsd_83", "feat_req_someipsd_84", "feat_req_someipsd_85"});
  std::array<int, 7> drawn{};  // of a millisecond each
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Settings settings = fixed_settings();
    settings.timing.request_response_delay_min = 2ms;
    settings.timing.request_response_delay_max = 9ms;
    settings.seed = seed;
    Machine<> machine{settings};
    FakePeer client{test::client_sd};
    ASSERT_TRUE(machine.discovery.offer(udp_service, machine.now));
    machine.run_to(200ms);
    machine.multicast(client, {find(0x1234)});
    const TimePoint due = *machine.discovery.deadline();
    ASSERT_GE(due, start + 202ms);
    ASSERT_LE(due, start + 209ms);
    EXPECT_THAT(machine.run_to(due - start - 1ns), IsEmpty());
    EXPECT_THAT(machine.run_to(due - start),
                ElementsAre(testing::HasSubstr("-> 10.0.0.2:30490 s1 reboot: offer")));
    ++drawn.at(static_cast<std::size_t>((due - start - 202ms) / 1ms) % drawn.size());
  }
  EXPECT_THAT(drawn, testing::Each(testing::Ge(1)));  // any of them
}

TEST_F(Server, AnswersAUnicastFindAtOnce) {
  covers({"feat_req_someipsd_624", "feat_req_someipsd_765"});
  offer(udp_service);
  machine.unicast(client, {find(0x1234, 0x5678, 1, 7)});
  EXPECT_THAT(
      machine.sent(),
      ElementsAre("200ms -> 10.0.0.2:30490 s1 reboot: offer 1234.5678 v1.7 ttl 3 udp 10.0.0.1:30509"));
}

TEST_F(Server, AnswersOnlyFindsThatFit) {
  covers({"feat_req_someipsd_239", "feat_req_someipsd_106", "feat_req_someip_538", "feat_req_someip_542"});
  offer(udp_service);
  FakePeer::Said stopped = find(0x1234);
  stopped.entry.ttl_s = 0;
  machine.unicast(client, {find(0x1235), find(0x1234, 0x5679), find(0x1234, 0x5678, 2),
                           find(0x1234, 0x5678, 1, 8), stopped});
  EXPECT_THAT(machine.sent(), IsEmpty());
}

TEST_F(Server, AnswersAFindThatHasOptionsOfItsOwn) {
  covers({"feat_req_someipsd_879"});
  offer(udp_service);
  // The Find references a configuration, "a=b".
  machine.receive(hex("ffff8100 0000002d 00000001 01010200 c0000000 00000010"
                      "00000010 1234ffff ff000003 ffffffff 00000009 000601 00 03613d6200"),
                  client_sd, false);
  EXPECT_THAT(
      machine.sent(),
      ElementsAre("200ms -> 10.0.0.2:30490 s1 reboot: offer 1234.5678 v1.7 ttl 3 udp 10.0.0.1:30509"));
}

TEST_F(Server, OffersEachMajorVersionOfAnInstanceForItself) {
  covers({"feat_req_someipcompat_714", "feat_req_someipcompat_800", "feat_req_someipcompat_803",
          "feat_req_someipcompat_804"});
  OfferedService next = udp_service;
  next.major = 2;
  next.udp = Endpoint{own.address, 30511};
  ASSERT_TRUE(machine.discovery.offer(udp_service, machine.now));
  const auto second = machine.discovery.offer(next, machine.now);
  ASSERT_TRUE(second);
  EXPECT_THAT(machine.run_to(39ms), ElementsAre("10ms -> 224.244.224.245:30490 s1 reboot: "
                                                "offer 1234.5678 v1.7 ttl 3 udp 10.0.0.1:30509; "
                                                "offer 1234.5678 v2.7 ttl 3 udp 10.0.0.1:30511"));
  FakePeer::Said to_second = subscribe(1, {udp(client_udp)});
  to_second.entry.major = 2;
  machine.unicast(client, {to_second});
  EXPECT_THAT(machine.sent(),
              ElementsAre("39ms -> 10.0.0.2:30490 s1 reboot: ack 1234.5678 v2 group 0001 ttl 3 counter 0"));
  int subscribers = 0;
  machine.discovery.for_each_subscriber(*second, EventgroupId{1}, [&](const Subscriber&) { ++subscribers; });
  EXPECT_EQ(subscribers, 1);
  machine.discovery.stop_offer(*second, machine.now);
  EXPECT_THAT(machine.sent(), ElementsAre("39ms -> 224.244.224.245:30490 s2 reboot: "
                                          "stop_offer 1234.5678 v2.7 ttl 0 udp 10.0.0.1:30511"));
}

TEST_F(Server, AnswersOneFindOnceThoughItIsAskedTwice) {
  offer(udp_service);
  machine.multicast(client, {find(0x1234), find(0x1234, 0x5678)});
  EXPECT_THAT(
      machine.run_to(300ms),
      ElementsAre("205ms -> 10.0.0.2:30490 s1 reboot: offer 1234.5678 v1.7 ttl 3 udp 10.0.0.1:30509"));
}

TEST_F(Server, IgnoresEndpointOptionsOfAFind) {
  covers({"feat_req_someipsd_878", "feat_req_someipsd_106"});
  offer(udp_service);
  FakePeer::Said said = find(0x1234);
  said.options = {udp({IpAddress::v4(1, 2, 3, 4), 0})};
  machine.unicast(client, {said});
  EXPECT_THAT(machine.sent(), testing::SizeIs(1));
}

TEST_F(Server, DoesNotAnswerInTheInitialWaitPhase) {
  ASSERT_TRUE(machine.discovery.offer(udp_service, machine.now));
  machine.unicast(client, {find(0x1234)});
  EXPECT_THAT(machine.sent(), IsEmpty());
}

TEST(OptimisedServer, AnswersByMulticastWhenTheLastOfferIsOld) {
  covers({"feat_req_someipsd_89", "feat_req_someipsd_90", "feat_req_someipsd_91"});
  Settings settings = fixed_settings();
  settings.find_answer = FindAnswer::optimised;
  Machine<> machine{settings};
  FakePeer client{client_sd};
  FakePeer deaf{client_sd, 0};
  ASSERT_TRUE(machine.discovery.offer(udp_service, machine.now));
  machine.run_to(590ms);  // the last offer came at 100 ms, half a cycle is over at 600 ms
  machine.unicast(client, {find(0x1234)});
  EXPECT_THAT(machine.sent(), ElementsAre(testing::StartsWith("590ms -> 10.0.0.2:30490")));
  machine.unicast(deaf, {find(0x1234)});
  EXPECT_THAT(machine.sent(), ElementsAre(testing::StartsWith("590ms -> 224.244.224.245:30490")));
  machine.run_to(600ms);
  FakePeer other{{IpAddress::v4(10, 0, 0, 3), 30490}};
  machine.unicast(other, {find(0x1234)});
  EXPECT_THAT(machine.sent(), ElementsAre(testing::StartsWith("600ms -> 224.244.224.245:30490")));
}

TEST_F(Server, StopsAnOffer) {
  covers({"feat_req_someipsd_261", "feat_req_someipsd_262", "feat_req_someipsd_820", "feat_req_someipsd_830",
          "feat_req_someipsd_22", "feat_req_someipsd_625"});
  offer(udp_service);
  machine.unicast(client, {subscribe(1, {udp(client_udp)})});
  machine.sent();
  machine.events();
  machine.multicast(client, {find(0x1234)});  // its answer would be due in 5 ms
  machine.discovery.stop_offer(offered, machine.now);
  EXPECT_THAT(machine.run_to(1h), ElementsAre("200ms -> 224.244.224.245:30490 s4 reboot: "
                                              "stop_offer 1234.5678 v1.7 ttl 0 udp 10.0.0.1:30509"));
  EXPECT_THAT(machine.events(), IsEmpty());
  machine.discovery.for_each_subscriber(offered, EventgroupId{1}, [](const Subscriber&) { FAIL(); });
  machine.unicast(client, {subscribe(1, {udp(client_udp)})});
  EXPECT_THAT(machine.sent(), ElementsAre(testing::HasSubstr("nack")));
  machine.discovery.stop_offer(offered, machine.now);  // an ended handle does nothing
  EXPECT_THAT(machine.sent(), IsEmpty());
}

// Neither the Ack nor the Nack that is on its way, but the answers about another instance.
TEST_F(Server, AnswersNoSubscriptionBehindAStopOffer) {
  covers({"feat_req_someipsd_261", "feat_req_someipsd_625"});
  offer(udp_service);
  OfferedService second = udp_service;
  second.instance = InstanceId{0x5679};
  ASSERT_TRUE(machine.discovery.offer(second, machine.now));
  machine.run_to(400ms);
  FakePeer::Said to_second = subscribe(1, {udp(client_udp)});
  to_second.entry.instance = InstanceId{0x5679};
  machine.unicast(client, {subscribe(1, {udp(client_udp)}), subscribe(1, {}), to_second});
  machine.discovery.stop_offer(offered, machine.now);
  EXPECT_THAT(machine.sent(),
              ElementsAre("400ms -> 10.0.0.2:30490 s1 reboot: ack 1234.5679 v1 group 0001 ttl 3 counter 0",
                          testing::EndsWith("stop_offer 1234.5678 v1.7 ttl 0 udp 10.0.0.1:30509")));
}

TEST_F(Server, TakesNoImpossibleOffer) {
  covers({"feat_req_someip_579", "feat_req_someip_627", "feat_req_someipids_505", "feat_req_someipids_529",
          "feat_req_someipids_555", "feat_req_someipcompat_800"});
  const auto error_of = [&](auto change) {
    OfferedService service = udp_service;
    change(service);
    const auto handle = machine.discovery.offer(service, machine.now);
    return handle ? std::nullopt : std::optional{handle.error()};
  };
  using S = OfferedService;
  EXPECT_EQ(error_of([](S& s) { s.service = ServiceId{0xffff}; }), SdError::bad_argument);
  EXPECT_EQ(error_of([](S& s) { s.service = ServiceId{0}; }), SdError::bad_argument);
  EXPECT_EQ(error_of([](S& s) { s.instance = someip::any_instance; }), SdError::bad_argument);
  EXPECT_EQ(error_of([](S& s) { s.instance = InstanceId{0}; }), SdError::bad_argument);
  for (const std::uint16_t reserved : {std::uint16_t{0}, std::uint16_t{0xffff}}) {
    const std::array bad{Eventgroup{.id = EventgroupId{reserved}}};
    EXPECT_EQ(error_of([&](S& s) { s.eventgroups = bad; }), SdError::bad_argument);
  }
  EXPECT_EQ(error_of([](S& s) { s.major = any_major; }), SdError::bad_argument);
  EXPECT_EQ(error_of([](S& s) { s.udp.reset(); }), SdError::bad_argument);
  EXPECT_EQ(error_of([](S& s) { s.udp->port = 0; }), SdError::bad_argument);
  EXPECT_EQ(error_of([](S& s) { s.udp->address = group.address; }), SdError::bad_argument);
  EXPECT_EQ(error_of([](S& s) { s.ttl_s = 0; }), SdError::bad_argument);
  EXPECT_EQ(error_of([](S& s) { s.ttl_s = 0x1000000; }), SdError::bad_argument);
  const std::array needs_tcp{Eventgroup{.id = EventgroupId{1}, .tcp = true}};
  EXPECT_EQ(error_of([&](S& s) { s.eventgroups = needs_tcp; }), SdError::bad_argument);
  const std::array no_multicast{Eventgroup{.id = EventgroupId{1}, .multicast = client_udp}};
  EXPECT_EQ(error_of([&](S& s) { s.eventgroups = no_multicast; }), SdError::bad_argument);
  const std::array twice{Eventgroup{.id = EventgroupId{1}}, Eventgroup{.id = EventgroupId{1}}};
  EXPECT_EQ(error_of([&](S& s) { s.eventgroups = twice; }), SdError::duplicate);
  EXPECT_FALSE(machine.discovery.deadline());
  EXPECT_EQ(error_of([](S&) {}), std::nullopt);
  EXPECT_EQ(error_of([](S&) {}), SdError::duplicate);
  EXPECT_EQ(error_of([](S& s) { s.major = 2; }), std::nullopt);  // another major version is another offer
}

TEST_F(Server, TriggersOffersAgainWhenTheLinkComesBack) {
  covers({"feat_req_someipsd_23", "feat_req_someipsd_436", "feat_req_someipsd_437", "feat_req_someipsd_442",
          "feat_req_someipsd_625"});
  offer(udp_service);
  machine.unicast(client, {subscribe(1, {udp(client_udp)})});
  machine.sent();
  machine.events();
  machine.discovery.link_down();
  EXPECT_THAT(machine.events(), ElementsAre("removed 0001 udp 10.0.0.2:40000 at 10.0.0.2:30490 link down"));
  EXPECT_THAT(machine.run_to(10s), IsEmpty());
  machine.unicast(client, {find(0x1234)});
  EXPECT_THAT(machine.sent(), IsEmpty());
  EXPECT_EQ(machine.discovery.counters().dropped_down, 1U);
  machine.discovery.link_up(machine.now);
  EXPECT_THAT(machine.run_to(10s + 10ms), ElementsAre("10010ms -> 224.244.224.245:30490 s4 reboot: "
                                                      "offer 1234.5678 v1.7 ttl 3 udp 10.0.0.1:30509"));
}

}  // namespace
}  // namespace trestle::sd::server_test
