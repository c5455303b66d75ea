#pragma once
#include "bridge/messages/types/type_source.hpp"

namespace trestle::messages {

/// The definitions compiled in: common_interfaces (std_msgs, geometry_msgs, sensor_msgs, nav_msgs and so on),
/// rcl_interfaces, tf2_msgs and unique_identifier_msgs of ROS 2 Jazzy.
class BuiltinSource : public TypeSource {
 public:
  [[nodiscard]] tl::expected<std::optional<InterfaceMessages>, TypeError> find(
      const InterfaceName& interface) const override;
};

}  // namespace trestle::messages
