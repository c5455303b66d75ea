// When a service that another bridge offers is known well enough to be used.
#include "bridge/carry/runtime/ways_back.hpp"

#include <gtest/gtest.h>

#include "bridge/carry/runtime/bridge_mark.hpp"
#include "test/bridge/carry/runtime/fake_sides.hpp"

namespace trestle::carry::ways_back_test {
namespace {

constexpr IpAddress other = IpAddress::v4(10, 0, 0, 2);

sd::RemoteService offered(std::uint16_t service) {
  sd::RemoteService result;
  result.service = someip::ServiceId{service};
  result.instance = someip::InstanceId{1};
  result.udp = Endpoint{other, 40001};
  return result;
}

Route route(std::uint16_t service, std::uint16_t event, Direction direction = Direction::someip_to_dds) {
  Route result;
  result.direction = direction;
  result.service = someip::ServiceId{service};
  result.instance = someip::InstanceId{1};
  result.event = someip::MethodId{event};
  return result;
}

MethodRoute method(std::uint16_t service, std::uint16_t id, Server server = Server::someip) {
  MethodRoute result;
  result.server = server;
  result.service = someip::ServiceId{service};
  result.instance = someip::InstanceId{1};
  result.method = someip::MethodId{id};
  return result;
}

// What the other bridge has in DDS.
dds::BridgeEnd reader_of(std::uint16_t service, std::uint16_t event, const IpAddress& at = other) {
  return {.text = to_text(mark_of(at, route(service, event, Direction::dds_to_someip))), .writer = false};
}
dds::BridgeEnd end_of_client(std::uint16_t service, std::uint16_t id, bool writer) {
  return {.text = to_text(mark_of(other, method(service, id, Server::ros))), .writer = writer};
}

class WaysBackTest : public testing::Test {
 protected:
  test::FakeDds dds;
  BridgeConfig config;
};

TEST_F(WaysBackTest, OfAnEventAreKnownByTheReaderOfTheOtherBridge) {
  config.routes = {route(0x4101, 0x8001)};
  WaysBack ways{config};
  EXPECT_FALSE(ways.are_known(dds, offered(0x4101)));
  dds.ends.push_back(reader_of(0x4101, 0x8002));
  dds.ends.push_back(reader_of(0x4102, 0x8001));
  dds.ends.push_back(reader_of(0x4101, 0x8001, IpAddress::v4(10, 0, 0, 3)));
  EXPECT_FALSE(ways.are_known(dds, offered(0x4101))) << "another event, service or bridge";
  dds.ends.push_back(reader_of(0x4101, 0x8001));
  EXPECT_TRUE(ways.are_known(dds, offered(0x4101)));
}

TEST_F(WaysBackTest, OfAMethodAreKnownByTheWriterOfItsRequests) {
  config.methods = {method(0x4201, 1)};
  WaysBack ways{config};
  EXPECT_FALSE(ways.are_known(dds, offered(0x4201)));
  dds.ends.push_back(end_of_client(0x4201, 1, false));
  EXPECT_FALSE(ways.are_known(dds, offered(0x4201))) << "the reader of its answers is no end of requests";
  dds.ends.push_back(end_of_client(0x4201, 1, true));
  EXPECT_TRUE(ways.are_known(dds, offered(0x4201)));
}

TEST_F(WaysBackTest, OfAServiceAreKnownWhenThoseOfAllItsPartsAre) {
  config.routes = {route(0x4101, 0x8001), route(0x4101, 0x8002)};
  config.methods = {method(0x4101, 1)};
  WaysBack ways{config};
  dds.ends.push_back(reader_of(0x4101, 0x8001));
  dds.ends.push_back(end_of_client(0x4101, 1, true));
  EXPECT_FALSE(ways.are_known(dds, offered(0x4101)));
  dds.ends.push_back(reader_of(0x4101, 0x8002));
  EXPECT_TRUE(ways.are_known(dds, offered(0x4101)));
}

TEST_F(WaysBackTest, AreNoneWhereWeBringNothingIn) {
  config.routes = {route(0x4101, 0x8001, Direction::dds_to_someip)};
  config.methods = {method(0x4101, 1, Server::ros)};
  WaysBack ways{config};
  EXPECT_TRUE(ways.are_known(dds, offered(0x4101)));
}

TEST_F(WaysBackTest, AreNotWhereAnotherBridgeBringsItIn) {
  config.routes = {route(0x4101, 0x8001)};
  WaysBack ways{config};
  dds.ends.push_back({.text = to_text(mark_of(other, route(0x4101, 0x8001))), .writer = true});
  dds.ends.push_back({.text = "what nobody understands", .writer = false});
  EXPECT_FALSE(ways.are_known(dds, offered(0x4101)));
}

}  // namespace
}  // namespace trestle::carry::ways_back_test
