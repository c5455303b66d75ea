#pragma once

namespace CLI {
class App;
}

namespace trestle::inspect {

// Each makes a subcommand: docs/tools.md describes them.
void add_find_command(CLI::App& app, int& status);
void add_watch_command(CLI::App& app, int& status);
void add_call_command(CLI::App& app, int& status);
void add_subscribe_command(CLI::App& app, int& status);
void add_offer_command(CLI::App& app, int& status);
void add_notify_command(CLI::App& app, int& status);

}  // namespace trestle::inspect
