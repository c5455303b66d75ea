#pragma once

namespace CLI {
class App;
}

namespace trestle::program {

/// `trestle completion SHELL`: prints a script by which a shell completes all commands of `app`.
void add_completion_command(CLI::App& app);
/// `trestle man`: prints or writes pages of the manual of all commands of `app`.
/// @param version  "trestle 1.2.0"
void add_man_command(CLI::App& app, int& status, const char* version);

}  // namespace trestle::program
