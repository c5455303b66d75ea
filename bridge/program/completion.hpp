#pragma once
#include <CLI/CLI.hpp>
#include <string>

namespace trestle::program {

/// A script by which a shell completes the commands, options and words of the program. Where a value is no
/// word of a few, files are offered if it may be one.
[[nodiscard]] std::string bash_completion(const CLI::App& app);
[[nodiscard]] std::string zsh_completion(const CLI::App& app);
[[nodiscard]] std::string fish_completion(const CLI::App& app);

}  // namespace trestle::program
