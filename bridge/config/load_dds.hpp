#pragma once
#include <yaml-cpp/yaml.h>

#include "bridge/config/bridge_config.hpp"
#include "bridge/config/problems.hpp"

namespace trestle::bridge {

/// Reads `dds`: changes what it speaks of.
/// @param file  the configuration's, from whose folder relative paths are meant.
void load_dds(const YAML::Node& node, const std::string& file, DdsSettings& into, Problems& problems);

}  // namespace trestle::bridge
