#pragma once
#include <span>
#include <string_view>

namespace trestle::web {

/// A file of bridge/web/assets.
struct Asset {
  std::string_view name;  ///< "look.css", "generate/page.js"
  std::string_view text;
};

[[nodiscard]] std::span<const Asset> assets();

}  // namespace trestle::web
