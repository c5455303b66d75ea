// bridge/describe/write/fidl: writes a model as Franca's FIDL and FDEPL files.
//
//   write_fidl.hpp  start here: a model becomes files
//   plan.hpp        which type is declared in which file, and under which name
//   deployment.hpp  what the FDEPL files say
//   enumerations.hpp  what stands for enumerations that have no enumerators
#pragma once
#include "bridge/describe/model.hpp"
#include "bridge/describe/write/written.hpp"

namespace trestle::describe {

/// Writes a model as FIDL and FDEPL files that Franca 0.13.1 and CommonAPI's generators accept, and that
/// read_fidl() reads as the same model: docs/describe_fidl.md. For each package there is a FIDL file, and a
/// FDEPL file for version 2 of CommonAPI's specification. Names that are words of FIDL or C++ get another
/// one, which an annotation explains. Services, methods and events should have their ids (allocate.hpp).
[[nodiscard]] Written write_fidl(const Model& model);

}  // namespace trestle::describe
