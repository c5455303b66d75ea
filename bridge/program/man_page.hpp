#pragma once
#include <CLI/CLI.hpp>
#include <string>

namespace trestle::program {

/// "trestle-conform-run.1"
[[nodiscard]] std::string man_page_name(const CLI::App& command);

/// What `--help` of a command says, as a page of the manual.
/// @param version  of the program: "trestle 1.2.0".
[[nodiscard]] std::string man_page(const CLI::App& command, const std::string& version);

}  // namespace trestle::program
