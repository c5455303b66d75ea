#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/carry/config/load.hpp"
#include "bridge/cli/terminal.hpp"

namespace trestle::carry {

/// Loads a configuration for a command. Problems and warnings are printed on standard error, as
/// "FILE:LINE:COLUMN: error: ..." with the line and a mark below the place.
/// @return nothing when there was any error: the caller ends with exit_usage.
[[nodiscard]] std::optional<Loaded> load_or_explain(const std::string& file);

/// Tells who gives interface descriptions in place of a configuration so, and prints the configuration for
/// all of them together on standard output.
/// @param files  what is left is no description.
/// @return whether there was any.
bool explain_descriptions(std::vector<std::string>& files);

/// Likewise, where nobody expects more: all files are interface descriptions, and standard output is a file.
/// @return whether the configuration was printed.
bool save_configuration(const std::vector<std::string>& files);

/// What is to be said of a type that a configuration names, for load_config().
[[nodiscard]] TypeVerdict verdict_on(const TypeUse& use, const messages::MessageRules& rules,
                                     const messages::TypePlaces& places);

/// How problems are printed.
/// @param problems  of one file.
/// @param text  of that file; without it only the messages are given.
[[nodiscard]] std::string explain(const std::vector<documents::Problem>& problems, std::string_view text,
                                  const cli::Colours& colours);

}  // namespace trestle::carry
