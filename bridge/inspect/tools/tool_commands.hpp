// bridge/inspect/tools: the commands for people: find, watch, call, subscribe, offer, notify.
//
//   *_command.cpp     one command each
//   service_arguments.hpp  what commands that offer a service have in common
//   other_versions.hpp     offers in other major versions than the wanted one
//   traffic_view.hpp  events and calls, with rates, losses and latencies
//   watcher.hpp, live_watch.hpp, watch_lines.hpp, picture.hpp  `watch`: from frames to tables
//   sighting_text.hpp, message_text.hpp  what is seen, in words and in JSON
//
// They listen through bridge/traffic/live. docs/tools.md describes the commands.
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
