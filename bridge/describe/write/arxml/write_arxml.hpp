// bridge/describe/write/arxml: writes a model as ARXML of the Adaptive Platform.
//
//   write_arxml.hpp  start here: a model becomes a file
//   writer.hpp       the writer; its parts are in types.cpp, wire.cpp, services.cpp and instances.cpp
//   xml.hpp          text of elements, in packages
#pragma once
#include <string>
#include <vector>

#include "bridge/describe/model.hpp"

namespace trestle::describe {

/// A file of ARXML, and what of the model is not in it.
struct ArxmlFile {
  std::string text;
  std::vector<NotCarried> not_carried{};
};

/// The model as ARXML of the Adaptive Platform, schema AUTOSAR_00051. The same model gives the same text; no
/// element has a UUID. read/arxml reads back what is not listed as not carried. docs/describe_arxml.md tells
/// in which packages things are.
[[nodiscard]] ArxmlFile write_arxml(const Model& model);

}  // namespace trestle::describe
