#include "bridge/inspect/tools/service_arguments.hpp"

#include "bridge/cli/session.hpp"

namespace trestle::inspect {

void ServiceArguments::add_to(CLI::App& command) {
  command.add_option("--major", major, "Major version of the service")
      ->type_name("N")
      ->check(CLI::Range(0, 254))
      ->capture_default_str();
  command.add_option("--minor", minor, "Minor version of the service")->type_name("N")->capture_default_str();
  command.add_option("--timeout", timeout_s, "End after this time")
      ->type_name("SECONDS")
      ->check(cli::seconds_above_zero());
  command.add_flag("-q,--quiet", quiet, "Do not report discovery");
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

sd::DiscoveryLog ServiceArguments::log() const {
  return [silent = quiet](const std::string& line) {
    if (!silent) {
      cli::Session::note(line);
    }
  };
}

}  // namespace trestle::inspect
