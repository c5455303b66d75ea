#pragma once
#include <string>

#include "bridge/describe/model.hpp"
#include "bridge/describe/sources/sources.hpp"

namespace trestle::carry {

/// The services that a route file tells of: those whose events are routes, and what its methods and fields
/// call or offer, with the wire rules that they have there. Names follow from those of topics: the event of
/// "/car/door/moved" is Door.moved. Interfaces that the file names are read as they are.
[[nodiscard]] describe::Reading describe_routes(const std::string& file);

/// Where the types of a route file are, seen from the working directory. Nothing of a file that cannot be
/// read.
[[nodiscard]] describe::TypeOrigins types_of_routes(const std::string& file);

}  // namespace trestle::carry
