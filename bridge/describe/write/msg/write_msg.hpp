#pragma once
#include "bridge/describe/lower.hpp"
#include "bridge/describe/write/written.hpp"

namespace trestle::describe {

/// ROS 2 packages that colcon builds, with a `.msg` or `.srv` file for each type of ours: "car/package.xml",
/// "car/CMakeLists.txt", "car/msg/Obstacle.msg", "car/srv/DoorOpen.srv", and one for each service that gets
/// or sets a field, "car_fields/srv/GetDoorLabel.srv". Packages whose types all come from ROS are left out. A
/// route file finds them by `types: paths` with the folder of the packages.
[[nodiscard]] Written write_msg(const Model& model, const Lowered& lowered);

}  // namespace trestle::describe
