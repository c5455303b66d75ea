#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "bridge/carry/commands/carry_commands.hpp"
#include "bridge/carry/commands/status_text.hpp"
#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/option.hpp"
#include "bridge/cli/signals.hpp"
#include "bridge/cli/terminal.hpp"
#include "bridge/console/status_place.hpp"
#include "bridge/documents/problems.hpp"
#include "bridge/picture/picture_json.hpp"

namespace trestle::carry {
namespace {

constexpr std::chrono::seconds most_patience{3};

struct StatusOptions {
  std::string bridge;
  bool watch = false;
  bool json = false;
  bool slowest = false;
};

/// A bridge that has answered.
struct Found {
  std::string json;
  Picture picture;
};

bool is_meant(const std::string& wanted, const Picture& picture) {
  return wanted.empty() || wanted == std::to_string(picture.pid) || wanted == picture.configuration ||
         wanted == std::filesystem::path{picture.configuration}.filename();
}

/// @param faults  lines about sockets that did not answer as they should.
std::vector<Found> look(const std::string& wanted, std::vector<std::string>& faults) {
  std::vector<Found> found;
  for (const auto& socket : console::status_sockets(console::status_folders())) {
    const auto answer = console::ask(socket, most_patience);
    if (!answer) {
      if (std::string fault = told(answer.error(), socket); !fault.empty()) {
        faults.push_back(std::move(fault));
      }
      continue;
    }
    auto picture = picture_from_json(*answer);
    if (!picture) {
      faults.push_back(socket.string() + ": " + picture.error());
    } else if (is_meant(wanted, *picture)) {
      found.push_back({*answer, std::move(*picture)});
    }
  }
  return found;
}

void print_all(const StatusOptions& options, const std::vector<Found>& found, const cli::Colours& colours) {
  bool is_first = true;
  for (const Found& one : found) {
    if (options.json) {
      std::printf("%s\n", documents::printable_json(one.json).c_str());
      continue;
    }
    if (!std::exchange(is_first, false)) {
      std::fputs("\n", stdout);
    }
    std::fputs(status_text(one.picture, colours).c_str(), stdout);
    if (options.slowest) {
      std::printf("\n%s", slowest_text(one.picture, colours).c_str());
    }
  }
  std::fflush(stdout);
}

int run_status(const StatusOptions& options) {
  // Also while nobody watches, so that a pipe that is closed ends the command.
  cli::Signals signals{SIGINT, SIGTERM};
  const cli::Colours colours = cli::colours_for(STDOUT_FILENO);
  const bool redraws = options.watch && !options.json && cli::is_terminal(STDOUT_FILENO);
  for (;;) {
    std::vector<std::string> faults;
    const std::vector<Found> found = look(options.bridge, faults);
    if (redraws) {
      std::fputs("\x1b[H\x1b[2J", stdout);
    }
    print_all(options, found, colours);
    if (options.bridge.empty() || found.empty()) {  // else they are about others
      for (const std::string& one : faults) {
        std::fprintf(stderr, "%s\n", one.c_str());
      }
    }
    if (found.empty() && !(options.watch && redraws)) {
      std::fputs(options.bridge.empty() ? "no bridge runs on this host, as far as may be seen\n"
                                        : ("no bridge " + options.bridge + " runs on this host\n").c_str(),
                 stderr);
      if (!options.watch) {
        return cli::exit_failure;
      }
    }
    if (!options.watch) {
      return cli::exit_ok;
    }
    if (std::ferror(stdout) != 0) {
      return cli::exit_ok;  // who has read it has gone
    }
    pollfd readable{.fd = signals.fd(), .events = POLLIN, .revents = 0};
    ::poll(&readable, 1, 1000);
    if (signals.next()) {
      return cli::exit_ok;
    }
  }
}

}  // namespace

void add_status_command(CLI::App& app, int& status) {
  CLI::App* command =
      app.add_subcommand("status", "Show the bridges that run on this host, and why nothing flows");
  command->footer(
      "For each route: its state, messages and megabytes a second, when the last message came, how long\n"
      "conversion and path take, and what was dropped. Where nothing flows, a line says why: docs/status.md\n"
      "has all causes. Bridges of other users are shown to root.\n"
      "Exit status: 0 when a bridge answered, 1 when there is none, 2 for a wrong command line.\n\n"
      "Examples:\n"
      "  trestle status\n"
      "  trestle status --watch bridge.yaml\n"
      "  trestle status --slowest\n"
      "  trestle status --json | jq '.routes[] | select(.state != \"flowing\") | {name, cause}'");
  const auto options = std::make_shared<StatusOptions>();
  command
      ->add_option("BRIDGE", options->bridge,
                   "Only this one: its process id, or its configuration file (default: all)")
      ->type_name("");
  command->add_flag("-w,--watch", options->watch, "Show it every second, until Ctrl-C");
  command->add_flag("--json", options->json, "All that is known, a JSON object a line for each bridge");
  command->add_flag("--slowest", options->slowest,
                    "Also the slowest messages of the last minute, and what took the time");
  command->callback([options, &status] { status = run_status(*options); });
}

}  // namespace trestle::carry
