#include "dds_adapter/ros_names.hpp"

#include <gtest/gtest.h>

namespace trestle::dds::ros_names_test {
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
  EXPECT_EQ(ros_type_name("tf2_msgs/action/LookupTransform_SendGoal_Response"),
            "tf2_msgs::action::dds_::LookupTransform_SendGoal_Response_");
}

TEST(RosNames, AreFoundInThoseOfDds) {
  EXPECT_EQ(topic_of_ros("rt/front/lidar/points"), "/front/lidar/points");
  for (const char* const other : {"points", "rq/arm/moveRequest", "rt", "rtx/a", "ros_discovery_info", ""}) {
    EXPECT_EQ(topic_of_ros(other), std::nullopt) << other;
  }
  EXPECT_EQ(type_of_ros("sensor_msgs::msg::dds_::PointCloud2_"), "sensor_msgs/msg/PointCloud2");
  EXPECT_EQ(type_of_ros("example_interfaces::srv::dds_::AddTwoInts_Request_"),
            "example_interfaces/srv/AddTwoInts_Request");
  for (const char* const other :
       {"HelloWorld", "a::msg::B", "a::msg::dds_::B", "a/msg/dds_::B_", "a::dds_::", ""}) {
    EXPECT_EQ(type_of_ros(other), std::nullopt) << other;
  }
}

TEST(RosNames, MakeTwoTopicsOfAService) {
  EXPECT_EQ(ros_request_topic("/arm/move"), "rq/arm/moveRequest");
  EXPECT_EQ(ros_reply_topic("/arm/move"), "rr/arm/moveReply");
  EXPECT_EQ(ros_request_topic("move"), "rq/moveRequest");
}

TEST(RosNames, LeaveDdsTypeNamesAlone) {
  EXPECT_EQ(ros_type_name("HelloWorld"), "HelloWorld");
}

}  // namespace
}  // namespace trestle::dds::ros_names_test
