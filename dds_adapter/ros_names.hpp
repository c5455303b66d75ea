#pragma once
#include <optional>
#include <string>
#include <string_view>

namespace trestle::dds {

/// The name that ROS 2 gives a topic on the DDS wire: "/points" and "points" become "rt/points".
[[nodiscard]] std::string ros_topic_name(std::string_view topic);

/// The ROS name of a topic on the DDS wire: "rt/points" is "/points". Nothing: it is no topic of ROS.
[[nodiscard]] std::optional<std::string> topic_of_ros(std::string_view dds_topic);

/// The names of the two topics that a service is made of: "/add" has "rq/addRequest" and "rr/addReply".
[[nodiscard]] std::string ros_request_topic(std::string_view service);
[[nodiscard]] std::string ros_reply_topic(std::string_view service);

/// The name that ROS 2 gives a message type on the DDS wire:
/// "sensor_msgs/msg/PointCloud2" becomes "sensor_msgs::msg::dds_::PointCloud2_".
/// The short form without "msg" ("sensor_msgs/PointCloud2") means the same. A name without "/" is returned
/// as it is: it is a DDS type name already.
[[nodiscard]] std::string ros_type_name(std::string_view type);

/// The other way, with the long form: "sensor_msgs/msg/PointCloud2". Nothing: no type of ROS has this name.
[[nodiscard]] std::optional<std::string> type_of_ros(std::string_view dds_type);

/// How an endpoint tells its type's hash ("RIHS01_", 64 hexadecimal digits): in EndpointExtras::user_data.
[[nodiscard]] std::string ros_type_hash_entry(std::string_view type_hash);

/// Likewise the hash of its service, which nodes tell and show since Lyrical. Older ones pass over it.
[[nodiscard]] std::string ros_service_hash_entry(std::string_view service_hash);

/// What stands behind "key=" in user data such as "typehash=RIHS01_...;key=value;"; empty if nothing does.
[[nodiscard]] std::string_view user_data_value(std::string_view user_data, std::string_view key) noexcept;

/// Whether both user data tell of a type by its hash, and of another one each.
[[nodiscard]] bool have_other_type_hashes(std::string_view one_user_data,
                                          std::string_view other_user_data) noexcept;

}  // namespace trestle::dds
