// bridge/generate: descriptions of interfaces at work.
//
//   source_options.hpp   sources on the command line
//   targets.hpp          all that it can be written as
//   capture_model.hpp    what a capture tells of a system
//   generate_commands.hpp  the commands: generate, diff
//
// docs/describe.md is the guide.
#pragma once

namespace CLI {
class App;
}

namespace trestle::generate {

/// Each stores an exit status of bridge/cli/exit_status.hpp in `status`.
void add_generate_command(CLI::App& app, int& status);
void add_diff_command(CLI::App& app, int& status);

}  // namespace trestle::generate
