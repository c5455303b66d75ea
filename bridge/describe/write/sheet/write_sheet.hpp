#pragma once
#include "bridge/describe/model.hpp"
#include "bridge/describe/write/written.hpp"

namespace trestle::describe {

/// Writes an interface sheet for people: "interfaces.md" in Markdown, and the same as one HTML file that
/// needs nothing else, "interfaces.html". It has services with ids and instances, eventgroups, the byte
/// layout of each payload, and all types.
[[nodiscard]] Written write_sheet(const Model& model);

}  // namespace trestle::describe
