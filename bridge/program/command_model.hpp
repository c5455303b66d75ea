#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

/// What the commands and options of the program say of themselves, for all that is written from them: help,
/// man pages and completion.
namespace trestle::program {

/// What the help calls the value of an option: "FILE"; empty: it has none. CLI11 adds types, ranges and
/// exclusions, which are for programmers.
[[nodiscard]] std::string value_name(const CLI::Option& option);

/// The words that the value of an option can be; empty: any.
[[nodiscard]] std::vector<std::string> value_words(const CLI::Option& option);
/// Whether the value is the name of a file or folder.
[[nodiscard]] bool is_file(const CLI::Option& option);

/// The subcommands that users see.
[[nodiscard]] std::vector<const CLI::App*> commands_of(const CLI::App& app);
/// The options, or the positional arguments, that users see.
[[nodiscard]] std::vector<const CLI::Option*> options_of(const CLI::App& app);
[[nodiscard]] std::vector<const CLI::Option*> arguments_of(const CLI::App& app);
/// "--quiet", "-q", the long names first.
[[nodiscard]] std::vector<std::string> names_of(const CLI::Option& option);
/// "trestle conform run"
[[nodiscard]] std::string full_name(const CLI::App& app);
/// The program and all its commands, each behind the one that has it.
[[nodiscard]] std::vector<const CLI::App*> all_commands(const CLI::App& app);

}  // namespace trestle::program
