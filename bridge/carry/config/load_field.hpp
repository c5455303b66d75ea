#pragma once
#include <yaml-cpp/yaml.h>

#include <optional>
#include <vector>

#include "bridge/carry/config/load_method.hpp"
#include "bridge/carry/config/load_route.hpp"

namespace trestle::carry {

/// A field as what it is made of: a latched topic that is a notifier, and services that are getter and
/// setter. Incomplete as RouteInFile is.
struct FieldInFile {
  std::optional<RouteInFile> route;   ///< if it has a notifier
  std::vector<MethodInFile> methods;  ///< getter, unless the route answers it, and setter
};

/// Reads one element of `fields`.
[[nodiscard]] FieldInFile load_field(const YAML::Node& node, documents::Problems& problems);

}  // namespace trestle::carry
