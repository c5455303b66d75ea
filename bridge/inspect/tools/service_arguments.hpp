#pragma once
#include <optional>

#include "bridge/cli/interface_options.hpp"

namespace trestle::inspect {

/// What the commands that offer a service have in common.
struct ServiceArguments {
  cli::NetworkOptions network;
  cli::TlsOptions tls;
  cli::InterfaceOptions interfaces;
  cli::PayloadOptions payload;
  cli::TransportOptions transport;
  std::string service;
  unsigned major = 1;
  std::uint32_t minor = 0;
  CLI::Option* major_option = nullptr;
  CLI::Option* minor_option = nullptr;
  double timeout_s = 0;
  bool quiet = false;

  void add_to(CLI::App& command);
  /// Reads the descriptions, the service and the type of payloads; call once, before spec().
  [[nodiscard]] cli::Target find_service();
  /// The service without its methods and events. What the command line leaves open is that of the
  /// description.
  [[nodiscard]] sd::ServiceSpec spec(const cli::Target& target) const;
  /// Protects what the descriptions protect, or one event alone; call when all else of the service is known.
  void protect(sd::ServiceSpec& spec, std::optional<someip::MethodId> only = std::nullopt) const;
  /// Has the service offered over TCP, too, where methods of the description need it; says so if that has no
  /// port.
  void serve_over_tcp(const cli::Target& target, sd::ServiceSpec& spec) const;
  /// Has events of the description that go over TCP do so, unless the command line says how to offer.
  void send_over_tcp(const std::vector<const describe::ServiceElement*>& events, sd::ServiceSpec& spec) const;
};

}  // namespace trestle::inspect
