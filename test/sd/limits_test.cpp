// What a ServiceDiscovery does when peers send too much, or rubbish.
#include <gmock/gmock.h>

#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/sd/machine.hpp"

namespace trestle::sd::limits_test {
namespace {
using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr Limits small{.max_offers = 3,
                       .max_eventgroups = 4,
                       .max_subscribers = 3,
                       .max_requirements = 2,
                       .max_subscriptions = 2,
                       .max_remote_services = 2,
                       .max_peers = 3,
                       .max_tcp_connections = 1,
                       .max_pending_entries = 8,
                       .max_pending_events = 4};
constexpr std::array groups{Eventgroup{.id = EventgroupId{1}}, Eventgroup{.id = EventgroupId{2}}};
constexpr OfferedService service{.service = ServiceId{0x1234},
                                 .instance = InstanceId{0x5678},
                                 .udp = Endpoint{IpAddress::v4(10, 0, 0, 1), 30509},
                                 .eventgroups = groups};

class Limited : public testing::Test {
 protected:
  Machine<small> machine;
};

TEST_F(Limited, KnowsAsManyPeersAsWereHeard) {
  EXPECT_EQ(machine.discovery.known_peers(), 0U);
  for (std::uint8_t number = 2; number < 4; ++number) {
    FakePeer peer{host(number)};
    machine.multicast(peer, {find(0x9999)});
    machine.multicast(peer, {find(0x9999)});
  }
  EXPECT_EQ(machine.discovery.known_peers(), 2U);
}

TEST_F(Limited, RefusesTheSubscriberTooMany) {
  covers({"feat_req_someipsd_1137"});
  ASSERT_TRUE(machine.discovery.offer(service, machine.now));
  FakePeer peer{host(2)};
  for (std::uint16_t port = 1; port <= 4; ++port) {
    machine.unicast(peer, {subscribe(1, {udp(host(2, port))})});
    EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr(port <= 3 ? ": ack" : ": nack"))) << port;
    machine.events();
  }
  machine.unicast(peer, {subscribe(1, {udp(host(2, 1))}, 0)});
  machine.unicast(peer, {subscribe(1, {udp(host(2, 4))})});
  EXPECT_THAT(machine.sent(), ElementsAre(HasSubstr(": ack")));
}

TEST(LimitedPerEventgroup, RefusesTheSubscriberTooMany) {
  Settings settings = fixed_settings();
  settings.max_subscribers_per_eventgroup = 1;
  Machine<> machine{settings};
  ASSERT_TRUE(machine.discovery.offer(service, machine.now));
  FakePeer peer{host(2)};
  machine.unicast(peer, {subscribe(1, {udp(host(2, 1))}), subscribe(1, {udp(host(2, 2))}),
                         subscribe(2, {udp(host(2, 1))}), subscribe(1, {udp(host(2, 1))})});
  EXPECT_THAT(machine.sent(),
              ElementsAre(testing::ContainsRegex(": ack .*0001.*; nack .*0001.*; ack .*0002.*; ack .*0001")));
}

TEST_F(Limited, CountsConfiguredSubscribersToo) {
  const auto offered = machine.discovery.offer(service, machine.now);
  ASSERT_TRUE(offered);
  for (std::uint8_t number = 2; number < 5; ++number) {
    EXPECT_TRUE(machine.discovery.add_subscriber(*offered, EventgroupId{1}, host(number)));
  }
  const auto result = machine.discovery.add_subscriber(*offered, EventgroupId{1}, host(5));
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error(), SdError::table_full);
  // They belong to no peer: peers come and go as ever.
  for (std::uint8_t number = 2; number < 20; ++number) {
    FakePeer other{host(number)};
    machine.multicast(other, {find(0x9999)});
    machine.now += 1ms;
  }
  EXPECT_THAT(machine.discovery.counters().limits_reached, testing::Each(0U));
}

TEST_F(Limited, ForgetsThePeerThatWasSilentTheLongestAndHasNothingWithUs) {
  ASSERT_TRUE(machine.discovery.offer(service, machine.now));
  FakePeer subscriber{host(2)};
  machine.unicast(subscriber, {subscribe(1, {udp(host(2, 1))})});
  machine.sent();
  machine.events();
  // Many others come and go; the subscriber is remembered, and the reboot of one that was forgotten is not
  // seen.
  for (std::uint8_t number = 3; number < 100; ++number) {
    FakePeer other{host(number)};
    machine.multicast(other, {find(0x9999)});
    machine.now += 1ms;
  }
  EXPECT_THAT(machine.discovery.counters().limits_reached, testing::Each(0U));
  subscriber.reboot();
  machine.unicast(subscriber, {find(0x9999)});
  EXPECT_THAT(machine.events(), ElementsAre("removed 0001 udp 10.0.0.2:1 at 10.0.0.2:30490 rebooted"));
}

