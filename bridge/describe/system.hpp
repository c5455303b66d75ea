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
  struct Member {
    std::optional<std::uint16_t> id{};  ///< of a method or event
    std::optional<std::uint16_t> getter{};
    std::optional<std::uint16_t> setter{};
    std::optional<std::uint16_t> notifier{};
  };
  std::optional<std::uint16_t> id{};
  std::optional<std::uint16_t> instance{};
  std::map<std::string, Member, std::less<>> members{};
};
/// By the full name of the service.
using Edits = std::map<std::string, ServiceEdit, std::less<>>;

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
