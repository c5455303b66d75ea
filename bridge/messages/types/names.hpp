#pragma once
#include <string>
#include <string_view>

/// What ROS 2 allows as names.
namespace trestle::messages {

/// "/points", "/sensing/lidar/top": absolute, tokens of letters, digits and '_' that don't begin with a
/// digit.
[[nodiscard]] bool is_topic_name(std::string_view name);
/// The same but for the length, as a regular expression of ECMAScript.
inline constexpr const char* topic_name_pattern = "^(/[A-Za-z_][A-Za-z0-9_]*)+$";

/// "sensor_msgs/msg/PointCloud2": a package, "msg", and a message.
[[nodiscard]] bool is_type_name(std::string_view name);

/// "std_srvs/srv/SetBool": a package, "srv", and a service.
[[nodiscard]] bool is_service_type_name(std::string_view name);

/// "nav2_msgs/action/NavigateToPose": a package, "action", and an action.
[[nodiscard]] bool is_action_type_name(std::string_view name);

/// The names of types of a kind, "msg", "srv" or "action", as a regular expression of ECMAScript.
[[nodiscard]] std::string name_pattern(const std::string& kind);

}  // namespace trestle::messages
