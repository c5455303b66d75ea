#include "bridge/carry/runtime/make_routes.hpp"

#include <algorithm>

// Declares the function of a kind, and calls it.
#define TRESTLE_ROUTES(kind) \
  void kind(RouteMaker&);    \
  kind(maker)

namespace trestle::carry {

std::vector<MadeRoute> make_routes(const RouteContext& context, const BridgeConfig& config,
                                   messages::TypeLibrary& types) {
  RouteMaker maker{context, config, types};
  TRESTLE_ROUTES(topic_to_event);
  TRESTLE_ROUTES(event_to_topic);
  TRESTLE_ROUTES(getter_to_topic);
  TRESTLE_ROUTES(method_to_service);
  TRESTLE_ROUTES(service_to_method);
  // As in the file; what begins at one place is in the order of the kinds.
  std::ranges::stable_sort(maker.made, {}, [](const MadeRoute& one) {
    return std::pair{one.mark.line, one.mark.column};
  });
  return std::move(maker.made);
}

}  // namespace trestle::carry
