#include "bridge/carry/runtime/ways_back.hpp"

#include <algorithm>

#include "bridge/carry/runtime/bridge_mark.hpp"

namespace trestle::carry {
namespace {

// An event is taken from a topic by a reader; a method is carried on by writing requests.
constexpr bool by_reader = false;
constexpr bool by_writer = true;

}  // namespace

WaysBack::WaysBack(const BridgeConfig& config) {
  for (const Route& route : config.routes) {
    if (route.direction == Direction::someip_to_dds) {
      ours_[{route.service, route.instance}].emplace_back(route.event, by_reader);
    }
  }
  for (const MethodRoute& method : config.methods) {
    if (method.server == Server::someip) {
      ours_[{method.service, method.instance}].emplace_back(method.method, by_writer);
    }
  }
}

void WaysBack::look(const DdsSide& dds) {
  const std::uint64_t changes = dds.bridge_changes();
  if (changes == seen_) {
    return;
  }
  seen_ = changes;
  theirs_.clear();
  for (const dds::BridgeEnd& end : dds.bridge_ends({})) {
    const auto mark = parse_bridge_mark(end.text);
    if (mark && mark->to_someip != end.writer) {
      theirs_.emplace(mark->address, Service{mark->service, mark->instance}, End{mark->id, end.writer});
    }
  }
}

bool WaysBack::are_known(const DdsSide& dds, const sd::RemoteService& service) {
  const Service id{service.service, service.instance};
  const auto ours = ours_.find(id);
  const auto& at = service.udp ? service.udp : service.tcp;
  if (ours == ours_.end() || !at) {
    return true;  // nothing of it comes here
  }
  look(dds);
  return std::ranges::all_of(ours->second, [&](const End& end) {
    return theirs_.contains(std::tuple{at->address, id, end});
  });
}

}  // namespace trestle::carry
