#include "bridge/inspect/tools/service_arguments.hpp"

namespace trestle::inspect {

void ServiceArguments::add_to(CLI::App& command) {
  cli::add_major(command, major);
  cli::option(command, "--minor", minor, "N", "Minor version of the service");
  cli::add_seconds(command, "--timeout", timeout_s, "End after this time");
  cli::add_quiet(command, quiet);
  transport.add_to(command, "The service is offered");
  payload.add_to(command);
  network.add_to(command);
}

sd::ServiceSpec ServiceArguments::spec() const {
  const cli::ServiceArgument id = cli::parse_service(service, false);
  sd::ServiceSpec spec{.service = id.service,
                       .instance = id.instance,
                       .major = static_cast<std::uint8_t>(major),
                       .minor = minor};
  if (!transport.udp()) {
    spec.udp_port.reset();
  }
  if (transport.tcp()) {
    spec.tcp_port = 0;
  }
  return spec;
}

}  // namespace trestle::inspect
