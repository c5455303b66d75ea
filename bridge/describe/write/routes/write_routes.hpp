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
  std::vector<std::string> type_paths{};  ///< folders with `.msg` packages, as the file shall name them
  /// Descriptions that define types, as the file shall name them: those that are in none of these folders.
  std::vector<std::string> interfaces{};
};

/// Routes, methods and fields that a bridge takes, of each.
inline constexpr std::size_t max_written_routes = 1000;

/// A route file, "bridge.yaml", with a route for each event, method and field of each instance. No file where
/// there is none: a bridge refuses one without routes.
[[nodiscard]] Written write_routes(const Model& model, const Lowered& lowered,
                                   const RouteFileOptions& options = {});

}  // namespace trestle::describe
