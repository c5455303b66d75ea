#pragma once
#include <memory>
#include <utility>
#include <vector>

#include "bridge/carry/runtime/route_context.hpp"
#include "bridge/carry/runtime/route_parts.hpp"
#include "bridge/carry/runtime/routes.hpp"
#include "bridge/carry/runtime/start_at.hpp"

namespace trestle::carry {

/// All that a configuration has, in its order. Compiles the conversions.
/// @param context  outlives the routes.
/// @throws std::runtime_error  with the place in the configuration.
[[nodiscard]] std::vector<MadeRoute> make_routes(const RouteContext& context, const BridgeConfig& config,
                                                 messages::TypeLibrary& types);

/// What a kind of routes is given to make all of its kind. Each kind is a file `X_to_Y.cpp`, which defines
/// `void X_to_Y(RouteMaker&)`; make_routes.cpp has a line with its name.
struct RouteMaker {
  const RouteContext& context;  ///< outlives the routes
  const BridgeConfig& config;
  messages::TypeLibrary& types;
  std::vector<MadeRoute> made{};

  /// @param items  of the configuration. @param make  makes the route of one; nothing: it is of another kind.
  template <typename Items, typename Make>
  void each(const Items& items, const Make& make) {
    for (const auto& one : items) {
      if (std::shared_ptr<RunningRoute> route = start_at(config, one.mark, [&] { return make(one); })) {
        made.push_back({one.mark, std::move(route)});
      }
    }
  }
};

}  // namespace trestle::carry
