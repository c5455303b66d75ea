#include "dds_adapter/ros_names.hpp"

#include <gtest/gtest.h>

namespace trestle::dds {
namespace {

TEST(RosNames, PutTopicsUnderRt) {
  EXPECT_EQ(ros_topic_name("/points"), "rt/points");
  EXPECT_EQ(ros_topic_name("points"), "rt/points");
  EXPECT_EQ(ros_topic_name("/front/lidar/points"), "rt/front/lidar/points");
}

TEST(RosNames, SpellTypesAsRosidlDoes) {
  EXPECT_EQ(ros_type_name("sensor_msgs/msg/PointCloud2"), "sensor_msgs::msg::dds_::PointCloud2_");
  EXPECT_EQ(ros_type_name("sensor_msgs/PointCloud2"), "sensor_msgs::msg::dds_::PointCloud2_");
  EXPECT_EQ(ros_type_name("example_interfaces/srv/AddTwoInts_Request"),
            "example_interfaces::srv::dds_::AddTwoInts_Request_");
}

TEST(RosNames, LeaveDdsTypeNamesAlone) {
  EXPECT_EQ(ros_type_name("HelloWorld"), "HelloWorld");
}

}  // namespace
}  // namespace trestle::dds
