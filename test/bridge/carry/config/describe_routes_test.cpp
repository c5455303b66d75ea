#include "bridge/carry/config/describe_routes.hpp"
#include "test/source_dir.hpp"

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
  EXPECT_EQ(door.id_place.mark.line, 4);
  EXPECT_EQ(door.events[0].id_place.mark, (documents::Mark{5, 41}));
  EXPECT_EQ(door.methods[0].id_place.mark.line, 11);
  for (const describe::Place& place :
       {door.fields[0].notifier_place, door.fields[0].getter_place, door.fields[0].setter_place}) {
    EXPECT_EQ(place.mark.line, 14);
  }
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

/// As `generate` writes two instances of one service.
TEST_F(DescribeRoutes, DescribesAServiceOfTwoInstancesOnce) {
  std::string text = "someip: {address: 127.0.0.1}\n";
  const auto list = [&](const std::string& name, const std::string& entry) {
    text += name + ":\n";
    for (const std::string instance : {"1", "2"}) {
      std::string one = entry;
      for (std::size_t at = 0; (at = one.find('N', at)) != std::string::npos;) {
        one.replace(at, 1, instance);
      }
      text += "  - " + one + "\n";
    }
  };
  list(
      "routes",
      "{topic: /car/door/instance_N/moved, type: geometry_msgs/msg/Point, direction: someip_to_dds, service: "
      "0x4711, instance: N, eventgroup: 2, event: 0x8001}");
  list(
      "methods",
      "{ros_service: /car/door/instance_N/open, type: std_srvs/srv/SetBool, server: someip, service: 0x4711, "
      "instance: N, method: 1}");
  list("fields",
       "{topic: /car/door/instance_N/label, type: std_msgs/msg/String, server: someip, service: 0x4711, "
       "instance: N, event: 0x8002, eventgroup: 2, getter: 2, setter: 3}");
  // Of this one, each instance has another part first.
  text +=
      "  - {topic: /car/door/instance_1/light, type: std_msgs/msg/Bool, server: someip, service: 0x4711, "
      "instance: 1, setter: 5}\n"
      "  - {topic: /car/door/instance_2/light, type: std_msgs/msg/Bool, server: someip, service: 0x4711, "
      "instance: 2, event: 0x8003, eventgroup: 2, setter: 5}\n";
  const describe::Reading reading = read(text);
  ASSERT_THAT(reading.problems, IsEmpty()) << reading.problems[0].text;
  ASSERT_THAT(reading.model.services, SizeIs(1));
  const describe::Service& door = reading.model.services[0];
  EXPECT_EQ(door.name, "Door");
  ASSERT_THAT(door.events, SizeIs(1));
  EXPECT_EQ(door.events[0].ros_name, "/car/door/moved");
  EXPECT_THAT(door.methods, SizeIs(1));
  ASSERT_THAT(door.fields, SizeIs(2));
  EXPECT_EQ(door.fields[0].name, "label");
  EXPECT_EQ(door.fields[0].ros_name, "/car/door/label");
  EXPECT_EQ(door.fields[0].getter, someip::MethodId{2});
  EXPECT_EQ(door.fields[1].name, "light");
  EXPECT_EQ(door.fields[1].notifier, someip::MethodId{0x8003});
  EXPECT_EQ(door.fields[1].setter, someip::MethodId{5});
  EXPECT_THAT(reading.model.instances, SizeIs(2));
}

TEST_F(DescribeRoutes, DescribesTheProtectionOfEachInstance) {
  std::string text = "someip: {address: 127.0.0.1}\n";
  const auto list = [&](const std::string& name, const std::string& front, const std::string& e2e) {
    text += name + ":\n";
    for (const std::string instance : {"1", "2"}) {
      std::string its = e2e;
      its.replace(its.find('N'), 1, instance);
      text += "  - {" + front + ", service: 0x4711, instance: " + instance + ", e2e: " + its + "}\n";
      text.replace(text.rfind("instance_N"), 10, "instance_" + instance);
    }
  };
  list("routes",
       "topic: /car/door/instance_N/moved, type: geometry_msgs/msg/Point, direction: someip_to_dds, "
       "eventgroup: 2, "
       "event: 0x8001",
       "{profile: 4, data_id: N}");
  list("methods",
       "ros_service: /car/door/instance_N/open, type: std_srvs/srv/SetBool, server: someip, method: 1",
       "{profile: 4, data_id: N}");
  list("fields",
       "topic: /car/door/instance_N/label, type: std_msgs/msg/String, server: someip, event: 0x8002, "
       "eventgroup: 2, "
       "getter: 2, setter: 3",
       "{event: {profile: 4, data_id: 9}, getter: {profile: 4, data_id: 9}, setter: {profile: 4, data_id: "
       "N}}");
  const describe::Reading reading = read(text);
  ASSERT_THAT(reading.problems, IsEmpty()) << reading.problems[0].text;
  ASSERT_THAT(reading.model.services, SizeIs(1));
  const describe::Service& door = reading.model.services[0];
  for (const describe::Protection& e2e :
       {door.events.at(0).e2e, door.methods.at(0).e2e, door.fields.at(0).setter_e2e}) {
    EXPECT_EQ(e2e.of(someip::InstanceId{1}).numbers.at("data_id"), 1U);
    EXPECT_EQ(e2e.of(someip::InstanceId{2}).numbers.at("data_id"), 2U);
  }
  EXPECT_THAT(door.fields[0].e2e.of_instances, IsEmpty());
  EXPECT_THAT(door.fields[0].getter_e2e.of_instances, IsEmpty());
}

