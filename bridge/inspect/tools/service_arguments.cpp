#include "bridge/inspect/tools/service_arguments.hpp"

#include <fmt/format.h>

#include "bridge/cli/protection.hpp"
#include "bridge/cli/session.hpp"

namespace trestle::inspect {

void ServiceArguments::add_to(CLI::App& command) {
  major_option = cli::add_major(command, major);
  minor_option = cli::option(command, "--minor", minor, "N", "Minor version of the service");
  cli::add_seconds(command, "--timeout", timeout_s, "End after this time");
  cli::add_quiet(command, quiet);
  transport.add_to(command, "The service is offered");
  payload.add_to(command);
  interfaces.add_to(command, "offer, take and print by their names");
  network.add_to(command);
  tls.add_to(command);
}

cli::Target ServiceArguments::find_service() {
  interfaces.load();
  cli::Target target = cli::parse_target(interfaces.get(), service, cli::UnnamedInstance::only);
  payload.resolve(target.described.has_value());
  return target;
}

sd::ServiceSpec ServiceArguments::spec(const cli::Target& target) const {
  const bool described = target.described.has_value();
  sd::ServiceSpec spec{
      .service = target.service.service,
      .instance = target.service.instance,
      .major = described && major_option->count() == 0 ? target.major : static_cast<std::uint8_t>(major),
      .minor = described && minor_option->count() == 0 ? target.minor : minor};
  const describe::Instance* const provided =
      target.instance != nullptr && target.instance->role == describe::Instance::Role::provided
          ? target.instance
          : nullptr;
  const bool has_ports = provided != nullptr && (provided->udp_port || provided->tcp_port);
  const bool udp = transport.given() || !has_ports ? transport.udp() : provided->udp_port.has_value();
  const bool tcp = transport.given() || !has_ports ? transport.tcp() : provided->tcp_port.has_value();
  if (!udp) {
    spec.udp_port.reset();
  } else if (has_ports && provided->udp_port) {
    spec.udp_port = *provided->udp_port;
  }
  if (tcp) {
    spec.tcp_port = has_ports ? provided->tcp_port.value_or(0) : std::uint16_t{0};
  }
  return spec;
}

void ServiceArguments::protect(sd::ServiceSpec& spec, std::optional<someip::MethodId> only) const {
  if (interfaces.get() != nullptr) {
    spec.e2e = cli::protection_of_service(*interfaces.get(), spec, only);
  }
}

void ServiceArguments::serve_over_tcp(const cli::Target& target, sd::ServiceSpec& spec) const {
  if (!target.described || transport.given() || spec.tcp_port) {
    return;
  }
  for (const describe::ServiceElement* const one : interfaces.get()->elements_of(*target.described)) {
    if (!one->is_event() && one->transport == Transport::tcp) {
      spec.tcp_port = std::uint16_t{0};
      cli::Session::warn(
          fmt::format("{} goes over TCP by the description, which has no TCP port of the instance: the "
                      "system chooses one",
                      one->name));
      return;
    }
  }
}

void ServiceArguments::send_over_tcp(const std::vector<const describe::ServiceElement*>& events,
                                     sd::ServiceSpec& spec) const {
  for (const describe::ServiceElement* const event : events) {
    if (!transport.given() && event->is_event() && event->transport == Transport::tcp) {
      spec.tcp_port = spec.tcp_port.value_or(0);
      spec.tcp_events.push_back(event->id);
    }
  }
}

}  // namespace trestle::inspect
