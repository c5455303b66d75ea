#pragma once

namespace CLI {
class App;
}

namespace trestle::measure {

/// Adds `trestle demo`, and the commands that its publisher and subscriber run, which are not shown in the
/// help.
void add_demo_commands(CLI::App& app, int& status);

}  // namespace trestle::measure
