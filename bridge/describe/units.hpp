#pragma once
#include <string>

#include "bridge/describe/model.hpp"

namespace trestle::describe {

/// What a number is measured in, "km/h": the value says it, or else its type, or that of its elements. Empty:
/// nobody says.
[[nodiscard]] std::string measured_in(const Model& model, const Value& value);
/// The same without a look at the elements of an array: for callers that ask about these separately.
[[nodiscard]] std::string measured_as_whole_in(const Model& model, const Value& value);

}  // namespace trestle::describe
