#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/describe/model.hpp"

/// What changed between two descriptions of a system, and who is hurt by it.
namespace trestle::describe {

/// Who a change hurts.
enum class Impact : std::uint8_t {
  none,        ///< old and new work together
  compatible,  ///< they do, within limits that the rule tells
  breaking,    ///< they do not
};

/// A kind of change. The table of all is in change_rules.cpp.
struct ChangeRule {
  std::string_view id;  ///< "method-removed": stable, for scripts
  Impact wire;          ///< between an old and a new program in one network
  Impact api;           ///< for the source code of an application that uses the interface
  std::string_view meaning;
};

/// All rules, in the order of the documents.
[[nodiscard]] std::span<const ChangeRule> change_rules();

/// One difference.
struct Change {
  const ChangeRule* rule = nullptr;
  std::string element;  ///< "Door.open.request.angle"
  std::string before;   ///< "uint8"; empty: it was not there
  std::string after;
  Place old_place{};
  Place new_place{};
  /// Other elements of which the same is true, because they have the type, too: at most 20 uses of it.
  std::vector<std::string> also{};
};

/// Uses of types that are compared; the rest is told as one change, "not-compared".
inline constexpr std::size_t max_compared_uses = 5'000'000;

/// What an id means that one description gives and the other one does not.
enum class MissingId : std::uint8_t {
  unknown,    ///< nothing: it may be the same
  different,  ///< another id
};

/// The differences, in the order of the new model; what was removed comes last in its service. Services are
/// the same if they have the same full name, or else the same id; members by name, or else by id of the same
/// kind. Types are compared where they are used: a type that nothing uses makes no change; instances by role
/// and id, or else by name; constants by name. What one of the two does not say is no difference:
/// docs/describe.md.
[[nodiscard]] std::vector<Change> compare(const Model& before, const Model& after,
                                          MissingId missing = MissingId::unknown);

}  // namespace trestle::describe
