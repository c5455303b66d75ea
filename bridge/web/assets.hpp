#pragma once
#include <optional>
#include <span>
#include <string_view>

#include "bridge/web/server.hpp"

namespace trestle::web {

/// A file of bridge/web/assets.
struct Asset {
  std::string_view name;  ///< "look.css", "generate/page.js"
  std::string_view text;
};

[[nodiscard]] std::span<const Asset> assets();

/// The answer to a request for one of them, "/look.css". Nothing: there is none of that name. Nothing else is
/// ever looked at.
[[nodiscard]] std::optional<Answer> asset_answer(std::string_view path);

}  // namespace trestle::web
