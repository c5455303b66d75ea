#pragma once

namespace CLI {
class App;
}

namespace trestle::bridge {

/// Adds `trestle perf`: docs/tools.md describes it.
void add_perf_command(CLI::App& app, int& status);

}  // namespace trestle::bridge