TEST_F(Limited, KeepsAPeerThatAnAnswerIsDueFor) {
  ASSERT_TRUE(machine.discovery.offer(service, machine.now));
  machine.run_to(200ms);
  FakePeer asking{host(2)};
  machine.multicast(asking, {find(0x1234)});
  for (std::uint8_t number = 3; number < 9; ++number) {
    machine.now += 100us;
    FakePeer other{host(number)};
    machine.multicast(other, {find(0x9999)});
  }
  EXPECT_THAT(machine.run_to(300ms), ElementsAre(HasSubstr("205ms -> 10.0.0.2:30490 s1 reboot: offer")));
}

TEST_F(Limited, KeepsAPeerWhoseServiceIsKnown) {
  ASSERT_TRUE(machine.discovery.require({.service = ServiceId{0x1234}}, machine.now));
  FakePeer server{host(2)};
  machine.multicast(server, {offer({udp(host(2, 30509))})});
  machine.events();
  for (std::uint8_t number = 3; number < 9; ++number) {
    machine.now += 1ms;
    FakePeer other{host(number)};
    machine.multicast(other, {find(0x9999)});
  }
  server.reboot();
  machine.multicast(server, {find(0x9999)});
  EXPECT_THAT(machine.events(), ElementsAre("lost 1234.5678 v1 rebooted"));
}

TEST_F(Limited, PrefersRequiredServices) {
  FakePeer server{host(2)};
  const EndpointOption at = udp(host(2, 30509));
  machine.multicast(server,
                    {offer({at}, 3, 0x1111, 1), offer({at}, 3, 0x1111, 2), offer({at}, 3, 0x1111, 3)});
  EXPECT_EQ(machine.discovery.counters().ignored_no_room, 1U);
  ASSERT_TRUE(machine.discovery.require({.service = ServiceId{0x1234}}, machine.now));
  machine.multicast(server,
                    {offer({at}, 3, 0x1234, 1), offer({at}, 3, 0x1234, 2), offer({at}, 3, 0x1234, 3)});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("1234.0001"), HasSubstr("1234.0002")));
  EXPECT_EQ(machine.discovery.counters().ignored_no_room, 2U);
}

TEST_F(Limited, KeepsAnswersToAFloodOfFindsFromDelayingItsOffers) {
  ASSERT_TRUE(machine.discovery.offer(service, machine.now));
  OfferedService second = service;
  second.instance = InstanceId{1};
  ASSERT_TRUE(machine.discovery.offer(second, machine.now));
  machine.run_to(1098ms);  // the next offers are due at 1100 ms
  for (int round = 0; round < 100; ++round) {
    for (std::uint8_t number = 2; number <= 4; ++number) {
      FakePeer peer{host(number)};
      machine.multicast(peer, {find(0x1234)});
    }
  }
  EXPECT_THAT(machine.run_to(1100ms), ElementsAre(testing::ContainsRegex("1100ms -> 224.*offer .*; offer ")));
  EXPECT_THAT(machine.run_to(1103ms), SizeIs(testing::Le(3)));
  EXPECT_GT(machine.discovery.counters().ignored_no_room, 0U);
}

TEST_F(Limited, DelaysNoMoreAnswersThanHalfOfWhatItCanHold) {
  ASSERT_TRUE(machine.discovery.offer(service, machine.now));
  OfferedService second = service;
  second.instance = InstanceId{1};
  ASSERT_TRUE(machine.discovery.offer(second, machine.now));
  machine.run_to(200ms);
  const std::uint64_t before = machine.discovery.counters().entries_sent;
  for (std::uint8_t number = 2; number <= 4; ++number) {  // 3 x 2 answers; the queue holds 8
    FakePeer peer{host(number)};
    machine.multicast(peer, {find(0x1234)});
  }
  machine.run_to(300ms);
  EXPECT_EQ(machine.discovery.counters().entries_sent, before + 4);
  EXPECT_EQ(machine.discovery.counters().ignored_no_room, 2U);
}

