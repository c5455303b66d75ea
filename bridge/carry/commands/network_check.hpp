#pragma once
#include <chrono>
#include <string>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/cli/terminal.hpp"

namespace trestle::carry {

/// What a bridge of a configuration would find now.
struct NetworkCheck {
  std::string text;     ///< a line a route: its source is there, or why not
  bool is_all = false;  ///< each route has one
};

/// Looks at both networks as the bridge would: finds services, offers and writes nothing.
/// @param patience  at most; ends as soon as all is there.
/// @throws std::runtime_error  a network cannot be joined; above all when the bridge itself runs already.
[[nodiscard]] NetworkCheck check_network(const BridgeConfig& config, std::chrono::milliseconds patience,
                                         const cli::Colours& colours);

}  // namespace trestle::carry
