#pragma once
#include <functional>

#include "bridge/carry/runtime/bridge.hpp"
#include "bridge/console/viewers.hpp"
#include "bridge/messages/types/type_library.hpp"

namespace trestle::carry {

/// What viewers see of a bridge.
/// @param bridge  null: there is none now.
/// @param types   of the bridge; asked on its thread.
[[nodiscard]] console::ViewerSources viewer_sources(std::function<Bridge*()> bridge,
                                                    std::function<messages::TypeLibrary&()> types);

}  // namespace trestle::carry
