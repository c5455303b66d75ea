#pragma once
#include <span>
#include <string_view>

namespace trestle::messages {

/// A `.msg`, `.srv` or `.action` file of the folder builtin/, compiled in.
struct BuiltinDefinition {
  std::string_view name;  ///< "pkg/msg/Type", "pkg/srv/Name" or "pkg/action/Name"
  std::string_view text;
};

/// All of them, sorted by name.
[[nodiscard]] std::span<const BuiltinDefinition> builtin_definitions() noexcept;

}  // namespace trestle::messages
