#include "bridge/carry/record/dds_place.hpp"

#include <stdexcept>

#include "bridge/carry/config/ros_environment.hpp"

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
  return {.domain = dds.domain.value_or(0),
          .name = "trestle " + name,
          .interfaces = dds.interfaces,
          .shared_memory = dds.shared_memory,
          .lease = dds.lease,
          .node = "/trestle_" + name,
          .enclave = dds.security.enclave,
          .gid_bytes = gid_bytes(dds.ros_distro),
          .profiles_file = dds.profiles,
          .profile = dds.profile,
          .discovery_servers = dds.discovery_servers,
          .security_folder = security_folder(dds.security),
          .on_event = {}};
}

}  // namespace trestle::carry
