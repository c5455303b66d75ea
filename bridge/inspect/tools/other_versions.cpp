#include "bridge/inspect/tools/other_versions.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "bridge/cli/session.hpp"
#include "sd/net/discovery_text.hpp"

namespace trestle::inspect {

OtherVersions::OtherVersions(sd::Node& node, const cli::ServiceArgument& service, unsigned wanted, bool quiet)
    : wanted_{wanted},
      all_{node,
           {.service = service.service, .instance = service.instance, .major = sd::any_major},
           [this, quiet](const sd::RemoteService& server, bool available) {
             if (available && server.major != wanted_ && told_.insert(server.major).second && !quiet) {
               cli::Session::note(
                   fmt::format("note: {} is offered with major version {}, not {}: see --major",
                               sd::to_string(server.service, server.instance), server.major, wanted_));
             }
           }} {}

std::string OtherVersions::nobody_offers() const {
  std::set<unsigned> offered;
  for (const sd::RemoteService& server : all_.available()) {
    offered.insert(server.major);
  }
  // If the wanted version is offered, then not over the wanted protocol.
  return offered.empty() || offered.contains(wanted_)
             ? "nobody offers the service"
             : fmt::format("nobody offers the service with major version {}, only with {}", wanted_,
                           fmt::join(offered, ", "));
}

}  // namespace trestle::inspect
