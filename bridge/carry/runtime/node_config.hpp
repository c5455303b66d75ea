#pragma once
#include <cstdint>

#include "bridge/carry/config/bridge_config.hpp"
#include "sd/net/node_config.hpp"

namespace trestle::carry {

/// How a Node is set up for what a configuration carries: each limit has room for all of it, and for several
/// peers that want it; those that the configuration gives are as they are given.
/// @param descriptors  that the process may have: TCP clients get at most three quarters of them.
[[nodiscard]] sd::NodeConfig node_config(const BridgeConfig& config, std::size_t descriptors = SIZE_MAX);

}  // namespace trestle::carry
