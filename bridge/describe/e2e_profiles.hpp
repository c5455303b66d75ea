#pragma once
#include <cstddef>
#include <span>

#include "someip/core/e2e/config.hpp"

namespace trestle::describe {

/// A profile of E2E protection, as configurations and descriptions name it.
struct E2eProfile {
  const char* name;              ///< "4m"
  someip::e2e::Config settings;  ///< with the defaults of the profile
  std::size_t header_bytes;
  bool is_for_methods = false;  ///< it tells requests from answers
};

/// All of them, those of methods last.
[[nodiscard]] std::span<const E2eProfile> e2e_profiles() noexcept;
/// Of these settings.
[[nodiscard]] const E2eProfile& e2e_profile(const someip::e2e::Config& settings) noexcept;

}  // namespace trestle::describe
