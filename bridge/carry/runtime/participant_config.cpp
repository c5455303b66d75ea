#include "bridge/carry/runtime/participant_config.hpp"

#include "bridge/carry/config/ros_environment.hpp"

namespace trestle::carry {

dds::ParticipantConfig participant_config(const DdsSettings& settings) {
  dds::ParticipantConfig config;
  config.domain = settings.domain.value_or(0);
  config.name = "trestle";
  config.interfaces = settings.interfaces;
  config.shared_memory = settings.shared_memory;
  config.lease = settings.lease;
  config.node = settings.node;
  config.enclave = settings.security.enclave;
  config.gid_bytes = gid_bytes(settings.ros_distro);
  config.profiles_file = settings.profiles;
  config.profile = settings.profile;
  config.discovery_servers = settings.discovery_servers;
  config.security_folder = security_folder(settings.security);
  config.strict_types = settings.strict_types;
  config.frees_samples = true;
  return config;
}

}  // namespace trestle::carry