TEST_F(Limited, SubscribesOnlyWhenAStopWouldFitToo) {
  for (const unsigned waiting : {6U, 7U}) {
    Machine<small> one;
    const auto requirement =
        one.discovery.require({.service = ServiceId{0x1234}, .instance = InstanceId{0x5678}}, one.now);
    ASSERT_TRUE(requirement);
    ASSERT_TRUE(one.discovery.subscribe(
        *requirement, {.eventgroup = EventgroupId{1}, .udp = Endpoint{own.address, 40000}}, one.now));
    FakePeer server{host(2)};
    for (unsigned i = 0; i < waiting; ++i) {
      one.unicast(server, {subscribe(9, {udp(host(2, 1))})});  // a Nack each, of the 8 that may wait
    }
    one.unicast(server, {offer({udp(host(2, 30509))})});
    EXPECT_THAT(one.sent(), ElementsAre(testing::Conditional(waiting == 6, HasSubstr("; subscribe"),
                                                             testing::Not(HasSubstr("; subscribe")))));
    EXPECT_EQ(one.discovery.counters().ignored_no_room, waiting == 6 ? 0U : 1U);
  }
}

TEST_F(Limited, ChangesNothingWhenItCouldNotTell) {
  ASSERT_TRUE(machine.discovery.offer(service, machine.now));
  FakePeer peer{host(2)};
  for (int i = 0; i < 2; ++i) {  // four events wait: added, removed, added, removed
    machine.unicast(peer, {subscribe(1, {udp(host(2, 1))}), subscribe(1, {udp(host(2, 1))}, 0)});
  }
  machine.sent();
  machine.unicast(peer, {subscribe(1, {udp(host(2, 1))})});
  EXPECT_THAT(machine.sent(), IsEmpty());
  EXPECT_EQ(machine.discovery.counters().ignored_no_room, 1U);
  EXPECT_EQ(machine.discovery.counters().lost_events, 0U);
  EXPECT_THAT(machine.events(), SizeIs(4));
  machine.unicast(peer, {subscribe(1, {udp(host(2, 1))})});
  EXPECT_THAT(machine.events(), SizeIs(1));
}

TEST_F(Limited, RefusesCallsBeyondItsTables) {
  for (std::uint16_t instance = 1; instance <= 2; ++instance) {
    OfferedService one = service;
    one.instance = InstanceId{instance};
    ASSERT_TRUE(machine.discovery.offer(one, machine.now));
  }
  OfferedService third = service;
  EXPECT_EQ(machine.discovery.offer(third, machine.now).error(), SdError::table_full);  // eventgroups
  third.eventgroups = {};
  ASSERT_TRUE(machine.discovery.offer(third, machine.now));
  third.instance = InstanceId{9};
  EXPECT_EQ(machine.discovery.offer(third, machine.now).error(), SdError::table_full);
  ASSERT_TRUE(machine.discovery.require({.service = ServiceId{1}}, machine.now));
  const auto requirement =
      machine.discovery.require({.service = ServiceId{1}, .instance = InstanceId{1}}, machine.now);
  ASSERT_TRUE(requirement);
  EXPECT_EQ(machine.discovery.require({.service = ServiceId{1}}, machine.now).error(), SdError::table_full);
  for (int i = 0; i < 3; ++i) {
    const auto subscription =
        machine.discovery.subscribe(*requirement, {.eventgroup = EventgroupId{1}}, machine.now);
    EXPECT_EQ(subscription.has_value(), i < 2);
  }
  EXPECT_TRUE(machine.discovery.tcp_connected(host(1, 1), host(2, 1)));
  EXPECT_FALSE(machine.discovery.tcp_connected(host(1, 1), host(2, 2)));
}

TEST_F(Limited, KeepsHandlesApartFromTheirSuccessors) {
  const auto first = machine.discovery.offer(service, machine.now);
  machine.discovery.stop_offer(*first, machine.now);
  const auto second = machine.discovery.offer(service, machine.now);
  EXPECT_EQ(first->index, second->index);
  EXPECT_NE(*first, *second);
  machine.discovery.stop_offer(*first, machine.now);
  EXPECT_EQ(machine.discovery.offer(service, machine.now).error(), SdError::duplicate);
}

