#pragma once
#include <string>

#include "bridge/cli/terminal.hpp"
#include "bridge/config/bridge_config.hpp"

namespace trestle::bridge {

/// What a configuration does, for people: a table of the routes, then what they have in common.
[[nodiscard]] std::string summary(const BridgeConfig& config, const Colours& colours);

/// "2 routes, 1 method"
[[nodiscard]] std::string count_of_all(const BridgeConfig& config);

}  // namespace trestle::bridge
