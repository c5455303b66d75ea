// More ends at once than there are places for events: nothing of it is untold.
#include <gmock/gmock.h>

#include "test/covers.hpp"
#include "test/sd/machine.hpp"

namespace trestle::sd::losses_test {
namespace {
using namespace test;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using testing::UnorderedElementsAre;

constexpr Limits few_events{.max_offers = 1,
                            .max_eventgroups = 2,
                            .max_subscribers = 8,
                            .max_requirements = 4,
                            .max_subscriptions = 4,
                            .max_remote_services = 8,
                            .max_peers = 3,
                            .max_tcp_connections = 4,
                            .max_pending_entries = 16,
                            .max_pending_events = 2};
constexpr std::array groups{Eventgroup{.id = EventgroupId{1}}, Eventgroup{.id = EventgroupId{2}}};
constexpr OfferedService service{.service = ServiceId{0x1234},
                                 .instance = InstanceId{0x5678},
                                 .udp = Endpoint{IpAddress::v4(10, 0, 0, 1), 30509},
                                 .eventgroups = groups};

class MoreLossesThanPlacesForEvents : public testing::Test {
 protected:
  // `count` subscriptions of this peer, all told of.
  void subscribe_often(FakePeer& peer, std::uint16_t count, std::uint32_t ttl_s = 3) {
    for (std::uint16_t port = 1; port <= count; ++port) {
      machine.unicast(peer, {subscribe(1, {udp({peer.endpoint().address, port})}, ttl_s)});
      ASSERT_THAT(machine.events(), ElementsAre(HasSubstr("added")));
    }
    machine.sent();
  }
  std::size_t subscribers(OfferHandle offer) const {
    std::size_t count = 0;
    machine.discovery.for_each_subscriber(offer, EventgroupId{1}, [&](const Subscriber&) { ++count; });
    return count;
  }

  Machine<few_events> machine;
  FakePeer peer{host(2)};
};

TEST_F(MoreLossesThanPlacesForEvents, AreAllToldAfterAReboot) {
  covers({"feat_req_someipsd_871", "feat_req_someipsd_872"});
  const auto offered = machine.discovery.offer(service, machine.now);
  ASSERT_TRUE(offered);
  subscribe_often(peer, 5, infinite_ttl_s);
  for (std::uint16_t port = 1; port <= 3; ++port) {
    ASSERT_TRUE(machine.discovery.tcp_connected(host(1, 30510), host(2, port)));
  }
  machine.unicast(peer, {find(0x9999)});  // spoken while they stood
  peer.reboot();
  machine.unicast(peer, {find(0x9999)});
  EXPECT_EQ(subscribers(*offered), 0U);  // at once, though it is not told yet
  EXPECT_THAT(machine.events(),
              UnorderedElementsAre(HasSubstr("outdated"), HasSubstr("outdated"), HasSubstr("outdated"),
                                   HasSubstr(":1 at 10.0.0.2:30490 rebooted"), HasSubstr(":2 at"),
                                   HasSubstr(":3 at"), HasSubstr(":4 at"), HasSubstr(":5 at")));
  EXPECT_EQ(machine.discovery.counters().lost_events, 0U);
  // All places are free again.
  subscribe_often(peer, 5);
  EXPECT_EQ(subscribers(*offered), 5U);
}

TEST_F(MoreLossesThanPlacesForEvents, AreAllToldWhenTheLinkGoesDown) {
  covers({"feat_req_someipsd_437"});
  ASSERT_TRUE(machine.discovery.offer(service, machine.now));
  ASSERT_TRUE(machine.discovery.require({.service = ServiceId{0x2222}}, machine.now));
  FakePeer server{host(3)};
  for (std::uint16_t instance = 1; instance <= 3; ++instance) {
    machine.multicast(server, {offer({udp(host(3, 30509))}, 3, 0x2222, instance)});
    ASSERT_THAT(machine.events(), ElementsAre(HasSubstr("available")));
  }
  subscribe_often(peer, 3);
  machine.discovery.link_down();
  EXPECT_THAT(machine.events(),
              UnorderedElementsAre(HasSubstr("removed"), HasSubstr("removed"), HasSubstr("removed"),
                                   "lost 2222.0001 v1 link down", "lost 2222.0002 v1 link down",
                                   "lost 2222.0003 v1 link down"));
  EXPECT_EQ(machine.discovery.counters().lost_events, 0U);
}

TEST_F(MoreLossesThanPlacesForEvents, AreAllToldWhenTheirTimeIsOver) {
  covers({"feat_req_someipsd_445"});
  ASSERT_TRUE(machine.discovery.offer(service, machine.now));
  subscribe_often(peer, 4, 1);
  machine.discovery.on_time(start + 2s);
  EXPECT_THAT(machine.events(), AllOf(SizeIs(4), Contains(HasSubstr("expired")).Times(4)));
}

// The end of a subscription comes before that of its service.
TEST_F(MoreLossesThanPlacesForEvents, AreToldInTheirOrder) {
  const auto requirement =
      machine.discovery.require({.service = ServiceId{0x1234}, .instance = InstanceId{0x5678}}, machine.now);
  ASSERT_TRUE(requirement);
  for (std::uint16_t eventgroup = 1; eventgroup <= 3; ++eventgroup) {
    ASSERT_TRUE(machine.discovery.subscribe(
        *requirement,
        {.eventgroup = EventgroupId{eventgroup}, .udp = host(1, 40000), .ttl_s = infinite_ttl_s},
        machine.now));
  }
  machine.multicast(peer, {offer({udp(host(2, 30509))}, infinite_ttl_s)});
  machine.run_to(100ms);
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("available")));
  for (std::uint16_t eventgroup = 1; eventgroup <= 3; ++eventgroup) {
    machine.unicast(peer, {ack(eventgroup, {}, infinite_ttl_s)});
    ASSERT_THAT(machine.events(), ElementsAre("subscribed"));
  }
  peer.reboot();
  machine.multicast(peer, {find(0x9999)});
  EXPECT_THAT(machine.events(), ElementsAre("subscription lost rebooted", "subscription lost rebooted",
                                            "subscription lost rebooted", "lost 1234.5678 v1 rebooted"));
  machine.multicast(peer, {offer({udp(host(2, 30509))}, infinite_ttl_s)});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("available")));
}

