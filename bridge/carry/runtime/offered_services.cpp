#include "bridge/carry/runtime/offered_services.hpp"

#include <algorithm>

#include "bridge/carry/runtime/pacing.hpp"

namespace trestle::carry {

OfferedService& offered_service(std::vector<OfferedService>& services, const sd::ServiceSpec& wanted,
                                documents::Mark mark) {
  const auto service = std::ranges::find_if(services, [&](const OfferedService& offered) {
    return offered.spec.service == wanted.service && offered.spec.instance == wanted.instance;
  });
  return service == services.end() ? services.emplace_back(OfferedService{wanted, mark, false}) : *service;
}

void add_event(std::vector<OfferedService>& services, const Route& route) {
  OfferedService& service = offered_service(services,
                                            {.service = route.service,
                                             .instance = route.instance,
                                             .major = route.major,
                                             .minor = route.minor,
                                             .udp_port = {}},
                                            route.mark);
  service.while_there |= route.presence.offer_while_published;
  if (route.transport == Transport::tcp) {
    service.spec.tcp_port = route.port;
    service.spec.tcp_events.push_back(route.event);
  } else {
    service.spec.udp_port = route.port;
  }
  auto& groups = service.spec.eventgroups;
  auto group = std::ranges::find(groups, route.eventgroup, &sd::EventgroupSpec::id);
  if (group == groups.end()) {
    group = groups.insert(group, {.id = route.eventgroup});
  }
  if (route.multicast) {
    group->multicast = route.multicast->group;
    group->multicast_threshold = route.multicast->threshold;
  }
  group->events.push_back(route.event);
  service.spec.waits.push_back(
      {.id = route.event,
       .rule = {.most = std::max<std::size_t>(1, route.qos.depth), .keep_oldest = route.qos.keep_all}});
  if (route.e2e) {
    service.spec.e2e.push_back(
        {.id = route.event, .protect = route.e2e->profile, .payload_only = route.e2e->payload_only});
  }
  // Late subscribers get the last value, as late readers do; none while the topic is not latched.
  if (route.qos.transient_local || route.qos.durability_as_published) {
    service.spec.fields.push_back({.notifier = route.event,
                                   .differs = [](ByteView, ByteView) { return true; },
                                   .pacing = pacing_of(route.tp)});
  }
}

}  // namespace trestle::carry
