#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bridge/describe/model.hpp"
#include "bridge/describe/read/source_text.hpp"
#include "bridge/messages/types/type_library.hpp"

/// Services made of what ROS 2 has. A ROS type says nothing of services, so that one is made of each: of a
/// message with an event, of a service with a method, of an action with its three methods and two events.
namespace trestle::describe {

/// Something in ROS that a service is made of.
struct RosInterface {
  std::string type;     ///< "pkg/msg/Type", "pkg/srv/Type", "pkg/action/Type", "pkg/Type"
  std::string name{};   ///< of the topic, service or action, "/points"; empty: as the type
  std::string place{};  ///< that it was read from, for messages; empty: the type
  /// Only its type is wanted where another one of the list has it in itself.
  bool only_if_unused = false;
};

/// The services, without ids, and all types.
/// @return with an error for each type that is not known or has a fault.
[[nodiscard]] Reading describe_ros(std::span<const RosInterface> interfaces, messages::TypeLibrary& library);

/// The folder with the package that such a file is of, among others; nothing: it has no name of a ROS type.
[[nodiscard]] std::optional<std::string> ros_package_folder(const SourceText& file);

/// Where such a file is in a folder of packages: "pkg/msg/Type.msg"; nothing: it has no name of a ROS type.
[[nodiscard]] std::optional<std::string> ros_file_path(const SourceText& file);

/// Those of `.msg`, `.srv`, `.action` and `.idl` files. "…/pkg/msg/Type.msg" is pkg/msg/Type; a file in
/// another folder is of the package that is named like that folder. Types that they are made of are looked
/// for among the files, in the packages beside them, in AMENT_PREFIX_PATH, and among those that are compiled
/// in.
///
/// @param folders  with more packages, asked before those.
/// @param look_beside  whether there is a look at the packages beside them.
///
/// Comments directly above a field of a `.msg`, `.srv` or `.action` file, or behind it, are the description
/// of the member that is made of it.
///
/// A service is made of each message that no other one of the files has in it.
[[nodiscard]] Reading read_ros_files(std::span<const SourceText> files,
                                     const std::vector<std::string>& folders = {}, bool look_beside = true);

}  // namespace trestle::describe
