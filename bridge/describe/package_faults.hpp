#pragma once
#include <string>
#include <vector>

#include "bridge/describe/lower.hpp"
#include "bridge/describe/model.hpp"

namespace trestle::describe {

/// What is wrong with the name of a ROS package that was made of descriptions.
struct PackageFault {
  std::string package;     ///< "std_msgs"
  bool is_of_ros = false;  ///< ROS 2 has a package of this name; else CMake takes no such name
  std::string what{};      ///< in words
  Place place{};           ///< of something that is in it
};

/// Each package once, in alphabetical order. Packages that were read from ROS files are theirs.
[[nodiscard]] std::vector<PackageFault> faults_of_packages(const Model& model, const Lowered& lowered);

}  // namespace trestle::describe
