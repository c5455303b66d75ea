#pragma once
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bridge/describe/allocate.hpp"
#include "bridge/describe/edits.hpp"
#include "bridge/describe/lower.hpp"
#include "bridge/describe/member_names.hpp"
#include "bridge/describe/model.hpp"

namespace trestle::describe {

/// A system's interfaces, complete: read, joined, edited, with an id for everything.
struct System {
  Model model{};
  Lowered lowered{};
  std::vector<documents::Problem> problems{};
  std::map<std::string, std::string> renamed{};  ///< Edited::renamed
  bool good = false;                             ///< no problem is an error
};

struct SystemOptions {
  LowerOptions lower{};
  Edits edits{};
  bool lowers = true;     ///< false: System::lowered stays empty, if nobody needs it
  bool allocates = true;  ///< false: ids that nobody gave stay open
};

/// Makes a system of what was read.
/// @param lock  ids that were chosen before; new ones are added.
[[nodiscard]] System make_system(Reading reading, IdLock& lock, const SystemOptions& options = {});

}  // namespace trestle::describe
