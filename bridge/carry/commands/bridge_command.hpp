#pragma once

namespace CLI {
class App;
}

namespace trestle::carry {

/// `trestle bridge FILE.yaml`: runs the bridge until SIGINT or SIGTERM.
void add_bridge_command(CLI::App& app, int& status);

}  // namespace trestle::carry
