#pragma once
#include <string>
#include <vector>

#include "bridge/describe/model.hpp"

namespace trestle::describe {

/// What a target cannot carry, "element: what" each.
inline std::vector<std::string> lines_of(const std::vector<NotCarried>& lost) {
  std::vector<std::string> lines;
  lines.reserve(lost.size());
  for (const NotCarried& one : lost) {
    lines.push_back(one.element + ": " + one.what);
  }
  return lines;
}

}  // namespace trestle::describe
