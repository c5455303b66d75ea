#include "bridge/carry/record/dds_place.hpp"

#include <stdexcept>

#include "bridge/carry/config/ros_environment.hpp"
#include "bridge/carry/runtime/participant_config.hpp"

namespace trestle::carry {

dds::ParticipantConfig dds_place(const std::optional<BridgeConfig>& config,
                                 std::optional<std::uint32_t> domain, const std::string& name) {
  DdsSettings dds = config ? config->dds : DdsSettings{};
  if (domain) {
    dds.domain = domain;
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
