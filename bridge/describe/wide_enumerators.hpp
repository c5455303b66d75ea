#pragma once
#include "bridge/describe/model.hpp"
#include "bridge/documents/problems.hpp"

namespace trestle::describe {

/// Errors: enumerators that the wire has no room for, which would be sent as others. Told where they stand;
/// where a use of the enumeration has fewer bits, there.
void tell_of_wide_enumerators(const Model& model, documents::Problems& problems);

}  // namespace trestle::describe
