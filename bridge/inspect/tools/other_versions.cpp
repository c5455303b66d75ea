#include "bridge/inspect/tools/other_versions.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "bridge/cli/session.hpp"
#include "sd/net/discovery_text.hpp"

namespace trestle::inspect {

OtherVersions::OtherVersions(sd::Node& node, const cli::ServiceArgument& service, unsigned wanted,
                             const describe::Interfaces* names, bool quiet)
    : service_{service},
      wanted_{wanted},
      names_{names},
      all_{
          node,
          {.service = service.service, .instance = someip::any_instance, .major = sd::any_major},
          [this, quiet](const sd::RemoteService& server, bool available) {
            const bool is_it =
                service_.instance == someip::any_instance || service_.instance == server.instance;
            if (available && is_it && server.major != wanted_ && told_.insert(server.major).second &&
                !quiet) {
              cli::Session::note(fmt::format("note: {} is offered with major version {}, not {}: see --major",
                                             name_of(server), server.major, wanted_));
            }
          }} {}

std::string OtherVersions::name_of(const sd::RemoteService& server) const {
  return names_ == nullptr
             ? sd::to_string(server.service, server.instance)
             : fmt::format("{}.0x{:04x}", names_->name_of(server.service), someip::value(server.instance));
}

std::string OtherVersions::nobody_offers(std::optional<Transport> transport) const {
  std::set<unsigned> versions;
  std::set<std::string> others;
  for (const sd::RemoteService& server : all_.available()) {
    if (service_.instance != someip::any_instance && service_.instance != server.instance) {
      others.insert(name_of(server));
    } else if (server.major != wanted_) {
      versions.insert(server.major);
    } else if (transport && !(*transport == Transport::tcp ? server.tcp : server.udp)) {
      const bool tcp = *transport == Transport::tcp;
      return fmt::format("{} is offered over {}, and not over {}, over which this call goes", name_of(server),
                         tcp ? "UDP" : "TCP", tcp ? "TCP" : "UDP");
    }
  }
  if (!versions.empty()) {
    return fmt::format("nobody offers the service with major version {}, only with {}", wanted_,
                       fmt::join(versions, ", "));
  }
  return others.empty() ? "nobody offers the service"
                        : fmt::format("nobody offers instance 0x{:04x} of the service; there is {}",
                                      someip::value(service_.instance), fmt::join(others, ", "));
}

}  // namespace trestle::inspect
