#pragma once

namespace CLI {
class App;
}

namespace trestle::measure {

/// Adds `trestle perf`: docs/tools.md describes it.
void add_perf_command(CLI::App& app, int& status);
/// Adds `trestle demo`, and the commands that its publisher and subscriber run, which the help does not show.
void add_demo_commands(CLI::App& app, int& status);

}  // namespace trestle::measure
