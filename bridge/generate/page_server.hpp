#pragma once
#include <functional>

#include "bridge/generate/page.hpp"
#include "sd/net/node_config.hpp"

namespace trestle::generate {

/// Where the page is served unless told otherwise.
inline constexpr const char* default_page_address = "127.0.0.1:8030";

/// "127.0.0.1:8030", "[::1]:8030", "8030".
/// @return nothing when it is none of these.
[[nodiscard]] std::optional<Endpoint> parse_page_address(const std::string& text);

/// Serves the page until a signal comes.
/// @param network  for calls: see PageCaller.
/// @return an exit status.
/// @throws std::runtime_error when nothing can listen there.
int serve_page(const Endpoint& at, Page::Settings settings, std::function<sd::NodeConfig()> network);

}  // namespace trestle::generate
