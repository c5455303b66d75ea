#pragma once

namespace CLI {
class App;
}

namespace trestle::conform {

/// Adds `replay` to `trestle conform`: verdicts from captures alone.
void add_replay_command(CLI::App& conform, int& status);

}  // namespace trestle::conform
