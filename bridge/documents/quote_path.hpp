#pragma once
#include <string>
#include <string_view>

#include "bridge/documents/problems.hpp"

namespace trestle::documents {

/// A path, quoted for a message: printable, and in full, because its end says most.
[[nodiscard]] inline std::string quote_path(std::string_view path) {
  return "'" + printable(path) + "'";
}

}  // namespace trestle::documents
