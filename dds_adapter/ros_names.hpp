#pragma once
#include <string>
#include <string_view>

namespace trestle::dds {

/// The name that ROS 2 gives a topic on the DDS wire: "/points" and "points" become "rt/points".
[[nodiscard]] std::string ros_topic_name(std::string_view topic);

/// The name that ROS 2 gives a message type on the DDS wire:
/// "sensor_msgs/msg/PointCloud2" becomes "sensor_msgs::msg::dds_::PointCloud2_".
/// The short form without "msg" ("sensor_msgs/PointCloud2") means the same. A name without "/" is returned
/// as it is: it is a DDS type name already.
[[nodiscard]] std::string ros_type_name(std::string_view type);

}  // namespace trestle::dds
