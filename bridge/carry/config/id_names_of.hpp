#pragma once
#include "bridge/describe/model.hpp"
#include "bridge/picture/id_names.hpp"

namespace trestle::carry {

/// What a model calls the ids of its services.
[[nodiscard]] IdNames id_names_of(const describe::Model& model);

}  // namespace trestle::carry
