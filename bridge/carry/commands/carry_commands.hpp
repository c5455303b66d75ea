// bridge/carry/commands: `trestle bridge`, `trestle check`, `trestle schema` and `trestle status`.
//
//   carry_commands.hpp  start here: the commands
//   bridge_command.cpp  runs a bridge; SIGUSR1 prints counters, SIGHUP reads the file again
//   check_command.cpp   checks configurations, and says what they would do; network_check.hpp: and find
//   schema_command.cpp  prints the JSON Schema of configurations
//   status_command.cpp  shows the bridges that run; status_text.hpp: for people
//   summary.hpp         what a configuration does, as tables
//   explain.hpp         loads a file, or explains what is wrong with it
//   field_packages.hpp  writes the ROS packages of field services
#pragma once

namespace CLI {
class App;
}

namespace trestle::carry {

/// `trestle bridge FILE.yaml`: runs the bridge until SIGINT or SIGTERM.
void add_bridge_command(CLI::App& app, int& status);
/// `trestle check FILE...`: says what is wrong with configurations, or what they would do.
void add_check_command(CLI::App& app, int& status);
/// `trestle schema`: prints what an editor has to know of configurations.
void add_schema_command(CLI::App& app, int& status);
/// `trestle status`: shows the bridges that run on this host.
void add_status_command(CLI::App& app, int& status);

}  // namespace trestle::carry
