// What the factory makes of a configuration, and what routes of one service share.
#include "test/bridge/carry/runtime/route_test.hpp"

namespace trestle::test::routes_test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;
using testing::SizeIs;

class RoutesTest : public RouteTest {
 protected:
  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> all;
    for (const auto& [mark, route] : *routes_) {
      all.push_back(route->counters().name);
    }
    return all;
  }
  [[nodiscard]] std::shared_ptr<carry::RunningRoute> made_of(const carry::Route& route) {
    carry::BridgeConfig alone;
    alone.routes = {route};
    return make_routes(context_, alone, types_).front().route;
  }
};

TEST_F(RoutesTest, OfEachKindStandInTheOrderOfTheConfiguration) {
  config_.routes = {route(carry::Direction::someip_to_dds), route(carry::Direction::dds_to_someip)};
  config_.routes[0].mark = {.line = 3, .column = 5};
  config_.routes[1].mark = {.line = 4, .column = 5};
  config_.routes[1].getter.emplace(carry::FieldGetter{.id = someip::MethodId{0x31}});
  config_.methods = {method(carry::Server::someip), method(carry::Server::ros)};
  config_.methods[0].mark = {.line = 10, .column = 7};
  config_.methods[1].mark = {.line = 10, .column = 5};
  start();
  EXPECT_THAT(names(), ElementsAre("route /talk from SOME/IP", "route /talk to SOME/IP", "getter of /talk",
                                   "method of ROS service /set", "ROS service of method /set"));
}

TEST_F(RoutesTest, OfOneServiceShareItsOffer) {
  config_.routes = {route(carry::Direction::dds_to_someip), route(carry::Direction::dds_to_someip)};
  config_.routes[1].topic = "/shout";
  config_.routes[1].event = someip::MethodId{0x8002};
  config_.methods = {method(carry::Server::ros)};
  config_.methods[0].offer_always = true;
  start();
  ASSERT_TRUE(someip_.offered);
  EXPECT_THAT(someip_.offered->methods, SizeIs(1));
  ASSERT_THAT(someip_.offered->eventgroups, SizeIs(1));
  EXPECT_THAT(someip_.offered->eventgroups.front().events,
              ElementsAre(someip::MethodId{0x8001}, someip::MethodId{0x8002}));
}

TEST_F(RoutesTest, ThatCannotBeMadeSayWhereTheyStand) {
  config_.file = "bridge.yaml";
  config_.routes = {route(carry::Direction::dds_to_someip)};
  config_.routes[0].type = "no_msgs/msg/Such";
  config_.routes[0].mark = {.line = 7, .column = 3};
  try {
    start();
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(),
                testing::StartsWith("bridge.yaml:7:3: route /talk: no_msgs/msg/Such cannot be "));
  }
}

TEST_F(RoutesTest, TellASetterWhichValueItsNotifierHas) {
  config_.routes = {route(carry::Direction::someip_to_dds)};
  config_.routes[0].type = "std_msgs/msg/Bool";
  config_.methods = {method(carry::Server::someip)};
  config_.methods[0].notifier = config_.routes[0].event;
  bool is_known = false;
  values_.tell(config_.routes[0].service, config_.routes[0].instance, config_.routes[0].event,
               [&](std::optional<ByteView> value) { is_known = value.has_value(); });
  start();
  someip_.on_event({.payload = hex("01")}, {IpAddress::v4(10, 0, 0, 2), 30501});
  EXPECT_TRUE(is_known);
}

TEST_F(RoutesTest, AreAddedAndRemovedWithTheirOffers) {
  config_.routes = {route(carry::Direction::dds_to_someip)};
  start();
  carry::Route more = route(carry::Direction::dds_to_someip);
  more.topic = "/more";
  more.service = someip::ServiceId{0x4321};
  auto made = made_of(more);
  const carry::RunningRoute& running = *made;
  routes_->add(more, std::move(made), someip_);
  EXPECT_THAT(names(), ElementsAre("route /talk to SOME/IP", "route /more to SOME/IP"));
  EXPECT_THAT(someip_.offers,
              ElementsAre(Pair(1, someip::ServiceId{0x1234}), Pair(2, someip::ServiceId{0x4321})));
  routes_->remove(more, running);
  EXPECT_THAT(names(), ElementsAre("route /talk to SOME/IP"));
  EXPECT_THAT(someip_.offers, ElementsAre(Pair(1, someip::ServiceId{0x1234})));
  EXPECT_EQ(dds_.reads, 1);
}

TEST_F(RoutesTest, ThatCannotJoinLeaveNoOfferBehind) {
  start();
  const carry::Route more = route(carry::Direction::dds_to_someip);
  dds_.no_reader = true;
  EXPECT_THROW(routes_->add(more, made_of(more), someip_), std::runtime_error);
  EXPECT_THAT(names(), IsEmpty());
  EXPECT_THAT(someip_.offers, IsEmpty());
}

}  // namespace
}  // namespace trestle::test::routes_test
