// bridge/conform/commands: `trestle conform`.
//
//   conform_command.hpp   run, list, explain, selftest
//   replay_command.hpp    replay: verdicts from a capture
//   result_output.hpp     results on the terminal, and as files
//   results_commands.hpp  diff, matrix: what was run before
//
// What is done stands in bridge/conform; here are the command line and what is printed.
#pragma once

namespace CLI {
class App;
}

namespace trestle::conform {

/// Adds `trestle conform`. Exit status: 0 when no case failed, 1 when one did or could not be judged, 2 when
/// the command line or the profile is wrong.
void add_conform_command(CLI::App& app, int& status);

}  // namespace trestle::conform