TEST_F(Limited, ShowsNoSubscribersOfASuccessorToAnEndedHandle) {
  const auto first = machine.discovery.offer(service, machine.now);
  ASSERT_TRUE(first);
  machine.discovery.stop_offer(*first, machine.now);
  const auto second = machine.discovery.offer(service, machine.now);
  ASSERT_TRUE(second);
  FakePeer peer{host(2)};
  machine.unicast(peer, {subscribe(1, {udp(host(2, 1))})});
  int of_second = 0;
  machine.discovery.for_each_subscriber(*second, EventgroupId{1}, [&](const Subscriber&) { ++of_second; });
  EXPECT_EQ(of_second, 1);
  machine.discovery.for_each_subscriber(*first, EventgroupId{1}, [](const Subscriber&) { FAIL(); });
}

TEST_F(Limited, DropsMalformedDatagramsAndCountsThem) {
  covers({"feat_req_someipsd_1163", "feat_req_someipsd_1164", "feat_req_someipsd_1220"});
  ASSERT_TRUE(machine.discovery.offer(service, machine.now));
  const auto whole =
      hex("ffff8100 00000030 00000001 01010200 c0000000 00000010"
          "06000010 12345678 01000003 00000001 0000000c 000904000a00000200119c40");
  for (std::size_t size = 1; size < whole.size(); ++size) {
    // Once cut off with its Length as it was, once with a Length that fits.
    std::vector<std::byte> cut{whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)};
    machine.receive(cut, host(2), false);
    if (size >= 8) {
      cut[7] = static_cast<std::byte>(size - 8);
      machine.receive(cut, host(2), false);
    }
  }
  EXPECT_EQ(machine.discovery.counters().dropped_malformed, 55U + 48U);
  EXPECT_EQ(machine.discovery.counters().messages_received, 0U);
  EXPECT_THAT(machine.sent(), IsEmpty());
  EXPECT_THAT(machine.events(), IsEmpty());
  machine.receive(whole, host(2), false);
  EXPECT_THAT(machine.events(), SizeIs(1));
}

TEST_F(Limited, TakesEveryMessageOfADatagram) {
  ASSERT_TRUE(machine.discovery.offer(service, machine.now));
  FakePeer peer{host(2)};
  std::vector<std::byte> datagram = peer.unicast({subscribe(1, {udp(host(2, 1))})});
  const auto other = hex("1234 8001 00000008 0000 0001 01 01 02 00");  // some event
  const auto second = peer.unicast({subscribe(2, {udp(host(2, 1))})});
  datagram.insert(datagram.end(), other.begin(), other.end());
  datagram.insert(datagram.end(), second.begin(), second.end());
  machine.receive(datagram, host(2), false);
  EXPECT_THAT(machine.sent(), ElementsAre(testing::ContainsRegex(": ack .*0001.*; ack .*0002")));
  EXPECT_EQ(machine.discovery.counters().dropped_not_sd, 1U);
}

TEST_F(Limited, DropsWhatComesFromImpossibleSources) {
  ASSERT_TRUE(machine.discovery.offer(service, machine.now));
  FakePeer peer{host(2)};
  const auto datagram = peer.unicast({subscribe(1, {udp(host(2, 1))})});
  for (const Endpoint& from :
       {Endpoint{IpAddress::v4(224, 0, 0, 1), 30490}, Endpoint{IpAddress::v4(0, 0, 0, 0), 30490},
        Endpoint{IpAddress::v4(10, 0, 0, 2), 0}, Endpoint{own.address, 1234}}) {
    machine.receive(datagram, from, false);
  }
  EXPECT_EQ(machine.discovery.counters().dropped_source, 4U);
  EXPECT_THAT(machine.events(), IsEmpty());
}

TEST_F(Limited, SendsNothingIntoTooLittleRoom) {
  ASSERT_TRUE(machine.discovery.offer(service, machine.now));
  machine.room_bytes = 27;
  machine.discovery.on_time(start + 10ms);
  EXPECT_FALSE(machine.discovery.poll_transmit({}, start + 10ms));
  std::array<std::byte, 50> room{};
  EXPECT_FALSE(machine.discovery.poll_transmit(room, start + 10ms));  // not for an entry with its option
  EXPECT_EQ(machine.discovery.counters().unsendable_entries, 1U);
}

}  // namespace
}  // namespace trestle::sd::limits_test
