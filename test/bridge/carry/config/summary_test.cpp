#include "bridge/carry/commands/summary.hpp"

#include <gmock/gmock.h>

#include "bridge/carry/config/load.hpp"
#include "test/bridge/carry/config/good_config.hpp"

namespace trestle::test::summary_test {
namespace {

TEST(ConfigSummary, ShowsWhatGoesWhere) {
  const auto loaded = carry::parse_config(good_config, "bridge.yaml");
  ASSERT_TRUE(loaded.has_value());
  EXPECT_EQ(carry::summary(loaded->config, {}),
            R"(bridge.yaml: good, 2 routes
  DDS     domain 7, on 127.0.0.1 192.0.2.7, shared memory
  ROS 2   node /front/trestle, among those of humble
  SOME/IP 192.0.2.1 (eth0), discovery at 239.1.2.3:30491, offers live 10 s

  TOPIC        SERVICE.INSTANCE  EVENT   GROUP   VERSION  PORT                               TYPE
  /points  ->  0x1111.0x0022     0x8044  0x0033  5.6      udp 40001, 239.1.2.4:40100 from 3  sensor_msgs/msg/PointCloud2
  /target  <-  0x2222.0x0001     0x8001  0x0001  1.any    udp any                            geometry_msgs/msg/Point

  wire  little endian (lengths big); bits of length fields: arrays 16, fixed arrays 8, strings 8, structs 32, unions 16 (type 8, type first); strings UTF-16BE; aligned to 64 bits; unions may be empty; longer arrays refused; missing fields get their defaults; sensor_msgs/msg/PointField has tags (the smallest length); sensor_msgs/msg/PointField has strings of fixed size; sensor_msgs/msg/PointField has fields with a byte order of their own; sensor_msgs/msg/PointField has fields with rules of their own and rules for itself; std_msgs/msg/Header is a union
          for /points
  wire  big endian; bits of length fields: arrays 32, fixed arrays none, strings 32, structs none, unions 32 (type 32, length first); strings UTF-8, BOM, terminator; no alignment
          for /target
  TP    segments of 1024 bytes, 250 us after every 16, messages up to 8 MiB
          for /points
  TP    segments of 1392 bytes, 500 us after as many as the receiver can take, messages up to 16 MiB
          for /target
  QoS   reliable, transient local, keep all up to 3, deadline 250 ms, lifespan 2 s, liveliness by topic, lease 500 ms
          for /points
  QoS   reliable, volatile, keep last 10
          for /target
)");
}

TEST(ConfigSummary, NamesWhatIsDescribed) {
  const auto loaded = carry::parse_config(good_config, "bridge.yaml");
  ASSERT_TRUE(loaded.has_value());
  carry::IdNames names;
  names.add(0x1111, 5, {.name = "Lidar", .members = {{0x8044, "points"}}, .eventgroups = {}});
  names.add(0x2222, 9, {.name = "Other", .members = {{0x8001, "of another version"}}, .eventgroups = {}});
  EXPECT_THAT(carry::summary(loaded->config, {}, names), testing::HasSubstr(R"(
  TOPIC        SERVICE.INSTANCE  EVENT   GROUP   VERSION  PORT                               NAME          TYPE
  /points  ->  0x1111.0x0022     0x8044  0x0033  5.6      udp 40001, 239.1.2.4:40100 from 3  Lidar.points  sensor_msgs/msg/PointCloud2
  /target  <-  0x2222.0x0001     0x8001  0x0001  1.any    udp any                                          geometry_msgs/msg/Point
)"));
}

TEST(ConfigSummary, TellsWhichByteOrderLengthFieldsHave) {
  const auto wire = [](const std::string& length_order) {
    const auto loaded =
        carry::parse_config(replaced(good_config, "length_order: big", length_order), "b.yaml");
    return loaded ? carry::summary(loaded->config, {}) : to_string(loaded.error().front());
  };
  EXPECT_THAT(wire("length_order: big"), testing::HasSubstr("little endian (lengths big); bits"));
  EXPECT_THAT(wire("length_order: as_payload"), testing::HasSubstr("little endian (lengths too); bits"));
}

}  // namespace
}  // namespace trestle::test::summary_test
