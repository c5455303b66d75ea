// A mapping of fields, both ways: a SOME/IP stack with an ECU's structs on one side, DDS with messages of ROS
// on the other.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "test/bridge/end_to_end/bridge_test.hpp"

namespace trestle::test::mapping_test {
namespace {

class Mapping : public BridgeTest {
 protected:
  Mapping() {
    std::filesystem::create_directories(folder_ + "/car_msgs/msg");
    std::ofstream{folder_ + "/car_msgs/msg/Gnss.msg"}
        << "int32 lat_e7\nint32 lon_e7\nuint8 fix\nuint8 counter\n";
  }
  ~Mapping() override { std::filesystem::remove_all(folder_); }

  /// @param keys  of the route.
  void start(const std::string& keys) {
    start_bridge("types: {paths: [" + folder_ + R"(]}
routes:
  - topic: /fix
    type: sensor_msgs/msg/NavSatFix
    payload: car_msgs/msg/Gnss
    service: 0x1234
    instance: 1
    eventgroup: 1
    event: 0x8001
    map:
      header.frame_id: {value: gnss}
      status.status: {from: fix, table: {0: -1, 1: 0, 2: 2}}
      status.service: {value: 1}
      latitude: {from: lat_e7, scale: 1e-7}
      longitude: {from: lon_e7, scale: 1e-7}
    drop: [counter]
    others: default
)" + keys);
  }

  static constexpr someip::MethodId event_{0x8001};
  const std::string folder_ = testing::TempDir() + "trestle-mapping-" + std::to_string(getpid());
  // 48.1234567, -8.7654321, no fix, a counter; by Python's struct and by rosbags.
  const Bytes payload_ = hex("1caf0e87 fac6804f 00 07");
  const Bytes sample_ = hex(
      "00010000 00000000 00000000 05000000 676e737300 ff 0100 00000000 6d7cdc6dcd0f4840 019e59b7e68721c0"
      "0000000000000000 0000000000000000 0000000000000000 0000000000000000 0000000000000000 0000000000000000"
      "0000000000000000 0000000000000000 0000000000000000 0000000000000000 00");
  sd::Node peer_{io_, peer_config()};
};

TEST_F(Mapping, MakesAMessageOfRosOfAnEcusStruct) {
  start("    direction: someip_to_dds\n");
  Inbox<Bytes> inbox;
  const auto reading = reader("/fix", "sensor_msgs/msg/NavSatFix", inbox);
  const sd::Offer offer{peer_,
                        {.service = someip::ServiceId{0x1234},
                         .instance = someip::InstanceId{1},
                         .eventgroups = {{.id = someip::EventgroupId{1}, .events = {event_}}}}};
  ASSERT_TRUE(
      until([&] { return peer_.subscribers(offer.handle(), event_) == 1 && reading.matched() == 1; }));
  ASSERT_TRUE(until_counter("route /fix", "readers", 1));
  offer.notify(event_, payload_);
  ASSERT_TRUE(until([&] { return inbox.size() > 0; }));
  const Bytes made = inbox.take().front();
  ASSERT_GE(made.size(), sample_.size());  // DDS may pad it to a multiple of 4
  EXPECT_EQ(to_hex(ByteView{made}.first(sample_.size())), to_hex(sample_));
}

TEST_F(Mapping, MakesAnEcusStructOfAMessageOfRos) {
  start("    direction: dds_to_someip\n    port: 40001\n");
  Bytes received;
  const sd::Subscription subscription{
      peer_,
      {.service = someip::ServiceId{0x1234}, .eventgroup = someip::EventgroupId{1}, .events = {event_}},
      [&](const someip::Message& event, const Endpoint&) {
        received.assign(event.payload.begin(), event.payload.end());
      }};
  auto writing = writer("/fix", "sensor_msgs/msg/NavSatFix");
  ASSERT_TRUE(until([&] { return subscription.active() && writing.matched() == 1; }));
  ASSERT_TRUE(writing.write(sample_));
  ASSERT_TRUE(until([&] { return !received.empty(); }));
  EXPECT_EQ(to_hex(received), to_hex(hex("1caf0e87 fac6804f 00 00")));
  EXPECT_EQ(bridge_->counter("route /fix", "map_saturated"), 0U);
}

}  // namespace
}  // namespace trestle::test::mapping_test
