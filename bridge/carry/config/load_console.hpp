#pragma once
#include <yaml-cpp/yaml.h>

#include <string>

#include "bridge/carry/config/load.hpp"
#include "bridge/documents/format.hpp"
#include "bridge/documents/problems.hpp"

namespace trestle::carry {

/// "127.0.0.1:9464", "[::1]:9464", or an address alone.
[[nodiscard]] documents::Format<Endpoint> console_address();

/// What is wrong with it; empty: nothing.
[[nodiscard]] std::string fault_of(const ConsoleSettings& console);

/// Why nothing can be written there now, with the place in `file`, the configuration; empty: it can, or
/// nothing shall be.
[[nodiscard]] std::string fault_of(const ConsoleRecords& records, const std::string& file);

/// Reads `console`.
/// @param file  the configuration's, from whose folder relative paths are meant.
void load_console(const YAML::Node& node, const std::string& file, ConsoleSettings& into,
                  ConsoleRecords& records, documents::Problems& problems);

}  // namespace trestle::carry
