#include "bridge/carry/config/describe_routes.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace trestle::carry {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class DescribeRoutes : public testing::Test {
 protected:
  describe::Reading read(const std::string& text) {
    const std::string file = (folder_ / "bridge.yaml").string();
    std::ofstream{file} << text;
    return describe_routes(file);
  }
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_ =
      std::filesystem::path{testing::TempDir()} / ("describe_routes_test_" + std::to_string(getpid()));
};

TEST_F(DescribeRoutes, DescribesEventsMethodsAndFields) {
  const describe::Reading reading = read(R"(
someip: {address: 127.0.0.1, sd: {multicast: 224.1.1.1}}
routes:
  - {topic: /car/door/moved, type: geometry_msgs/msg/Point, direction: someip_to_dds, service: 0x4711,
     instance: 1, eventgroup: 2, event: 0x8001, major: 3, wire: {byte_order: little, struct_length: 16},
     e2e: {profile: 4, data_id: 0x10}}
  - {topic: /points, type: sensor_msgs/msg/PointCloud2, direction: dds_to_someip, service: 0x4712, instance: 1,
     eventgroup: 1, event: 0x8001, port: 30509, tp: {segment_bytes: 1200}}
methods:
  - {ros_service: /car/door/open, type: std_srvs/srv/SetBool, server: someip, service: 0x4711, instance: 1,
     method: 1, major: 3}
fields:
  - {topic: /car/door/label, type: std_msgs/msg/String, server: someip, service: 0x4711, instance: 1, major: 3,
     event: 0x8002, eventgroup: 2, getter: 2, setter: 3}
)");
  ASSERT_THAT(reading.problems, IsEmpty()) << reading.problems[0].text;
  ASSERT_THAT(reading.model.services, SizeIs(2));
  const describe::Service& door = reading.model.services[0];
  EXPECT_EQ(door.name, "Door");
  EXPECT_EQ(door.major, 3);
  EXPECT_FALSE(door.from_ros);
  ASSERT_THAT(door.events, SizeIs(1));
  EXPECT_EQ(door.events[0].name, "moved");
  EXPECT_EQ(door.events[0].payload.byte_order, std::endian::little);
  EXPECT_EQ(door.events[0].payload.values[0].wire.length, someip::FieldWidth::bits16);
  EXPECT_EQ(door.events[0].e2e.profile, "4");
  EXPECT_EQ(door.events[0].e2e.numbers.at("data_id"), 0x10U);
  ASSERT_THAT(door.methods, SizeIs(1));
  EXPECT_EQ(door.methods[0].name, "open");
  ASSERT_THAT(door.fields, SizeIs(1));
  EXPECT_EQ(door.fields[0].name, "label");
  EXPECT_EQ(door.fields[0].notifier, someip::MethodId{0x8002});
  EXPECT_EQ(door.fields[0].getter, someip::MethodId{2});
  EXPECT_EQ(door.fields[0].setter, someip::MethodId{3});
  const describe::Service& points = reading.model.services[1];
  EXPECT_EQ(points.name, "PointsService");
  EXPECT_TRUE(points.from_ros);
  EXPECT_EQ(points.events[0].transfer.segment_bytes, 1200U);
  ASSERT_THAT(reading.model.instances, SizeIs(2));
  EXPECT_FALSE(reading.model.instances[0].address);
  EXPECT_EQ(reading.model.instances[1].udp_port, 30509);
  ASSERT_THAT(reading.model.machines, SizeIs(1));
  EXPECT_TRUE(reading.model.machines[0].sd_multicast);
}

TEST_F(DescribeRoutes, TakesTheInterfacesThatItNames) {
  const describe::Reading reading = read(
      "someip: {address: 127.0.0.1}\n"
      "interfaces: [" TRESTLE_SOURCE_DIR
      "/examples/door]\n"
      "generate: all\n");
  ASSERT_TRUE(reading.ok()) << reading.problems[0].text;
  ASSERT_THAT(reading.model.services, SizeIs(1));
  EXPECT_EQ(reading.model.services[0].scope, "car");
  EXPECT_THAT(reading.model.services[0].fields, SizeIs(3));
}

TEST_F(DescribeRoutes, TellsWhatIsWrongWithAPlace) {
  const describe::Reading reading = read(R"(
someip: {address: 127.0.0.1}
routes:
  - {topic: /car/door/moved, type: car_msgs/msg/None, direction: someip_to_dds, service: 0x4711, instance: 1,
     eventgroup: 2, event: 0x8001}
)");
  ASSERT_THAT(reading.problems, SizeIs(1));
  EXPECT_EQ(reading.problems[0].mark.line, 4);
  EXPECT_THAT(reading.problems[0].text, HasSubstr("car_msgs"));
  EXPECT_FALSE(read("routes: 3\n").ok());
}

}  // namespace
}  // namespace trestle::carry
