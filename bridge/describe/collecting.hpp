#pragma once
#include <chrono>
#include <string_view>

#include "bridge/describe/model.hpp"

namespace trestle::describe {

/// How long messages may wait for others where a deployment of CommonAPI does not say it.
inline constexpr std::chrono::milliseconds usual_retention{5};

/// What a target without these times does not carry, of a service as a whole.
inline constexpr std::string_view usual_collecting =
    "that messages wait up to 5 ms for others, as CommonAPI has it where nobody says otherwise";

/// Whether messages wait for others, or come no faster than at a rate.
[[nodiscard]] inline bool is_collected(const Transfer& transfer) {
  return transfer.debounce.count() != 0 || transfer.retention.count() != 0;
}

/// Whether they wait as long as those of which nobody wrote anything.
[[nodiscard]] inline bool is_usual_collecting(const Transfer& transfer) {
  return transfer.debounce.count() == 0 && transfer.retention == usual_retention;
}

}  // namespace trestle::describe
