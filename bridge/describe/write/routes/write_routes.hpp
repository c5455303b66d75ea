#pragma once
#include <optional>
#include <string>
#include <vector>

#include "bridge/describe/write/routes/route_entries.hpp"
#include "bridge/describe/write/written.hpp"

namespace trestle::describe {

struct RouteFileOptions {
  RouteOptions routes{};
  /// Of the bridge in SOME/IP; nothing: a placeholder that is to be replaced.
  std::optional<IpAddress> address{};
  /// Of service discovery; nothing: that of the model, else the default.
  std::optional<IpAddress> multicast{};
  std::string type_paths{};  ///< folder with the `.msg` packages, as the file shall name it; empty: none
  /// Descriptions that define the types, as the file shall name them: where there are no `.msg` packages.
  std::vector<std::string> interfaces{};
};

/// A route file, "bridge.yaml", with a route for each event, method and field of each instance. No file where
/// there is none: a bridge refuses one without routes.
[[nodiscard]] Written write_routes(const Model& model, const Lowered& lowered,
                                   const RouteFileOptions& options = {});

}  // namespace trestle::describe
