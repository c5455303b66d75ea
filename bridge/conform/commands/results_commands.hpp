#pragma once

namespace CLI {
class App;
}

namespace trestle::conform {

/// Adds `diff` and `matrix`, which compare runs that were made before, to `trestle conform`.
void add_results_commands(CLI::App& conform, int& status);

}  // namespace trestle::conform
