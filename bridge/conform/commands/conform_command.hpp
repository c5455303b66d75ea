// bridge/conform/commands: `trestle conform` and `trestle fuzz`.
//
//   conform_command.hpp   run, list, explain, selftest
//   profile_command.hpp   profile: a first profile, from the sources of `trestle generate`
//   profile_writer.hpp    what that profile says
//   replay_command.hpp    replay: verdicts from a capture
//   results_commands.hpp  diff, matrix: what was run before
//   result_output.hpp     results on the terminal, and as files
//   fuzz_command.hpp      `trestle fuzz`
//   device_options.hpp    --dut and what else every command is told of a device
//
// What is done stands in bridge/conform; here are the command line and what is printed.
#pragma once
#include "bridge/generate/source_options.hpp"

namespace trestle::conform {

/// Adds `trestle conform`. Exit status: 0 when no case failed, 1 when one did or could not be judged, 2 when
/// the command line or the profile is wrong.
void add_conform_command(CLI::App& app, int& status, const generate::SourceReaders& readers);

}  // namespace trestle::conform
