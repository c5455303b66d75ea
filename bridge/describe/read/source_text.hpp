// bridge/describe/read: readers of interface descriptions. Each makes a model of texts, and reports errors
// with file, line and column.
//
//   source_text.hpp  a file as readers get it, and how they ask for the files that it imports
//   problems.hpp     errors and warnings of a reader, and how many it reports at most
//   fidl/            Franca's FIDL and FDEPL
//   arxml/           AUTOSAR's ARXML, Adaptive and Classic
//   vsomeip/         vsomeip's JSON
//
// A file may be hostile: every reader limits its memory, time and recursion. bridge/describe/sources picks
// the reader for a file.
#pragma once
#include <functional>
#include <string>
#include <tl/expected.hpp>

namespace trestle::describe {

/// A file as readers get it.
struct SourceText {
  std::string name;  ///< as people know it: "fidl/Door.fidl"; in problems, and where imports start from
  std::string text;
};

/// Loads a file that another one names: its text, or why there is none.
using Load = std::function<tl::expected<std::string, std::string>(const std::string& name)>;

}  // namespace trestle::describe
