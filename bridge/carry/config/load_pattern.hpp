#pragma once
#include <yaml-cpp/yaml.h>
#include "bridge/carry/config/bridge_config.hpp"

#include <map>
#include <string>

#include "bridge/documents/problems.hpp"

namespace trestle::carry {

/// A pattern as it was read, which may be incomplete; as RouteInFile.
struct PatternInFile {
  TopicPattern pattern;
  std::map<std::string, documents::Mark, std::less<>> good;
};

/// Reads one element of `patterns`.
[[nodiscard]] PatternInFile load_pattern(const YAML::Node& node, documents::Problems& problems);

}  // namespace trestle::carry
