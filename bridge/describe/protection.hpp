#pragma once
#include <cstddef>
#include <optional>

#include "bridge/describe/model.hpp"

namespace trestle::describe {

/// Where the header of E2E protection stands in a payload.
struct ProtectionHeader {
  std::size_t at = 0;     ///< bytes of the payload before it
  std::size_t bytes = 0;  ///< 0: there is no protection
};

/// @return nothing: the profile is not known, or its header would begin before the payload.
[[nodiscard]] std::optional<ProtectionHeader> protection_header(const Protection& e2e);

}  // namespace trestle::describe
