// bridge/describe/read/arxml: AUTOSAR's ARXML, Adaptive and Classic. docs/describe_arxml.md tells what is
// read.
//
//   vocabulary.hpp  the elements that matter; all others are skipped
//   tree.hpp        files as a compact tree of these, read in one pass with expat
//   values.hpp      numbers, times and addresses in the text of elements
//   rules.hpp       transformation properties: how wide length fields are, and where
//   types.hpp       data types
//   adaptive.hpp    service interfaces, deployments, instances and machines of the Adaptive Platform
//   classic.hpp     system descriptions of the Classic Platform
#pragma once
#include <cstddef>
#include <istream>
#include <span>
#include <string>

#include "bridge/describe/model.hpp"

namespace trestle::describe {

/// One file. `stream` is read once, from where it stands to its end.
struct ArxmlInput {
  std::string name;  ///< as it is named in problems
  std::istream& stream;
};

struct ArxmlOptions {
  /// An event id below 0x8000 of an Adaptive deployment gets bit 15, with a warning: AUTOSAR's tools write
  /// ids with and without it, and on the wire events have it. False: ids are taken as they are.
  bool set_event_bit = true;
  /// What is kept of all files together; more is an error. 4 million elements are those of files of about
  /// 200 MB in which everything is of interest, and take about 450 MB.
  std::size_t max_elements = 4'000'000;
  std::size_t max_text_bytes = 256'000'000;
  std::size_t max_name_bytes = 1000;  ///< of a SHORT-NAME, which by the schema has at most 128
  /// A tag with its attributes, a comment, a processing instruction. Some versions of expat look at it from
  /// its begin again with each piece of the file, so that without a limit time grows with its square.
  std::size_t max_tag_bytes = std::size_t{8} << 20U;
  /// Types of the model; the same one with other wire rules counts again.
  std::size_t max_types = 200'000;
  /// Of members, arguments, enumerators and errors: read/copies.hpp.
  std::size_t max_copies = 1'000'000;
  /// Of the path of an element, which each type and service has. Real ones have less than 500.
  std::size_t max_path_bytes = 4000;
};

/// What all files together say; references may go from any file to any other. Errors: XML that is broken, cut
/// or too deep, a DTD, something other than AUTOSAR 4, types that contain themselves, ids out of range.
/// Warnings: what is not by the schema but can be understood, references to what is in none of the files,
/// elements of variants. Never throws for what is in the files.
[[nodiscard]] Reading read_arxml(std::span<ArxmlInput> inputs, const ArxmlOptions& options = {});

}  // namespace trestle::describe
