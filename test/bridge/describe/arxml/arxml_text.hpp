// What tests of the ARXML reader and writer share.
#pragma once
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/describe/read/arxml/arxml.hpp"

namespace trestle::describe {

inline constexpr std::string_view arxml_head =
    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
    "<AUTOSAR xmlns=\"http://autosar.org/schema/r4.0\" "
    "xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" "
    "xsi:schemaLocation=\"http://autosar.org/schema/r4.0 AUTOSAR_00051.xsd\">";

/// Elements in the package /P of a file.
inline std::string arxml(std::string_view elements) {
  return std::string{arxml_head} + "<AR-PACKAGES><AR-PACKAGE><SHORT-NAME>P</SHORT-NAME><ELEMENTS>" +
         std::string{elements} + "</ELEMENTS></AR-PACKAGE></AR-PACKAGES></AUTOSAR>";
}

inline constexpr std::string_view base_types = R"(
<SW-BASE-TYPE><SHORT-NAME>u16</SHORT-NAME><BASE-TYPE-SIZE>16</BASE-TYPE-SIZE><BASE-TYPE-ENCODING>NONE</BASE-TYPE-ENCODING></SW-BASE-TYPE>
<SW-BASE-TYPE><SHORT-NAME>s32</SHORT-NAME><BASE-TYPE-SIZE>32</BASE-TYPE-SIZE><BASE-TYPE-ENCODING>2C</BASE-TYPE-ENCODING></SW-BASE-TYPE>
)";

inline std::string props(std::string_view inner) {
  return "<SW-DATA-DEF-PROPS><SW-DATA-DEF-PROPS-VARIANTS><SW-DATA-DEF-PROPS-CONDITIONAL>" +
         std::string{inner} +
         "</SW-DATA-DEF-PROPS-CONDITIONAL></SW-DATA-DEF-PROPS-VARIANTS></SW-DATA-DEF-PROPS>";
}

inline std::string service(std::string_view inner) {
  return "<SERVICE-INTERFACE><SHORT-NAME>Door</SHORT-NAME>" + std::string{inner} + "</SERVICE-INTERFACE>";
}

inline std::string event(std::string_view name, std::string_view type) {
  return "<VARIABLE-DATA-PROTOTYPE><SHORT-NAME>" + std::string{name} + "</SHORT-NAME><TYPE-TREF DEST=\"X\">" +
         std::string{type} + "</TYPE-TREF></VARIABLE-DATA-PROTOTYPE>";
}

/// Reads texts as files "0.arxml", "1.arxml" …
inline Reading read_texts(const std::vector<std::string>& texts, const ArxmlOptions& options = {}) {
  std::vector<std::istringstream> streams;
  streams.reserve(texts.size());
  std::vector<ArxmlInput> inputs;
  for (const std::string& text : texts) {
    streams.emplace_back(text);
    inputs.push_back({std::to_string(inputs.size()) + ".arxml", streams.back()});
  }
  return read_arxml(inputs, options);
}

/// All problems, a line each.
inline std::string problems_of(const Reading& reading) {
  std::string text;
  for (const documents::Problem& problem : reading.problems) {
    text += documents::to_string(problem) + "\n";
  }
  return text;
}

}  // namespace trestle::describe
