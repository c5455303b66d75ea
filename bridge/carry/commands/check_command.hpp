#pragma once

namespace CLI {
class App;
}

namespace trestle::carry {

/// Adds `trestle check FILE...`: says what is wrong with configurations, or what they would do.
void add_check_command(CLI::App& app, int& status);

}  // namespace trestle::carry