TEST_F(DescribeRoutes, DescribesAllOfAProtection) {
  const describe::Reading reading = read(R"(
someip: {address: 127.0.0.1}
routes:
  - {topic: /car/door/moved, type: std_msgs/msg/UInt8, direction: someip_to_dds, service: 0x4711, instance: 1,
     eventgroup: 2, event: 0x8001,
     e2e: {profile: 22, data_bits: 88, data_id_list: [0x10, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15],
           state_machine: {window_size_valid: 5, min_ok_valid: 2}}}
)");
  ASSERT_THAT(reading.problems, IsEmpty()) << reading.problems[0].text;
  const describe::Protection& e2e = reading.model.services[0].events[0].e2e;
  EXPECT_EQ(e2e.words.at("data_id_list"), "0x10 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15");
  EXPECT_EQ(e2e.numbers.at("window_size_valid"), 5U);
  EXPECT_EQ(e2e.numbers.at("min_ok_valid"), 2U);
}

TEST_F(DescribeRoutes, TakesTheInterfacesThatItNames) {
  const describe::Reading reading = read(
      "someip: {address: 127.0.0.1}\n"
      "interfaces: [" +
      test::source_dir() +
      "/examples/door]\n"
      "generate: all\n");
  ASSERT_TRUE(reading.ok()) << reading.problems[0].text;
  ASSERT_THAT(reading.model.services, SizeIs(1));
  EXPECT_EQ(reading.model.services[0].scope, "car");
  EXPECT_THAT(reading.model.services[0].fields, SizeIs(3));
}

/// As `generate` writes routes of `.action` and `.srv` files: none of them is another service.
TEST_F(DescribeRoutes, GivesServicesOfRosTypesTheIdsThatRoutesHave) {
  std::filesystem::create_directories(folder_ / "car" / "action");
  std::filesystem::create_directories(folder_ / "car" / "srv");
  std::ofstream{folder_ / "car" / "action" / "Go.action"} << "int32 o\n---\nint32 r\n---\nint32 f\n";
  std::ofstream{folder_ / "car" / "srv" / "Do.srv"} << "int32 o\n---\nint32 r\n";
  const describe::Reading reading = read(R"(
someip: {address: 127.0.0.1}
interfaces: [car]
methods:
  - {ros_service: /do_value, type: car/srv/Do, server: ros, service: 0x4d6e, instance: 1, method: 7, port: 30502}
actions:
  - {action: /go, type: car/action/Go, server: ros, service: 0x4de7, instance: 1, port: 30501, eventgroup: 1,
     methods: {send_goal: 1, cancel_goal: 2, get_result: 3}, events: {feedback: 0x8001, status: 0x8002}}
)");
  ASSERT_TRUE(reading.ok()) << reading.problems[0].text;
  ASSERT_THAT(reading.model.services, SizeIs(2));
  for (const describe::Service& service : reading.model.services) {
    const bool is_action = service.name == "GoService";
    EXPECT_EQ(service.id, someip::ServiceId(is_action ? 0x4de7 : 0x4d6e)) << service.name;
    for (const describe::Method& method : service.methods) {
      EXPECT_TRUE(method.id) << method.name;
    }
    for (const describe::Event& event : service.events) {
      EXPECT_TRUE(event.id) << event.name;
    }
  }
}

/// As `generate` writes a FIDL without FDEPL: the ids stand in the routes, the types in the FIDL.
TEST_F(DescribeRoutes, GivesInterfacesTheIdsThatTheyLack) {
  std::ofstream{folder_ / "Lamp.fidl"} << "package car\n"
                                          "interface Lamp { version { major 1 minor 0 }\n"
                                          "  attribute UInt8 colourOf readonly\n"
                                          "  broadcast hot { out { UInt8 x } }\n"
                                          "  method go { }\n"
                                          "}\n";
  const describe::Reading reading = read(R"(
someip: {address: 127.0.0.1}
interfaces: [Lamp.fidl]
routes:
  - {topic: /lamp/hot, type: car/msg/LampHot, direction: someip_to_dds, service: 0x4711, instance: 5, eventgroup: 2,
     event: 0x8007}
methods:
  - {ros_service: /lamp/go, type: car/srv/LampGo, server: someip, service: 0x4711, instance: 5, method: 7}
fields:
  - {topic: /lamp/colour_of, type: car/msg/LampColourOf, server: someip, service: 0x4711, instance: 5, event: 0x8002,
     eventgroup: 2, getter: 2}
)");
  ASSERT_TRUE(reading.ok()) << reading.problems[0].text;
  ASSERT_THAT(reading.model.services, SizeIs(1));
  const describe::Service& lamp = reading.model.services[0];
  EXPECT_EQ(lamp.scope, "car");
  EXPECT_EQ(lamp.id, someip::ServiceId{0x4711});
  EXPECT_EQ(lamp.events[0].id, someip::MethodId{0x8007});
  EXPECT_THAT(lamp.events[0].eventgroups, ElementsAre(someip::EventgroupId{2}));
  EXPECT_EQ(lamp.methods[0].id, someip::MethodId{7});
  EXPECT_EQ(lamp.fields[0].notifier, someip::MethodId{0x8002});
  EXPECT_EQ(lamp.fields[0].getter, someip::MethodId{2});
  ASSERT_THAT(reading.model.instances, SizeIs(1));
  EXPECT_EQ(reading.model.instances[0].id, someip::InstanceId{5});
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