// A service that is offered anew need not wait for the peer's next offer, which may be far off.
TEST_F(MoreLossesThanPlacesForEvents, AreToldBeforeWhatIsNew) {
  ASSERT_TRUE(machine.discovery.require({.service = ServiceId{0x2222}}, machine.now));
  const auto offer_of = [](std::uint16_t instance) {
    return offer({udp(host(2, 30509))}, 3, 0x2222, instance);
  };
  for (std::uint16_t instance = 1; instance <= 3; ++instance) {
    machine.multicast(peer, {offer_of(instance)});
    machine.events();
  }
  peer.reboot();
  machine.multicast(peer, {offer_of(1)});
  EXPECT_EQ(machine.discovery.counters().ignored_no_room, 0U);
  EXPECT_THAT(machine.events(), ElementsAre("lost 2222.0001 v1 rebooted", "lost 2222.0002 v1 rebooted",
                                            "lost 2222.0003 v1 rebooted", HasSubstr("available 2222.0001")));
}

TEST_F(MoreLossesThanPlacesForEvents, AreFewerForWhatCameAndWentUntold) {
  ASSERT_TRUE(machine.discovery.require({.service = ServiceId{0x2222}}, machine.now));
  const auto offer_of = [](std::uint16_t instance, std::uint32_t ttl_s = 3) {
    return offer({udp(host(2, 30509))}, ttl_s, 0x2222, instance);
  };
  machine.multicast(peer, {offer_of(1), offer_of(2), offer_of(3), offer_of(4), offer_of(3, 0), offer_of(5)});
  EXPECT_THAT(machine.events(), testing::UnorderedElementsAre(
                                    HasSubstr("available 2222.0001"), HasSubstr("available 2222.0002"),
                                    HasSubstr("available 2222.0004"), HasSubstr("available 2222.0005")));
}

TEST_F(MoreLossesThanPlacesForEvents, AreNotToldOfWhatTheApplicationEnds) {
  const auto offered = machine.discovery.offer(service, machine.now);
  ASSERT_TRUE(offered);
  subscribe_often(peer, 4, 1);
  machine.discovery.on_time(start + 2s);
  machine.discovery.stop_offer(*offered, machine.now);
  EXPECT_THAT(machine.events(), SizeIs(2));  // those that it could tell at once
  const auto again = machine.discovery.offer(service, machine.now);
  ASSERT_TRUE(again);
  machine.run_to(2100ms);
  subscribe_often(peer, 4);
}

TEST_F(MoreLossesThanPlacesForEvents, ShowNewRequirementsAllServicesThatAreKnown) {
  for (std::uint16_t instance = 1; instance <= 5; ++instance) {
    machine.multicast(peer, {offer({udp(host(2, 30509))}, 3, 0x2222, instance)});
  }
  const auto requirement = machine.discovery.require({.service = ServiceId{0x2222}}, machine.now);
  ASSERT_TRUE(requirement);
  EXPECT_THAT(machine.events(), AllOf(SizeIs(5), Contains(HasSubstr("available")).Times(5)));
  EXPECT_EQ(machine.discovery.counters().lost_events, 0U);
  const auto second = machine.discovery.require({.service = ServiceId{0x2222}}, machine.now);
  ASSERT_TRUE(second);
  machine.discovery.release(*second, machine.now);  // before all is told
  EXPECT_THAT(machine.events(), SizeIs(2));
  FakePeer other{host(3)};
  machine.multicast(other, {offer({udp(host(3, 30509))}, 3, 0x2222, 9)});
  EXPECT_THAT(machine.events(), ElementsAre(HasSubstr("2222.0009")));
}

}  // namespace
}  // namespace trestle::sd::losses_test
