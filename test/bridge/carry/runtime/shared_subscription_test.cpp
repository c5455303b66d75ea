#include "bridge/carry/runtime/shared_subscription.hpp"

#include <gmock/gmock.h>

namespace trestle::carry {
namespace {

using someip::EventgroupId;
using someip::InstanceId;
using someip::ServiceId;

Route route(std::uint16_t eventgroup, std::uint16_t port, Transport transport = Transport::udp) {
  Route one;
  one.direction = Direction::someip_to_dds;
  one.service = ServiceId{0x1234};
  one.instance = InstanceId{1};
  one.eventgroup = EventgroupId{eventgroup};
  one.minor = 7;
  one.transport = transport;
  one.port = port;
  return one;
}

sd::SubscribeSpec wish(std::uint16_t eventgroup) {
  return {.service = ServiceId{0x1234}, .instance = InstanceId{1}, .eventgroup = EventgroupId{eventgroup}};
}

std::string share(const std::vector<Route>& routes, sd::SubscribeSpec& wanted) {
  std::vector<const Route*> all;
  for (const Route& one : routes) {
    all.push_back(&one);
  }
  return share_with_routes(all, wanted);
}

TEST(SharedSubscription, IsThatOfTheRouteWhichHasTheEventgroup) {
  sd::SubscribeSpec wanted = wish(3);
  EXPECT_EQ(share({route(3, 40001), route(3, 40001, Transport::tcp), route(4, 40002)}, wanted), "");
  EXPECT_EQ(wanted.port, 40001);
  EXPECT_EQ(wanted.minor, 7U);
  EXPECT_TRUE(wanted.udp && wanted.tcp);
}

// An event may be in several eventgroups, and comes once to each port.
TEST(SharedSubscription, IsAtThePortOfTheRoutesThatHaveOthersOfTheService) {
  sd::SubscribeSpec wanted = wish(5);
  EXPECT_EQ(share({route(3, 40001), route(4, 40001)}, wanted), "");
  EXPECT_EQ(wanted.port, 40001);
  EXPECT_EQ(wanted.minor, sd::any_minor);
}

TEST(SharedSubscription, IsAsItWasWantedWhereNoRouteHasTheService) {
  std::vector<Route> routes{route(3, 40001), route(3, 40001), route(3, 40001)};
  routes[0].direction = Direction::dds_to_someip;
  routes[1].service = ServiceId{0x4321};
  routes[2].instance = InstanceId{2};
  sd::SubscribeSpec wanted = wish(3);
  EXPECT_EQ(share(routes, wanted), "");
  EXPECT_EQ(wanted.port, 0);
  EXPECT_EQ(wanted.minor, sd::any_minor);
}

TEST(SharedSubscription, CannotBeWhereTheRouteWouldGetEventsTwice) {
  sd::SubscribeSpec other_version = wish(3);
  other_version.major = 2;
  EXPECT_EQ(share({route(3, 40001)}, other_version),
            "a route subscribes to eventgroup 0x0003 of 0x1234.0x0001 version 1.7: subscribe to that");
  sd::SubscribeSpec other = wish(5);
  EXPECT_EQ(share({route(3, 40001), route(4, 40002)}, other),
            "routes receive events of 0x1234 at several ports, where they would come twice");
}

// Nor would a route get initial values that joins a subscription which is there already.
TEST(SharedSubscription, CannotBeWhereTheRouteSubscribesLater) {
  std::vector<Route> routes{route(3, 40001)};
  routes[0].topic = "/door";
  routes[0].presence.subscribe_while_read = true;
  sd::SubscribeSpec wanted = wish(3);
  EXPECT_EQ(
      share(routes, wanted),
      "a route subscribes to eventgroup 0x0003 of 0x1234.0x0001 version 1.7 while somebody reads it, and "
      "would miss initial values: read its topic /door");
  sd::SubscribeSpec other = wish(5);
  EXPECT_EQ(share(routes, other), "");
  EXPECT_EQ(other.port, 40001);
}

TEST(SharedSubscription, IsOverTcpWhereTheRouteIs) {
  sd::SubscribeSpec wanted = wish(3);
  EXPECT_EQ(share({route(3, 40001, Transport::tcp)}, wanted), "");
  EXPECT_TRUE(wanted.tcp && !wanted.udp);
  EXPECT_EQ(wanted.port, 40001);  // as the route says, which has no use for it
}

}  // namespace
}  // namespace trestle::carry
