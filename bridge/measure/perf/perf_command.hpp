#pragma once

namespace CLI {
class App;
}

namespace trestle::measure {

/// Adds `trestle perf`: docs/tools.md describes it.
void add_perf_command(CLI::App& app, int& status);

}  // namespace trestle::measure
