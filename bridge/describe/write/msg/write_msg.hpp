// bridge/describe/write/msg: ROS 2 packages of a model's types, which colcon builds.
//
//   write_msg.hpp  the whole writer. bridge/describe/msg_text.cpp makes the text of one definition, and
//                  bridge/describe/lower.hpp the ROS definitions of a model.
//
// ROS nodes need these packages to use the topics and services of a bridge whose routes come from
// descriptions.
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
