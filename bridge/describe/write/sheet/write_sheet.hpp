// bridge/describe/write/sheet: an interface sheet for people, in Markdown and HTML.
//
//   write_sheet.hpp  the whole writer: one pass over the model, and two forms of its tables and paragraphs
//
// The tables of bytes are those of bridge/describe/layout.hpp, which `trestle explain` prints, too.
#pragma once
#include <cstddef>

#include "bridge/describe/model.hpp"
#include "bridge/describe/write/written.hpp"

namespace trestle::describe {

/// Rows of all tables of bytes together, and paths of 64 bytes more count as another row.
inline constexpr std::size_t max_sheet_rows = 500'000;

/// Writes an interface sheet for people: "interfaces.md" in Markdown, and the same as one HTML file that
/// needs nothing else, "interfaces.html". It has services with ids and instances, eventgroups, the byte
/// layout of each payload, all types and constants. Payloads for whose bytes there is no room are told.
[[nodiscard]] Written write_sheet(const Model& model);

}  // namespace trestle::describe
