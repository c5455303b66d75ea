#pragma once
#include <map>
#include <string>

#include "bridge/carry/config/bridge_config.hpp"

namespace trestle::carry {

/// ROS packages with the services that are made for fields, field_service_name(): what ROS nodes need to call
/// them.
/// @return texts by their files, "std_msgs_fields/srv/GetFloat64.srv"; nothing when no service is made.
[[nodiscard]] std::map<std::string, std::string> field_packages(const BridgeConfig& config);

/// Writes them into a folder, which is made if it is not there; files that are there are written anew.
/// @return what went wrong, in one line; empty: nothing.
[[nodiscard]] std::string write_field_packages(const BridgeConfig& config, const std::string& folder);

}  // namespace trestle::carry
