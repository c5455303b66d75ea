#pragma once
#include <yaml-cpp/yaml.h>

#include <string>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/documents/format.hpp"
#include "bridge/documents/problems.hpp"

namespace trestle::carry {

/// "127.0.0.1:9464", "[::1]:9464", or an address alone.
[[nodiscard]] documents::Format<Endpoint> console_address();

/// What is wrong with it; empty: nothing.
[[nodiscard]] std::string fault_of(const ConsoleSettings& console);

/// Reads `console`.
/// @param file  the configuration's, from whose folder relative paths are meant.
void load_console(const YAML::Node& node, const std::string& file, ConsoleSettings& into,
                  documents::Problems& problems);

}  // namespace trestle::carry
