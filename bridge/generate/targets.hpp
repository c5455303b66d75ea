#pragma once
#include <span>
#include <string_view>

#include "bridge/describe/system.hpp"
#include "bridge/describe/write/routes/write_routes.hpp"
#include "bridge/describe/write/written.hpp"

namespace trestle::generate {

struct TargetOptions {
  describe::RouteFileOptions routes{};
};

/// Something that a system can be written as.
struct Target {
  std::string_view name;   ///< as in --to: "routes"
  std::string_view title;  ///< for people: "Route file of `trestle bridge`"
  describe::Written (*write)(const describe::System& system, const TargetOptions& options);
  bool needs_lowered = false;  ///< uses describe::System::lowered
};

[[nodiscard]] std::span<const Target> targets();
/// Null: there is none of that name.
[[nodiscard]] const Target* target(std::string_view name);

}  // namespace trestle::generate
