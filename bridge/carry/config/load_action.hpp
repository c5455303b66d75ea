#pragma once
#include <yaml-cpp/yaml.h>

#include <array>

#include "bridge/carry/config/load_method.hpp"
#include "bridge/carry/config/load_route.hpp"

namespace trestle::carry {

/// A ROS action as what it is made of on both sides: three services and two topics. Incomplete as RouteInFile
/// is.
struct ActionInFile {
  std::array<MethodInFile, 3> methods;  ///< send_goal, cancel_goal, get_result
  std::array<RouteInFile, 2> routes;    ///< feedback, status
};

/// Reads one element of `actions`.
[[nodiscard]] ActionInFile load_action(const YAML::Node& node, documents::Problems& problems);

}  // namespace trestle::carry
