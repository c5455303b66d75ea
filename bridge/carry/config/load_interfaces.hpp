#pragma once
#include <yaml-cpp/yaml.h>

#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/documents/problems.hpp"
#include "bridge/messages/types/type_library.hpp"
#include "bridge/picture/id_names.hpp"

namespace trestle::carry {

/// What became of the descriptions.
struct AppliedInterfaces {
  /// False: they are not good, and what the rest of the file says of them cannot be judged.
  bool good = true;
  bool tells_of_routes = false;                ///< why there may be no route is among the errors
  std::optional<documents::Mark> generated{};  ///< of all that `generate` made
  IdNames names{};                             ///< that the descriptions give
};

/// Whether it is an interface description that is there: some take it for a configuration. FIDL and ARXML are
/// known by their names, vsomeip JSON by its text.
[[nodiscard]] bool is_description(const std::string& file);
/// The configuration that such files need, in lines. It names FIDL and FDEPL files beside them, too.
/// @return what is wrong with them, or why no route comes out of them, and no warning alone.
[[nodiscard]] tl::expected<std::string, std::vector<documents::Problem>> configuration_for(
    const std::vector<std::string>& descriptions);

/// Uses the interface descriptions that a configuration names:
///
///     interfaces: [car.arxml, Door.fidl, Door.fdepl]    from the folder of the configuration
///     generate: all                                      a route for everything in them; or a mapping with
///                                                        `services`, `side`, `prefix`, `from_bridges`
///     routes:
///       - {someip: Door.moved, topic: /door, direction: someip_to_dds}
///
/// Each `someip` is replaced by the keys that the description knows and the file does not give: ids, type,
/// version, transport, port, tp, wire and e2e. What `generate` makes joins the lists of the file, but for
/// members that a `someip` names: the file's entry is taken. Each node that is made has the mark of the
/// `someip` or `generate` that it is made for.
/// @param root   of the configuration; changed so that the loaders of the lists find ordinary entries.
/// @param file   the configuration's, from whose folder paths are meant.
/// @param types  get the types of the descriptions.
/// @param of_interfaces  what is wrong with the descriptions.
[[nodiscard]] AppliedInterfaces apply_interfaces(YAML::Node& root, const std::string& file,
                                                 messages::TypePlaces& types, documents::Problems& problems,
                                                 std::vector<documents::Problem>& of_interfaces);

}  // namespace trestle::carry
