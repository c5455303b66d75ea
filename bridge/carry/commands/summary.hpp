#pragma once
#include <string>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/cli/terminal.hpp"
#include "bridge/picture/id_names.hpp"

namespace trestle::carry {

/// What a configuration does, for people: a table of the routes, then what they have in common.
/// @param names  a column of the tables; without any, it is left out.
[[nodiscard]] std::string summary(const BridgeConfig& config, const cli::Colours& colours,
                                  const IdNames& names = {});

/// "2 routes, 1 method"
[[nodiscard]] std::string count_of_all(const BridgeConfig& config);

}  // namespace trestle::carry
