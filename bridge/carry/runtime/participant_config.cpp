#include "bridge/carry/runtime/participant_config.hpp"

#include "bridge/carry/config/ros_environment.hpp"

namespace trestle::carry {

dds::ParticipantConfig participant_config(const DdsSettings& settings) {
  dds::ParticipantConfig config = settings;
  config.enclave = settings.security.enclave;
  config.gid_bytes = gid_bytes(settings.ros_distro);
  config.security_folder = security_folder(settings.security);
  return config;
}

}  // namespace trestle::carry
