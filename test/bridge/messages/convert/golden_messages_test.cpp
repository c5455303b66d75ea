// Whole messages in bytes computed by hand, see golden_fields.hpp. golden_builtin_test.cpp has the other
// types.
#include "test/bridge/messages/convert/golden_fields.hpp"

namespace trestle::messages::golden_messages_test {
namespace {

using namespace trestle::test;

TEST(GoldenMessages, Time) {
  expect_both_ways("builtin_interfaces/Time", {
                                                  {"sec -2", "feffffff", "fffffffe"},
                                                  {"nanosec 500000000", "0065cd1d", "1dcd6500"},
                                              });
}

TEST(GoldenMessages, Duration) {
  expect_both_ways("builtin_interfaces/Duration", {
                                                      {"sec -1", "ffffffff", "ffffffff"},
                                                      {"nanosec 999999999", "ffc99a3b", "3b9ac9ff"},
                                                  });
}

TEST(GoldenMessages, ColorRGBA) {
  expect_both_ways("std_msgs/ColorRGBA", {
                                             {"r 1.0", "0000803f", "3f800000"},
                                             {"g 0.5", "0000003f", "3f000000"},
                                             {"b 0.25", "0000803e", "3e800000"},
                                             {"a 0.75", "0000403f", "3f400000"},
                                         });
}

TEST(GoldenMessages, UInt8MultiArray) {
  expect_both_ways("std_msgs/UInt8MultiArray",
                   {
                       {"layout.dim, 1 of 20 bytes", "01000000", "00000014"},
                       {"label 'rows'", "05000000 726f777300", "00000008 efbbbf 726f7773 00"},
                       {"size 2", "000000 02000000", "00000002"},
                       {"stride 2", "02000000", "00000002"},
                       {"data_offset 1", "01000000", "00000001"},
                       {"data", "02000000 0a0b", "00000002 0a0b"},
                   });
}

TEST(GoldenMessages, Twist) {
  expect_both_ways("geometry_msgs/Twist", {
                                              {"linear.x 1.0", "000000000000f03f", "3ff0000000000000"},
                                              {"linear.y 0.0", "0000000000000000", "0000000000000000"},
                                              {"linear.z 2.0", "0000000000000040", "4000000000000000"},
                                              {"angular.x -0.0", "0000000000000080", "8000000000000000"},
                                              {"angular.y 0.0", "0000000000000000", "0000000000000000"},
                                              {"angular.z -0.5", "000000000000e0bf", "bfe0000000000000"},
                                          });
}

TEST(GoldenMessages, PoseStamped) {
  expect_both_ways("geometry_msgs/PoseStamped",
                   {
                       {"stamp.sec 1", "01000000", "00000001"},
                       {"stamp.nanosec 2", "02000000", "00000002"},
                       {"frame_id 'odom'", "05000000 6f646f6d00", "00000008 efbbbf 6f646f6d 00"},
                       {"position.x 1.0", "00000000000000 000000000000f03f", "3ff0000000000000"},
                       {"position.y -2.0", "00000000000000c0", "c000000000000000"},
                       {"position.z 0.5", "000000000000e03f", "3fe0000000000000"},
                       {"orientation.x 0.0", "0000000000000000", "0000000000000000"},
                       {"orientation.y 0.0", "0000000000000000", "0000000000000000"},
                       {"orientation.z -1.0", "000000000000f0bf", "bff0000000000000"},
                       {"orientation.w 0.25", "000000000000d03f", "3fd0000000000000"},
                   });
}

TEST(GoldenMessages, TFMessage) {
  // The transform: 8 bytes of stamp, strings of 4 + 7 and 4 + 8, seven numbers.
  expect_both_ways("tf2_msgs/TFMessage",
                   {
                       {"transforms, 1 of 87 bytes", "01000000", "00000057"},
                       {"stamp.sec 258", "02010000", "00000102"},
                       {"stamp.nanosec 3", "03000000", "00000003"},
                       {"frame_id 'map'", "04000000 6d617000", "00000007 efbbbf 6d6170 00"},
                       {"child_frame_id 'base'", "05000000 6261736500", "00000008 efbbbf 62617365 00"},
                       {"translation.x 1.0", "000000 000000000000f03f", "3ff0000000000000"},
                       {"translation.y 3.0", "0000000000000840", "4008000000000000"},
                       {"translation.z 1.5", "000000000000f83f", "3ff8000000000000"},
                       {"rotation.x 0.0", "0000000000000000", "0000000000000000"},
                       {"rotation.y 0.5", "000000000000e03f", "3fe0000000000000"},
                       {"rotation.z 0.0", "0000000000000000", "0000000000000000"},
                       {"rotation.w -1.0", "000000000000f0bf", "bff0000000000000"},
                   });
}

TEST(GoldenMessages, Path) {
  // The pose: 8 bytes of stamp, a string of 4 + 7, seven numbers.
  expect_both_ways("nav_msgs/Path", {
                                        {"stamp.sec 1", "01000000", "00000001"},
                                        {"stamp.nanosec 2", "02000000", "00000002"},
                                        {"frame_id 'map'", "04000000 6d617000", "00000007 efbbbf 6d6170 00"},
                                        {"poses, 1 of 75 bytes", "01000000", "0000004b"},
                                        {"stamp.sec 3", "03000000", "00000003"},
                                        {"stamp.nanosec 4", "04000000", "00000004"},
                                        {"frame_id 'map'", "04000000 6d617000", "00000007 efbbbf 6d6170 00"},
                                        {"position.x 4.0", "00000000 0000000000001040", "4010000000000000"},
                                        {"position.y 1.5", "000000000000f83f", "3ff8000000000000"},
                                        {"position.z 0.0", "0000000000000000", "0000000000000000"},
                                        {"orientation.x 0.0", "0000000000000000", "0000000000000000"},
                                        {"orientation.y 0.0", "0000000000000000", "0000000000000000"},
                                        {"orientation.z 0.0", "0000000000000000", "0000000000000000"},
                                        {"orientation.w 1.0", "000000000000f03f", "3ff0000000000000"},
                                    });
}

TEST(GoldenMessages, OccupancyGrid) {
  expect_both_ways("nav_msgs/OccupancyGrid",
                   {
                       {"stamp.sec 1", "01000000", "00000001"},
                       {"stamp.nanosec 2", "02000000", "00000002"},
                       {"frame_id 'map'", "04000000 6d617000", "00000007 efbbbf 6d6170 00"},
                       {"info.map_load_time.sec 5", "05000000", "00000005"},
                       {"info.map_load_time.nanosec 6", "06000000", "00000006"},
                       {"info.resolution 0.5", "0000003f", "3f000000"},
                       {"info.width 2", "02000000", "00000002"},
                       {"info.height 1", "01000000", "00000001"},
                       {"info.origin.position.x -1.0", "00000000 000000000000f0bf", "bff0000000000000"},
                       {"info.origin.position.y 2.0", "0000000000000040", "4000000000000000"},
                       {"info.origin.position.z 0.0", "0000000000000000", "0000000000000000"},
                       {"info.origin.orientation.x 0.0", "0000000000000000", "0000000000000000"},
                       {"info.origin.orientation.y 0.0", "0000000000000000", "0000000000000000"},
                       {"info.origin.orientation.z 0.0", "0000000000000000", "0000000000000000"},
                       {"info.origin.orientation.w 1.0", "000000000000f03f", "3ff0000000000000"},
                       {"data -1, 100", "02000000 ff64", "00000002 ff64"},
                   });
}

TEST(GoldenMessages, Odometry) {
  expect_both_ways(
      "nav_msgs/Odometry",
      {
          {"stamp.sec 1", "01000000", "00000001"},
          {"stamp.nanosec 2", "02000000", "00000002"},
          {"frame_id 'odom'", "05000000 6f646f6d00", "00000008 efbbbf 6f646f6d 00"},
          {"child_frame_id 'base'", "000000 05000000 6261736500", "00000008 efbbbf 62617365 00"},
          {"pose.pose.position.x 1.0", "000000 000000000000f03f", "3ff0000000000000"},
          {"pose.pose.position.y 2.0", "0000000000000040", "4000000000000000"},
          {"pose.pose.position.z 3.0", "0000000000000840", "4008000000000000"},
          {"pose.pose.orientation.x 0.0", "0000000000000000", "0000000000000000"},
          {"pose.pose.orientation.y 0.0", "0000000000000000", "0000000000000000"},
          {"pose.pose.orientation.z 0.5", "000000000000e03f", "3fe0000000000000"},
          {"pose.pose.orientation.w 1.0", "000000000000f03f", "3ff0000000000000"},
          {"pose.covariance 36 x 0.25", times(36, "000000000000d03f"), times(36, "3fd0000000000000")},
          {"twist.twist.linear.x 4.0", "0000000000001040", "4010000000000000"},
          {"twist.twist.linear.y 0.0", "0000000000000000", "0000000000000000"},
          {"twist.twist.linear.z 0.0", "0000000000000000", "0000000000000000"},
          {"twist.twist.angular.x 0.0", "0000000000000000", "0000000000000000"},
          {"twist.twist.angular.y 0.0", "0000000000000000", "0000000000000000"},
          {"twist.twist.angular.z -0.5", "000000000000e0bf", "bfe0000000000000"},
          {"twist.covariance 36 x 1.5", times(36, "000000000000f83f"), times(36, "3ff8000000000000")},
      });
}

TEST(GoldenMessages, Imu) {
  expect_both_ways(
      "sensor_msgs/Imu",
      {
          {"stamp.sec 1", "01000000", "00000001"},
          {"stamp.nanosec 2", "02000000", "00000002"},
          {"frame_id 'imu'", "04000000 696d7500", "00000007 efbbbf 696d75 00"},
          {"orientation.x 0.0", "0000000000000000", "0000000000000000"},
          {"orientation.y 0.5", "000000000000e03f", "3fe0000000000000"},
          {"orientation.z 0.0", "0000000000000000", "0000000000000000"},
          {"orientation.w 1.0", "000000000000f03f", "3ff0000000000000"},
          {"orientation_covariance[0] -1.0", "000000000000f0bf", "bff0000000000000"},
          {"orientation_covariance 8 x 0.0", times(8, "0000000000000000"), times(8, "0000000000000000")},
          {"angular_velocity.x 0.25", "000000000000d03f", "3fd0000000000000"},
          {"angular_velocity.y -2.0", "00000000000000c0", "c000000000000000"},
          {"angular_velocity.z 0.0", "0000000000000000", "0000000000000000"},
          {"angular_velocity_covariance 9 x 1.5", times(9, "000000000000f83f"), times(9, "3ff8000000000000")},
          {"linear_acceleration.x 0.0", "0000000000000000", "0000000000000000"},
          {"linear_acceleration.y 0.0", "0000000000000000", "0000000000000000"},
          {"linear_acceleration.z 9.8125", "0000000000a02340", "4023a00000000000"},
          {"linear_acceleration_covariance 9 x 2.0", times(9, "0000000000000040"),
           times(9, "4000000000000000")},
      });
}

TEST(GoldenMessages, MagneticField) {
  expect_both_ways("sensor_msgs/MagneticField",
                   {
                       {"stamp.sec 1", "01000000", "00000001"},
                       {"stamp.nanosec 2", "02000000", "00000002"},
                       {"frame_id 'magnet'", "07000000 6d61676e657400", "0000000a efbbbf 6d61676e6574 00"},
                       {"magnetic_field.x 0.5", "0000000000 000000000000e03f", "3fe0000000000000"},
                       {"magnetic_field.y -1.0", "000000000000f0bf", "bff0000000000000"},
                       {"magnetic_field.z NaN", "000000000000f87f", "7ff8000000000000"},
                       {"covariance 9 x 0.25", times(9, "000000000000d03f"), times(9, "3fd0000000000000")},
                   });
}

TEST(GoldenMessages, NavSatFix) {
  expect_both_ways(
      "sensor_msgs/NavSatFix",
      {
          {"stamp.sec 1", "01000000", "00000001"},
          {"stamp.nanosec 2", "02000000", "00000002"},
          {"frame_id 'gps'", "04000000 67707300", "00000007 efbbbf 677073 00"},
          {"status.status -1", "ff", "ff"},
          {"status.service 259", "00 0301", "0103"},
          {"latitude 48.5", "00000000 0000000000404840", "4048400000000000"},
          {"longitude 11.5", "0000000000002740", "4027000000000000"},
          {"altitude 520.0", "0000000000408040", "4080400000000000"},
          {"position_covariance 9 x 4.0", times(9, "0000000000001040"), times(9, "4010000000000000")},
          {"position_covariance_type 2", "02", "02"},
      });
}

TEST(GoldenMessages, LaserScan) {
  expect_both_ways("sensor_msgs/LaserScan",
                   {
                       {"stamp.sec 1", "01000000", "00000001"},
                       {"stamp.nanosec 2", "02000000", "00000002"},
                       {"frame_id 'laser'", "06000000 6c6173657200", "00000009 efbbbf 6c61736572 00"},
                       {"angle_min -0.5", "0000 000000bf", "bf000000"},
                       {"angle_max 0.5", "0000003f", "3f000000"},
                       {"angle_increment 1.0", "0000803f", "3f800000"},
                       {"time_increment 0.0625", "0000803d", "3d800000"},
                       {"scan_time 0.125", "0000003e", "3e000000"},
                       {"range_min 0.25", "0000803e", "3e800000"},
                       {"range_max 30.0", "0000f041", "41f00000"},
                       {"ranges, 2", "02000000", "00000008"},
                       {"12.5", "00004841", "41480000"},
                       {"infinity", "0000807f", "7f800000"},
                       {"intensities, 0", "00000000", "00000000"},
                   });
}

TEST(GoldenMessages, Joy) {
  expect_both_ways("sensor_msgs/Joy",
                   {
                       {"stamp.sec 1", "01000000", "00000001"},
                       {"stamp.nanosec 2", "02000000", "00000002"},
                       {"frame_id 'joy'", "04000000 6a6f7900", "00000007 efbbbf 6a6f79 00"},
                       {"axes, 2", "02000000", "00000008"},
                       {"0.5", "0000003f", "3f000000"},
                       {"-1.0", "000080bf", "bf800000"},
                       {"buttons, 3", "03000000", "0000000c"},
                       {"1", "01000000", "00000001"},
                       {"256", "00010000", "00000100"},
                       {"-2", "feffffff", "fffffffe"},
                   });
}

TEST(GoldenMessages, JointState) {
  // Two names of 4 + 5 and 4 + 9 bytes in the payload. The sequence `effort` needs no padding before its
  // number.
  expect_both_ways("sensor_msgs/JointState",
                   {
                       {"stamp.sec 1", "01000000", "00000001"},
                       {"stamp.nanosec 2", "02000000", "00000002"},
                       {"frame_id ''", "01000000 00", "00000004 efbbbf 00"},
                       {"name, 2 in 22 bytes", "000000 02000000", "00000016"},
                       {"'a'", "02000000 6100", "00000005 efbbbf 61 00"},
                       {"'elbow'", "0000 06000000 656c626f7700", "00000009 efbbbf 656c626f77 00"},
                       {"position, 2", "0000 02000000", "00000010"},
                       {"0.5", "00000000 000000000000e03f", "3fe0000000000000"},
                       {"-1.0", "000000000000f0bf", "bff0000000000000"},
                       {"velocity, 0", "00000000", "00000000"},
                       {"effort, 1", "01000000", "00000008"},
                       {"3.0", "0000000000000840", "4008000000000000"},
                   });
}

TEST(GoldenMessages, BatteryState) {
  expect_both_ways("sensor_msgs/BatteryState",
                   {
                       {"stamp.sec 1", "01000000", "00000001"},
                       {"stamp.nanosec 2", "02000000", "00000002"},
                       {"frame_id ''", "01000000 00", "00000004 efbbbf 00"},
                       {"voltage 12.5", "000000 00004841", "41480000"},
                       {"temperature 25.0", "0000c841", "41c80000"},
                       {"current -2.5", "000020c0", "c0200000"},
                       {"charge NaN", "0000c07f", "7fc00000"},
                       {"capacity 100.0", "0000c842", "42c80000"},
                       {"design_capacity 4.0", "00008040", "40800000"},
                       {"percentage 0.75", "0000403f", "3f400000"},
                       {"power_supply_status 2", "02", "02"},
                       {"power_supply_health 1", "01", "01"},
                       {"power_supply_technology 3", "03", "03"},
                       {"present true", "01", "01"},
                       {"cell_voltage, 2", "02000000", "00000008"},
                       {"4.125", "00008440", "40840000"},
                       {"3.5", "00006040", "40600000"},
                       {"cell_temperature, 0", "00000000", "00000000"},
                       {"location 'bay'", "04000000 62617900", "00000007 efbbbf 626179 00"},
                       {"serial_number '7'", "02000000 3700", "00000005 efbbbf 37 00"},
                   });
}

TEST(GoldenMessages, Image) {
  expect_both_ways("sensor_msgs/Image",
                   {
                       {"stamp.sec 1", "01000000", "00000001"},
                       {"stamp.nanosec 2", "02000000", "00000002"},
                       {"frame_id 'cam'", "04000000 63616d00", "00000007 efbbbf 63616d 00"},
                       {"height 1", "01000000", "00000001"},
                       {"width 2", "02000000", "00000002"},
                       {"encoding 'rgb8'", "05000000 7267623800", "00000008 efbbbf 72676238 00"},
                       {"is_bigendian 0", "00", "00"},
                       {"step 6", "0000 06000000", "00000006"},
                       {"data, 6", "06000000", "00000006"},
                       {"red, blue", "ff0000 0000ff", "ff0000 0000ff"},
                   });
}

TEST(GoldenMessages, CompressedImage) {
  expect_both_ways("sensor_msgs/CompressedImage",
                   {
                       {"stamp.sec 1", "01000000", "00000001"},
                       {"stamp.nanosec 2", "02000000", "00000002"},
                       {"frame_id 'cam'", "04000000 63616d00", "00000007 efbbbf 63616d 00"},
                       {"format 'jpeg'", "05000000 6a70656700", "00000008 efbbbf 6a706567 00"},
                       {"data, 4", "000000 04000000 ffd8ffd9", "00000004 ffd8ffd9"},
                   });
}

TEST(GoldenMessages, CameraInfo) {
  expect_both_ways("sensor_msgs/CameraInfo",
                   {
                       {"stamp.sec 1", "01000000", "00000001"},
                       {"stamp.nanosec 2", "02000000", "00000002"},
                       {"frame_id 'cam'", "04000000 63616d00", "00000007 efbbbf 63616d 00"},
                       {"height 480", "e0010000", "000001e0"},
                       {"width 640", "80020000", "00000280"},
                       {"distortion_model 'plumb_bob'", "0a000000 706c756d625f626f6200",
                        "0000000d efbbbf 706c756d625f626f62 00"},
                       {"d, 5", "0000 05000000", "00000028"},
                       {"5 x 0.5", "00000000" + times(5, "000000000000e03f"), times(5, "3fe0000000000000")},
                       {"k 9 x 2.0", times(9, "0000000000000040"), times(9, "4000000000000000")},
                       {"r 9 x -1.0", times(9, "000000000000f0bf"), times(9, "bff0000000000000")},
                       {"p 12 x 1.5", times(12, "000000000000f83f"), times(12, "3ff8000000000000")},
                       {"binning_x 1", "01000000", "00000001"},
                       {"binning_y 2", "02000000", "00000002"},
                       {"roi.x_offset 3", "03000000", "00000003"},
                       {"roi.y_offset 4", "04000000", "00000004"},
                       {"roi.height 5", "05000000", "00000005"},
                       {"roi.width 6", "06000000", "00000006"},
                       {"roi.do_rectify true", "01", "01"},
                   });
}

}  // namespace
}  // namespace trestle::messages::golden_messages_test
