#pragma once
#include <cstddef>
#include <optional>
#include <string>

#include "bridge/describe/model.hpp"

namespace trestle::describe {

/// Where the header of E2E protection stands in a payload.
struct ProtectionHeader {
  std::size_t at = 0;     ///< bytes of the payload before it
  std::size_t bytes = 0;  ///< 0: there is no protection
  friend bool operator==(const ProtectionHeader&, const ProtectionHeader&) = default;
};

/// @return nothing: the profile is not known, its header would begin before the payload, or instances have
/// other headers.
[[nodiscard]] std::optional<ProtectionHeader> protection_header(const Protection& e2e);

/// Why there is no such header, in words: "E2E profile 9", or what is not the same in all instances.
[[nodiscard]] std::string no_header_text(const Protection& e2e);

/// What some instances have in place of it, in words: "in instance 0x0002 data_id 7". Empty: all have the
/// same.
[[nodiscard]] std::string other_instances(const Protection& e2e);

/// The first key of which the two say something else; empty: they agree. What one of them does not say is no
/// difference. Those of other instances are not compared.
[[nodiscard]] std::string first_difference(const Protection& one, const Protection& other);

}  // namespace trestle::describe
