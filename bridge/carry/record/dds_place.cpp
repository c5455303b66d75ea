#include "bridge/carry/record/dds_place.hpp"

#include <CLI/CLI.hpp>
#include <stdexcept>

#include "bridge/carry/config/ros_environment.hpp"
#include "bridge/carry/runtime/participant_config.hpp"

namespace trestle::carry {

void add_domain(CLI::App& command, std::optional<std::uint32_t>& domain) {
  command
      .add_option("--domain", domain, "DDS domain (default: that of --config, else ROS_DOMAIN_ID, else 0)")
      ->type_name("N")
      ->check(CLI::Range(0, 232));
}

dds::ParticipantConfig dds_place(const std::optional<BridgeConfig>& config,
                                 std::optional<std::uint32_t> domain, const std::string& name) {
  DdsSettings dds = config ? config->dds : DdsSettings{};
  if (domain) {
    dds.domain = *domain;
    dds.has_domain = true;
  }
  if (!config) {  // whose loader has done this
    if (const std::string fault = apply_ros_environment(dds, process_environment()); !fault.empty()) {
      throw std::runtime_error{fault};
    }
  }
  dds::ParticipantConfig place = participant_config(dds);
  place.name = "trestle " + name;
  place.node = "/trestle_" + name;
  return place;
}

}  // namespace trestle::carry
