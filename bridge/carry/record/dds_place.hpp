#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "bridge/carry/config/bridge_config.hpp"
#include "dds_adapter/participant.hpp"

namespace CLI {
class App;
}  // namespace CLI

namespace trestle::carry {

/// --domain, for dds_place().
void add_domain(CLI::App& command, std::optional<std::uint32_t>& domain);

/// How a command joins a DDS domain: as a bridge's configuration says, else as ROS 2's environment does.
/// @param domain  of the command line, if it has one.
/// @param name    of the command, "record".
/// @throws std::runtime_error  a variable of the environment is wrong.
[[nodiscard]] dds::ParticipantConfig dds_place(const std::optional<BridgeConfig>& config,
                                               std::optional<std::uint32_t> domain, const std::string& name);

}  // namespace trestle::carry
