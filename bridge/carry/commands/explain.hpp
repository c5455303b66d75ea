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

/// Answers who gives interface descriptions in place of a configuration: prints the configuration that names
/// all of them on standard output, or what is wrong with them on standard error.
/// @param files  what is left is no description.
/// @param saves  nobody expects more, if standard output is a file and nothing is left.
/// @return the exit status; nothing: there was no description.
std::optional<int> answer_descriptions(std::vector<std::string>& files, bool saves = false);

/// What is to be said of a type that a configuration names, for load_config().
[[nodiscard]] TypeVerdict verdict_on(const TypeUse& use, const messages::MessageRules& rules,
                                     const messages::TypePlaces& places);

/// How problems are printed.
/// @param problems  of one file.
/// @param text  of that file; without it only the messages are given.
[[nodiscard]] std::string explain(const std::vector<documents::Problem>& problems, std::string_view text,
                                  const cli::Colours& colours);

}  // namespace trestle::carry
