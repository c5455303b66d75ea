#pragma once
#include "bridge/cli/options.hpp"

namespace trestle::inspect {

/// What the commands that offer a service have in common.
struct ServiceArguments {
  cli::NetworkOptions network;
  cli::PayloadOptions payload;
  cli::TransportOptions transport;
  std::string service;
  unsigned major = 1;
  std::uint32_t minor = 0;
  double timeout_s = 0;
  bool quiet = false;

  void add_to(CLI::App& command);
  /// The service without its methods and events.
  [[nodiscard]] sd::ServiceSpec spec() const;
};

}  // namespace trestle::inspect
