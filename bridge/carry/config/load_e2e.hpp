#pragma once
#include <yaml-cpp/yaml.h>
#include "bridge/carry/config/bridge_config.hpp"

#include "bridge/documents/problems.hpp"

namespace trestle::documents {
class Section;
}  // namespace trestle::documents

namespace trestle::carry {

/// Reads `e2e` of a route.
/// @param known  the route's direction, if it is good.
[[nodiscard]] std::optional<E2eSettings> load_e2e(const YAML::Node& node, std::optional<Direction> known,
                                                  documents::Problems& problems);

/// Reads `e2e` of a method.
/// @param known  its `server`, if that is good.
[[nodiscard]] std::optional<E2eSettings> load_method_e2e(const YAML::Node& node, std::optional<Server> known,
                                                         documents::Problems& problems);

/// An event or a method that a field or an action has.
struct E2ePart {
  const char* key;
  bool is_event = false;
  std::optional<E2eSettings>* into = nullptr;
};

/// Reads `e2e` of a field or an action, which has a mapping for each of its parts.
/// @param known  whose they are, if that is good.
void load_e2e_of_parts(documents::Section& section, std::optional<Server> known,
                       std::initializer_list<E2ePart> parts, documents::Problems& problems);

}  // namespace trestle::carry
