#include "bridge/carry/commands/ros_graph.hpp"

#include <stdexcept>
#include <string>

#include "bridge/carry/config/ros_environment.hpp"
#include "bridge/cli/session.hpp"

namespace trestle::carry {

std::vector<dds::FoundWriter> listen_to_ros(std::optional<std::uint32_t> domain, double seconds) {
  DdsSettings settings;
  settings.domain = domain.value_or(0);
  settings.has_domain = domain.has_value();
  if (const std::string fault = apply_ros_environment(settings, process_environment()); !fault.empty()) {
    throw std::runtime_error{fault};
  }
  dds::ParticipantConfig config;
  config.domain = settings.domain;
  config.name = "trestle generate";
  config.discovery_servers = settings.discovery_servers;
  config.security_folder = security_folder(settings.security);
  config.enclave = settings.security.enclave;
  const dds::Participant participant{config};
  cli::Session session{seconds};
  session.run();
  return participant.writers();
}

}  // namespace trestle::carry
