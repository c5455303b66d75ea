#pragma once
#include <optional>
#include <vector>

#include "bridge/describe/model.hpp"

namespace trestle::describe::fidl_writing {

/// The model with other types in the place of enumerations that declare no enumerators, which Franca refuses:
/// one that extends another has the enumerators of that one, and one that has none at all is the integer that
/// is on the wire. The bytes stay the same.
/// @param lost  gets a line for each.
/// @return nothing if the model has no such enumeration.
[[nodiscard]] std::optional<Model> with_enumerators(const Model& model, std::vector<NotCarried>& lost);

}  // namespace trestle::describe::fidl_writing
