#pragma once
#include <optional>
#include <set>
#include <string>

#include "bridge/cli/options.hpp"
#include "sd/net/proxy.hpp"

namespace trestle::inspect {

/// Notices offers of a service in other major versions than the one that is wanted, which a Node does not
/// mention: so that the user learns of a wrong --major. For calls that find nobody it also knows other
/// instances, and by what the service is offered.
class OtherVersions {
 public:
  /// @param names  what services are called; null: they have no names.
  /// @param quiet  nothing is printed on standard error.
  OtherVersions(sd::Node& node, const cli::ServiceArgument& service, unsigned wanted,
                const describe::Interfaces* names, bool quiet);

  /// Says that nobody offers the service, and what is offered: other major versions, other instances, or the
  /// service but not by this transport.
  [[nodiscard]] std::string nobody_offers(std::optional<Transport> transport) const;

 private:
  [[nodiscard]] std::string name_of(const sd::RemoteService& server) const;

  cli::ServiceArgument service_;
  unsigned wanted_;
  const describe::Interfaces* names_;
  std::set<unsigned> told_;
  sd::Proxy all_;
};

}  // namespace trestle::inspect
