#pragma once
#include <CLI/CLI.hpp>
#include <string>

namespace trestle::cli {

/// Adds an option whose default the help shows.
/// @param value_name  what the help calls its value: "SECONDS".
template <typename T>
CLI::Option* option(CLI::App& command, const char* name, T& value, const char* value_name, const char* what) {
  return command.add_option(name, value, what)->type_name(value_name)->capture_default_str();
}
template <typename T>
CLI::Option* option(CLI::App& command, const char* name, T& value, const char* value_name, const char* what,
                    const CLI::Validator& check) {
  return option(command, name, value, value_name, what)->check(check);
}

}  // namespace trestle::cli
