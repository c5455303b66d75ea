// bridge/messages/types: ROS 2 message types at run time.
//
//   type_library.hpp        finds types by name in an ordered list of sources
//   type_source.hpp         a source: folders with .msg and .idl files, what is compiled in (builtin/), texts
//   message_definition.hpp  a message type as data, and the tree of all that it is made of
//   parsers.hpp             texts of .msg, .srv, .action and .idl files become definitions
//   type_hash.hpp           the hash by which ROS 2 nodes compare types
//   field_service.hpp       services made for the getters and setters of fields
//
// Knows neither wire rules nor the configuration.
#pragma once
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/messages/types/interface_name.hpp"
#include "bridge/messages/types/message_definition.hpp"
#include "bridge/messages/types/type_source.hpp"

namespace trestle::messages {

/// Messages may be nested this deep; ROS itself needs 7.
inline constexpr std::size_t max_type_depth = 32;
/// Different messages that one type may be made of.
inline constexpr std::size_t max_messages_per_type = 1024;

/// What a service's client sends, and what it gets.
struct ServiceTypes {
  TypeTree request;   ///< its root is "pkg/srv/Name_Request"
  TypeTree response;  ///< and "pkg/srv/Name_Response"
};

/// Where a user has types, besides what AMENT_PREFIX_PATH names and what is compiled in.
struct TypePlaces {
  std::vector<std::string> folders{};  ///< absolute or relative to the working directory
  TypeSources described{};             ///< of interface descriptions: asked before all others
};

/// Finds message types. Sources are asked in this order, so that what is installed wins over what is compiled
/// in:
///  1. interface descriptions (`TypePlaces::described`, of in() alone): a service's own types come first,
///  2. the given folders (FolderSource),
///  3. the prefixes in AMENT_PREFIX_PATH, which are folders, too,
///  4. the definitions compiled in (BuiltinSource),
///  5. what define() was given (MadeSource).
///
/// A file is read when the first of its messages is asked for, and then remembered: for changed files
/// make another library.
class TypeLibrary {
 public:
  /// @param folders  as above.
  /// @param ament_prefixes  what stands in AMENT_PREFIX_PATH, which see ament_prefixes().
  explicit TypeLibrary(const std::vector<std::filesystem::path>& folders = {},
                       const std::vector<std::filesystem::path>& ament_prefixes = {});
  /// With the user's places, and the prefixes in the environment's AMENT_PREFIX_PATH.
  [[nodiscard]] static TypeLibrary in(const TypePlaces& places);
  /// With these sources in place of 1 to 4.
  [[nodiscard]] static TypeLibrary of(TypeSources sources);

  /// The type and all that it is made of.
  /// @param name  "pkg/msg/Type" or "pkg/Type"; or a message of a service or of an action, as rosidl names
  ///              it: "pkg/srv/Name_Request", "pkg/action/Name_SendGoal_Response".
  /// @return the tree; or what is wrong: a name not formed like one, an unknown type (also a nested one), a
  ///         file that cannot be read or parsed, a message that contains itself, nesting beyond the limits.
  [[nodiscard]] tl::expected<TypeTree, TypeError> resolve(std::string_view name);

  /// Both messages of a service.
  /// @param name  "pkg/srv/Name" or "pkg/Name"; or a service of an action: "pkg/action/Name_SendGoal",
  ///              "pkg/action/Name_GetResult".
  [[nodiscard]] tl::expected<ServiceTypes, TypeError> resolve_service(std::string_view name);

  /// Adds an interface as if there were a file with this text. An existing file or built-in one of that name
  /// wins.
  void define(const InterfaceName& interface, std::string text);

  /// Names of the definitions compiled in, sorted: "pkg/msg/Type", "pkg/srv/Name", "pkg/action/Name".
  [[nodiscard]] static std::vector<std::string> builtin_names();

 private:
  struct Resolving;
  [[nodiscard]] tl::expected<const MessageDefinition*, TypeError> find(const std::string& name);
  [[nodiscard]] tl::expected<void, TypeError> load(const InterfaceName& interface);
  [[nodiscard]] tl::expected<std::size_t, TypeError> add(const std::string& name, Resolving& resolving);

  TypeSources sources_;
  MadeSource made_;  ///< the last source
  std::map<std::string, MessageDefinition, std::less<>> known_;
};

/// The prefixes in the environment's AMENT_PREFIX_PATH.
[[nodiscard]] std::vector<std::filesystem::path> ament_prefixes();

}  // namespace trestle::messages
