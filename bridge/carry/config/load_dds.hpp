#pragma once
#include <yaml-cpp/yaml.h>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/documents/format.hpp"
#include "bridge/documents/problems.hpp"

namespace trestle::carry {

/// As ROS_DISCOVERY_SERVER has them: "10.0.0.1:11811;;host", where no server has the number 1.
[[nodiscard]] documents::Format<std::vector<dds::DiscoveryServer>> discovery_servers();

/// Reads `dds`: changes what it speaks of.
/// @param file  the configuration's, from whose folder relative paths are meant.
void load_dds(const YAML::Node& node, const std::string& file, DdsSettings& into,
              documents::Problems& problems);

}  // namespace trestle::carry
