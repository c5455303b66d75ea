#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/messages/types/interface_name.hpp"
#include "bridge/messages/types/message_definition.hpp"

namespace trestle::messages {

/// The messages of one interface, as parse_interface() and parse_idl() return them.
using InterfaceMessages = std::vector<MessageDefinition>;

/// Where definitions of interfaces come from: a folder, what is compiled in, an interface description. A
/// TypeLibrary asks its sources in their order. A new kind is a file of its own.
class TypeSource {
 public:
  TypeSource() = default;
  TypeSource(const TypeSource&) = default;
  TypeSource& operator=(const TypeSource&) = default;
  virtual ~TypeSource() = default;

  /// @return the messages of `interface`, among them those that rosidl makes of a service or an action;
  ///         nothing when this source does not have it, and the next one is asked; or what is wrong with it,
  ///         with file, line and column, and no other source is asked.
  [[nodiscard]] virtual tl::expected<std::optional<InterfaceMessages>, TypeError> find(
      const InterfaceName& interface) const = 0;

  /// The folder or file, for "not found in ..."; empty for what is part of the program.
  [[nodiscard]] virtual std::string place() const { return {}; }
};

using TypeSources = std::vector<std::shared_ptr<const TypeSource>>;

/// A folder of `.msg`, `.srv`, `.action` and `.idl` files. "pkg/msg/Type" is `pkg/msg/Type.msg` or
/// `share/pkg/msg/Type.msg`. Where there is an `.idl` file beside the other one, which says the same, that
/// is not looked at.
class FolderSource : public TypeSource {
 public:
  explicit FolderSource(std::filesystem::path folder) : folder_{std::move(folder)} {}

  [[nodiscard]] tl::expected<std::optional<InterfaceMessages>, TypeError> find(
      const InterfaceName& interface) const override;
  [[nodiscard]] std::string place() const override { return folder_.string(); }

 private:
  [[nodiscard]] std::filesystem::path file_of(const InterfaceName& interface) const;

  std::filesystem::path folder_;
};

/// The definitions compiled in: common_interfaces (std_msgs, geometry_msgs, sensor_msgs, nav_msgs and so on),
/// rcl_interfaces, tf2_msgs and unique_identifier_msgs of ROS 2 Jazzy.
class BuiltinSource : public TypeSource {
 public:
  [[nodiscard]] tl::expected<std::optional<InterfaceMessages>, TypeError> find(
      const InterfaceName& interface) const override;
};

/// Definitions that the program makes itself, as of the services for fields.
class MadeSource : public TypeSource {
 public:
  /// Adds an interface as if there were a file with this text.
  void define(const InterfaceName& interface, std::string text) {
    texts_.insert_or_assign(interface.full(), std::move(text));
  }

  [[nodiscard]] tl::expected<std::optional<InterfaceMessages>, TypeError> find(
      const InterfaceName& interface) const override;

 private:
  std::map<std::string, std::string, std::less<>> texts_;  ///< by full name
};

}  // namespace trestle::messages
