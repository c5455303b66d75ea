#include "bridge/carry/runtime/shared_subscription.hpp"

#include <fmt/format.h>

#include <set>

#include "sd/net/discovery_text.hpp"

namespace trestle::carry {

std::string share_with_routes(const std::vector<const Route*>& routes, sd::SubscribeSpec& wish) {
  std::set<std::uint16_t> ports;
  std::set<std::uint16_t> ports_of_group;
  const bool wants_tcp_alone = wish.tcp && !wish.udp;
  for (const Route* const one : routes) {
    if (one->direction != Direction::someip_to_dds || one->service != wish.service ||
        one->instance != wish.instance) {
      continue;
    }
    ports.insert(one->port);
    if (one->eventgroup != wish.eventgroup) {
      continue;
    }
    const std::string what =
        fmt::format("a route subscribes to eventgroup {} of {} version {}",
                    sd::hexadecimal(someip::value(one->eventgroup)),
                    sd::to_string(one->service, one->instance), sd::version_text(one->major, one->minor));
    if (one->presence.subscribe_while_read) {
      return what + " while somebody reads it, and would miss initial values: read its topic " + one->topic;
    }
    if (one->major != wish.major) {
      return what + ": subscribe to that";
    }
    const bool first = ports_of_group.empty();
    wish.minor = one->minor;
    wish.udp = one->transport == Transport::udp || (!first && wish.udp);
    wish.tcp = one->transport == Transport::tcp || (!first && wish.tcp);
    ports_of_group.insert(one->port);
  }
  const std::set<std::uint16_t>& those = ports_of_group.empty() ? ports : ports_of_group;
  if (those.size() > 1 && !wants_tcp_alone) {
    return fmt::format("routes receive events of {} at several ports, where they would come twice",
                       sd::hexadecimal(someip::value(wish.service)));
  }
  if (!those.empty() && (wish.udp || !ports_of_group.empty())) {
    wish.port = *those.begin();
  }
  return {};
}

}  // namespace trestle::carry
