#pragma once
#include <vector>

#include "bridge/carry/config/bridge_config.hpp"
#include "sd/net/service_spec.hpp"

namespace trestle::carry {

/// A service to offer, and where the first of its routes and methods stands.
struct OfferedService {
  sd::ServiceSpec spec;
  documents::Mark mark;
  bool while_there = false;  ///< only while what its routes and methods need is there
};

/// The services that the routes offer: those of one service instance share an offer.
[[nodiscard]] std::vector<OfferedService> offered_services(const std::vector<Route>& routes);

/// The one of this instance; made if there is none yet.
[[nodiscard]] OfferedService& offered_service(std::vector<OfferedService>& services,
                                              const sd::ServiceSpec& wanted, documents::Mark mark);

}  // namespace trestle::carry
