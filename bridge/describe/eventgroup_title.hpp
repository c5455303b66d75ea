#pragma once
#include <string>

#include "bridge/describe/model.hpp"

namespace trestle::describe {

/// What an eventgroup is called.
struct EventgroupTitle {
  /// Its name; where it has none, what is in it: "moved, level", at most four names, then "…". Empty: the
  /// description says nothing of it.
  std::string text{};
  bool is_name = false;
};

/// @param service  null: it is not described.
[[nodiscard]] EventgroupTitle title_of(const Service* service, someip::EventgroupId eventgroup);

}  // namespace trestle::describe
