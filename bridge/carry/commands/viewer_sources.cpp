#include "bridge/carry/commands/viewer_sources.hpp"

#include <optional>
#include <stdexcept>
#include <utility>

#include "bridge/carry/runtime/route_parts.hpp"

namespace trestle::carry {
namespace {

std::optional<console::RouteView> view_of(const RouteTitle& title, const Bridge& bridge,
                                          messages::TypeLibrary& types) {
  const Route* const route = bridge.route(title.id);
  if (route == nullptr) {
    return std::nullopt;
  }
  auto ros = types.resolve(route->type);
  auto payload = types.resolve(route->mapping ? route->mapping->payload.text : route->type);
  if (!ros || !payload) {
    return std::nullopt;
  }
  try {
    return console::RouteView{title, std::move(*ros), std::move(*payload), route->rules,
                              compile(*route, types)};
  } catch (const std::runtime_error&) {
    return std::nullopt;  // the route would not have begun
  }
}

}  // namespace

console::ViewerSources viewer_sources(std::function<Bridge*()> bridge,
                                      std::function<messages::TypeLibrary&()> types) {
  return {.titles =
              [bridge] {
                Bridge* const now = bridge();
                return now == nullptr ? std::vector<RouteTitle>{} : now->titles();
              },
          .view =
              [bridge, types = std::move(types)](const RouteTitle& title) {
                Bridge* const now = bridge();
                return now == nullptr ? std::nullopt : view_of(title, *now, types());
              },
          .follow =
              [bridge](std::uint64_t id, MessageSink sink) {
                Bridge* const now = bridge();
                return now == nullptr ? nullptr : now->follow(id, std::move(sink));
              }};
}

}  // namespace trestle::carry
