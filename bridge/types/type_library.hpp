#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/types/message_definition.hpp"

namespace trestle::bridge {

/// Messages may be nested this deep; ROS itself needs 7.
inline constexpr std::size_t max_type_depth = 32;
/// Different messages that one type may be made of.
inline constexpr std::size_t max_messages_per_type = 1024;

/// Finds message types. Looked at in this order, so that what is installed wins over what is compiled in:
///  1. the given folders,
///  2. the prefixes in AMENT_PREFIX_PATH,
///  3. the definitions compiled in: builtin_interfaces, std_msgs, geometry_msgs, sensor_msgs, nav_msgs and
///     tf2_msgs of ROS 2 Jazzy (of which only sensor_msgs/Range differs from Humble's).
/// In a folder, "pkg/msg/Type" is `pkg/msg/Type.msg` or `share/pkg/msg/Type.msg`.
class TypeLibrary {
 public:
  /// @param folders  as above.
  /// @param ament_prefixes  what stands in AMENT_PREFIX_PATH, which see ament_prefixes().
  explicit TypeLibrary(std::vector<std::filesystem::path> folders = {},
                       std::vector<std::filesystem::path> ament_prefixes = {});

  /// The type and all that it is made of.
  /// @param name  "pkg/msg/Type" or "pkg/Type".
  /// @return the tree; or what is wrong: a name not formed like one, an unknown type (also a nested one), a
  ///         file that cannot be read or parsed, a message that contains itself, nesting beyond the limits.
  [[nodiscard]] tl::expected<TypeTree, TypeError> resolve(std::string_view name);

  /// Names of the definitions compiled in, sorted.
  [[nodiscard]] static std::vector<std::string> builtin_names();

 private:
  struct Resolving;
  [[nodiscard]] tl::expected<const MessageDefinition*, TypeError> find(const std::string& name);
  [[nodiscard]] tl::expected<std::size_t, TypeError> add(const std::string& name, Resolving& resolving);

  std::vector<std::filesystem::path> folders_;
  std::map<std::string, MessageDefinition, std::less<>> known_;
};

/// The prefixes in the environment's AMENT_PREFIX_PATH.
[[nodiscard]] std::vector<std::filesystem::path> ament_prefixes();

}  // namespace trestle::bridge
