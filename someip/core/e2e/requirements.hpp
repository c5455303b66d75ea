#pragma once
#include <optional>

#include "someip/core/e2e/config.hpp"

namespace trestle::someip::e2e {

/// Collects the rules of a configuration and keeps the first that is broken.
class Requirements {
 public:
  constexpr void require(bool holds, std::string_view field, std::string_view must) noexcept {
    if (!holds && !broken_) {
      broken_ = ConfigError{field, must};
    }
  }
  [[nodiscard]] constexpr const std::optional<ConfigError>& broken() const noexcept { return broken_; }

 private:
  std::optional<ConfigError> broken_;
};

}  // namespace trestle::someip::e2e
