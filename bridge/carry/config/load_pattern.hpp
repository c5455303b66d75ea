#pragma once
#include <yaml-cpp/yaml.h>

#include <map>
#include <string>

#include "bridge/documents/problems.hpp"

namespace trestle::bridge {

/// A pattern as it was read, which may be incomplete; as RouteInFile.
struct PatternInFile {
  TopicPattern pattern;
  std::map<std::string, Mark, std::less<>> good;
};

/// Reads one element of `patterns`.
[[nodiscard]] PatternInFile load_pattern(const YAML::Node& node, Problems& problems);

}  // namespace trestle::bridge
