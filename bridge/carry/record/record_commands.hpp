// bridge/carry/record: `trestle record` and `trestle replay`.
//
//   record_commands.hpp  start here: the commands
//   record_command.cpp   records what goes over DDS and SOME/IP
//   replay_command.cpp   sends what a file holds, in its own time
//   topic_recorder.hpp   the topics of a DDS domain; someip_recorder.hpp: SOME/IP of an interface or
//                        a capture
//
// bridge/record has the files.
#pragma once

namespace CLI {
class App;
}

namespace trestle::carry {

/// `trestle record`: writes both sides of a network to files.
void add_record_command(CLI::App& app, int& status);
/// `trestle replay`: sends again what is in such files, and in captures.
void add_replay_command(CLI::App& app, int& status);

}  // namespace trestle::carry
