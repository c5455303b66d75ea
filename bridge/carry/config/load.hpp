#pragma once
#include <functional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/picture/id_names.hpp"

namespace trestle::carry {

/// What is to be said about a message type and the rules that it is carried by. Empty: nothing.
struct TypeVerdict {
  std::string fault{};    ///< it is not known, or cannot be carried
  std::string warning{};  ///< it can be carried, but not every message of it
  /// Of a mapping of fields, and of the payload's type that it names.
  std::vector<messages::MapProblem> map{};
};

/// A type that a configuration names.
struct TypeUse {
  std::string type;  ///< a message, "sensor_msgs/msg/PointCloud2", or a service, "std_srvs/srv/SetBool"
  /// Otherwise it is the service that gets or sets a field ...
  messages::FieldAccess access = messages::FieldAccess::none;
  std::string value_type{};  ///< ... whose values are messages of this type
  /// The payload is a message of another type, for which the rules are; null: of this one.
  const messages::FieldMapping* mapping = nullptr;
  Direction direction = Direction::dds_to_someip;  ///< of a mapping
};

/// Judges a type. `places` are the folders under `types: paths` and the `interfaces`.
using TypeCheck = std::function<TypeVerdict(const TypeUse& use, const messages::MessageRules& rules,
                                            const messages::TypePlaces& places)>;

/// Where the console (`console`) may have records made: no part of the bridge itself.
struct ConsoleRecords {
  std::string folder{};  ///< absolute or relative to the working directory; empty: none may be made
  documents::Mark mark{};
};

/// A good configuration, and what its author should know about it nevertheless.
struct Loaded {
  BridgeConfig config;
  std::vector<documents::Problem> warnings;
  IdNames names{};  ///< of what its `interfaces` describe
  ConsoleRecords records{};
};

/// Reads a configuration from text, and the lock file that it names. Everything is checked, and all errors
/// are returned, in the file's order and then those of the lock file: a configuration with any error is not
/// there at all.
/// @param file  its name for messages; relative paths inside it are meant from its folder.
[[nodiscard]] tl::expected<Loaded, std::vector<documents::Problem>> parse_config(
    std::string_view text, const std::string& file, const TypeCheck& check_type = {});

/// As above, from a file; one that cannot be read is an error too.
[[nodiscard]] tl::expected<Loaded, std::vector<documents::Problem>> load_config(
    const std::string& file, const TypeCheck& check_type = {});

}  // namespace trestle::carry
