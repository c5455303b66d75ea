#pragma once
#include "bridge/describe/read/fidl/types.hpp"

namespace trestle::describe::fidl {

/// Makes the services and instances of a model, and checks them as a whole.
void make_services(Model& model, Names& names, Types& types, Problems& findings);

}  // namespace trestle::describe::fidl
