// bridge/describe/read/fidl: Franca's FIDL and FDEPL files. docs/describe_fidl.md tells what is read.
//
//   read_fidl.hpp   start here: files become a model
//   sources.hpp     all files that are read, with what they import
//   lexer.hpp       texts become tokens
//   cursor.hpp      walks through the tokens for both parsers
//   fidl_tree.hpp   what a FIDL file says, and its parser
//   fdepl_tree.hpp  what a FDEPL file says, and its parser
//   names.hpp       knows all that is declared and deployed
//   keys.hpp        the keys of deployments, and their values
//   types.hpp       makes the types of a model
//   services.hpp    makes its services and instances
#pragma once
#include <span>

#include "bridge/describe/model.hpp"
#include "bridge/describe/read/source_text.hpp"

namespace trestle::describe {

/// What is read of all files together, those that are imported among them.
struct FidlLimits {
  std::size_t files = 2000;
  std::size_t bytes = std::size_t{64} << 20U;
  /// Words, numbers and signs. What is made of each of them takes up to 400 bytes.
  std::size_t tokens = 5'000'000;
  std::size_t copies = 1'000'000;  ///< of fields and enumerators: read/copies.hpp
};

/// Reads FIDL and FDEPL files, and what they import: docs/describe_fidl.md.
///
/// Files that people have and Franca refuses are read with warnings where it is clear what they mean. A FIDL
/// file without deployment gives services without ids. Never throws; problems tell places, and at most 100
/// are told.
///
/// @param files  at least those that were named; what is among them is not loaded again
/// @param load   asked for imports by their names as seen from the importing file; may be empty
/// @param limits  files beyond them are an error, and then nothing is read
[[nodiscard]] Reading read_fidl(std::span<const SourceText> files, const Load& load = {},
                                const FidlLimits& limits = {});

}  // namespace trestle::describe
