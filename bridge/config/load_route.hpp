#pragma once
#include <yaml-cpp/yaml.h>

#include <map>
#include <string>

#include "bridge/config/problems.hpp"

namespace trestle::bridge {

/// A route as it was read, which may be incomplete.
struct RouteInFile {
  Route route;
  /// The keys whose values are good, and where the route says so: what is missing here must not be looked at.
  std::map<std::string, Mark, std::less<>> good;
  Mark type_mark;  ///< of the type's name itself, which may be merged in from elsewhere
};

/// Reads one element of `routes`.
[[nodiscard]] RouteInFile load_route(const YAML::Node& node, Problems& problems);

}  // namespace trestle::bridge
