#pragma once
#include <set>
#include <string>

#include "bridge/cli/options.hpp"
#include "sd/net/proxy.hpp"

namespace trestle::inspect {

/// Notices offers of a service in other major versions than the one that is wanted, which a Node does not
/// mention: so that the user learns of a wrong --major.
class OtherVersions {
 public:
  /// @param quiet  nothing is printed on standard error.
  OtherVersions(sd::Node& node, const cli::ServiceArgument& service, unsigned wanted, bool quiet);

  /// Says that nobody offers the service, and which other major versions are offered.
  [[nodiscard]] std::string nobody_offers() const;

 private:
  unsigned wanted_;
  std::set<unsigned> told_;
  sd::Proxy all_;
};

}  // namespace trestle::inspect
