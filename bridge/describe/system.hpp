#pragma once
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bridge/describe/allocate.hpp"
#include "bridge/describe/lower.hpp"
#include "bridge/describe/model.hpp"

namespace trestle::describe {

/// Ids that somebody wants in place of those in the sources.
struct ServiceEdit {
  struct FieldIds {
    std::optional<std::uint16_t> getter{};
    std::optional<std::uint16_t> setter{};
    std::optional<std::uint16_t> notifier{};
    friend bool operator==(const FieldIds&, const FieldIds&) = default;
  };
  std::optional<std::uint16_t> id{};
  std::optional<std::uint16_t> instance{};  ///< of the first instance; without any one is made
  /// By member_key().
  std::map<std::string, std::uint16_t, std::less<>> methods{};
  std::map<std::string, std::uint16_t, std::less<>> events{};
  std::map<std::string, FieldIds, std::less<>> fields{};  ///< by name
  friend bool operator==(const ServiceEdit&, const ServiceEdit&) = default;
};
/// By the full name of the service.
using Edits = std::map<std::string, ServiceEdit, std::less<>>;

/// Tells methods of one service apart, and events: the name; of those that FIDL overloads, "name:selector".
[[nodiscard]] std::string member_key(const std::string& name, const std::string& selector);

/// A system's interfaces, complete: read, joined, edited, with an id for everything.
struct System {
  Model model{};
  Lowered lowered{};
  std::vector<documents::Problem> problems{};
  bool good = false;  ///< no problem is an error
};

struct SystemOptions {
  LowerOptions lower{};
  Edits edits{};
};

/// Makes a system of what was read.
/// @param lock  ids that were chosen before; new ones are added.
[[nodiscard]] System make_system(Reading reading, IdLock& lock, const SystemOptions& options = {});

}  // namespace trestle::describe
