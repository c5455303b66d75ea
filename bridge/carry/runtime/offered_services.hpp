#pragma once
#include <vector>

#include "bridge/carry/config/bridge_config.hpp"
#include "sd/net/service_spec.hpp"

namespace trestle::carry {

/// A service to offer, and where the first of its routes and methods stands. Those of one service instance
/// share an offer.
struct OfferedService {
  sd::ServiceSpec spec;
  documents::Mark mark;
  bool while_there = false;  ///< only while what its routes and methods need is there
};

/// The one of this instance; made if there is none yet.
[[nodiscard]] OfferedService& offered_service(std::vector<OfferedService>& services,
                                              const sd::ServiceSpec& wanted, documents::Mark mark);

/// Adds the event of a route to SOME/IP to its service.
void add_event(std::vector<OfferedService>& services, const Route& route);

}  // namespace trestle::carry
