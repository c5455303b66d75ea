#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include "bridge/carry/config/bridge_config.hpp"

namespace trestle::documents {
class Problems;
class Section;
}  // namespace trestle::documents

namespace trestle::sd {
struct NodeConfig;
}

namespace trestle::carry {

/// A limit of the SOME/IP side that a configuration may set; the name is that of the stack's own setting.
struct LimitKey {
  enum class Kind : std::uint8_t { number, bytes, time };  ///< time: in nanoseconds
  const char* name;
  std::uint64_t min;
  std::uint64_t max;
  void (*set)(sd::NodeConfig& node, std::uint64_t limit);
  Kind kind = Kind::number;
};
/// All of them, as docs/configuration.md lists them.
[[nodiscard]] std::span<const LimitKey> limit_keys() noexcept;

/// Reads `limits` of `someip`: those that are given, by name.
void load_limits(documents::Section& someip, std::map<std::string, std::uint64_t, std::less<>>& into,
                 documents::Problems& problems);

}  // namespace trestle::carry
