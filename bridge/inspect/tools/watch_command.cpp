#include <unistd.h>

#include <memory>

#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/interface_options.hpp"
#include "bridge/cli/options.hpp"
#include "bridge/cli/terminal.hpp"
#include "bridge/inspect/tools/live_watch.hpp"
#include "bridge/inspect/tools/tool_commands.hpp"
#include "bridge/inspect/tools/watch_lines.hpp"
#include "pcaps/capture_file.hpp"

namespace trestle::inspect {
namespace {

using namespace std::chrono_literals;

constexpr Duration table_period = 1s;
/// Expiries are reported within this time; the TTL of an offer is in whole seconds.
constexpr Duration expiry_period = 100ms;
/// How long services that are gone, and silent traffic, stay in the table.
constexpr Duration shown_after_gone = 5s;
constexpr Duration shown_when_idle = 60s;
constexpr double once_s = 3;

struct WatchArguments {
  cli::NetworkOptions network;
  cli::InterfaceOptions interfaces;
  std::string interface;
  std::string file;
  double timeout_s = 0;
  double for_s = 0;
  double rates_s = 10;
  std::uint64_t count = 0;
  bool once = false;
  bool lines = false;
  bool json = false;

  [[nodiscard]] Duration rates() const {
    return std::chrono::duration_cast<Duration>(std::chrono::duration<double>{rates_s});
  }
  [[nodiscard]] WatchLines::Options of_lines() const { return {json, rates(), count, interfaces.get()}; }
};

/// The picture with what things are called.
Picture with_names(Picture picture, const WatchArguments& options) {
  picture.names = options.interfaces.get();
  return picture;
}

int watch_as_lines(const WatchArguments& options, const traffic::Where& where, std::uint16_t sd_port) {
  cli::Session session{options.timeout_s};
  WatchLines lines{options.of_lines(), [&](const std::string& text) { session.print(text); },
                   [&] { session.finish(); }};
  LiveWatch live{
      session, where, sd_port,
      [&](const std::vector<traffic::Sighting>& sightings, TimePoint now) { lines.tell(sightings, now); }};
  session.every(expiry_period, [&] {
    live.on_time();
    const TimePoint now = traffic::wall_clock();
    lines.tell_rates(live.seen(), now);
    live.seen().network().forget_gone(now - shown_after_gone);
    live.seen().traffic().forget_idle(now - shown_when_idle - options.rates());
  });
  session.run();
  live.check();
  return lines.enough() ? cli::exit_ok : cli::exit_failure;
}

int watch_as_table(const WatchArguments& options, const traffic::Where& where, std::uint16_t sd_port) {
  cli::Session session{options.timeout_s};
  LiveWatch live{session, where, sd_port, [](const std::vector<traffic::Sighting>&, TimePoint) {}};
  const auto draw = [&] {
    live.on_time();
    const TimePoint now = traffic::wall_clock();
    live.seen().network().forget_gone(now - shown_after_gone);
    live.seen().traffic().forget_idle(now - shown_when_idle);
    session.print(screen_of(with_names(live.picture(true), options), cli::terminal_size(STDOUT_FILENO),
                            cli::colours_for(STDOUT_FILENO)));
  };
  session.print("\033[?25l\033[2J");  // hides the cursor and clears the screen
  draw();
  session.every(table_period, draw);
  session.run();
  session.print("\033[?25h\n");
  live.check();
  return cli::exit_ok;
}

std::string summary(const WatchArguments& options, const Picture& picture) {
  return options.json ? json_of(picture) + "\n" : text_of(picture, cli::colours_for(STDOUT_FILENO));
}

int watch_for(const WatchArguments& options, const traffic::Where& where, std::uint16_t sd_port) {
  cli::Session session{options.once ? once_s : options.for_s};
  LiveWatch live{session, where, sd_port, [](const std::vector<traffic::Sighting>&, TimePoint) {}};
  session.every(expiry_period, [&] { live.on_time(); });
  session.run();
  session.print(summary(options, with_names(live.picture(false), options)));
  live.check();
  return cli::exit_ok;
}

int read_file(const WatchArguments& options, std::uint16_t sd_port) {
  std::optional<pcaps::CaptureFile> file;
  try {
    file.emplace(options.file);
  } catch (const std::runtime_error& error) {
    throw CLI::ValidationError("--read", error.what());
  }
  bool enough = false;
  const auto print = [&](const std::string& text) {
    std::fwrite(text.data(), 1, text.size(), stdout);
    enough = enough || std::fflush(stdout) != 0;
  };
  WatchLines lines{options.of_lines(), print, [&] { enough = true; }};
  const bool as_lines = options.lines || options.count != 0;
  Watcher seen{sd_port, [&](const std::vector<traffic::Sighting>& sightings, TimePoint now) {
                 if (as_lines) {
                   lines.tell(sightings, now);
                 }
               }};
  TimePoint checked{};
  while (!enough) {
    const auto frame = file->next();
    if (!frame) {
      break;
    }
    const TimePoint now{frame->time.time_since_epoch()};
    if (now - checked >= expiry_period) {
      seen.on_time(now);
      checked = now;
      if (as_lines) {
        lines.tell_rates(seen, now);
      }
    }
    seen.on_frame(*frame);
  }
  seen.finish();
  if (as_lines) {
    lines.tell_rates(seen, seen.last(), true);
  } else {
    print(summary(options, {.seen = seen,
                            .where = options.file,
                            .since = seen.first(),
                            .now = seen.last(),
                            .names = options.interfaces.get()}));
  }
  if (!file->error().empty()) {
    throw std::runtime_error{"the capture cannot be read to its end: " + file->error()};
  }
  return lines.enough() ? cli::exit_ok : cli::exit_failure;
}

int run(const WatchArguments& options) {
  const std::uint16_t sd_port = options.network.config_without_address().port;
  if (!options.file.empty()) {
    return read_file(options, sd_port);
  }
  const traffic::Where where = traffic::where_of(options.interface, options.network);
  if (options.once || options.for_s > 0) {
    return watch_for(options, where, sd_port);
  }
  const bool table = cli::is_terminal(STDOUT_FILENO) && !options.json && !options.lines && options.count == 0;
  return table ? watch_as_table(options, where, sd_port) : watch_as_lines(options, where, sd_port);
}

}  // namespace

void add_watch_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("watch", "Watch services, subscriptions and traffic on the network");
  command->footer(
      "On a terminal it shows live tables of services, subscriptions and traffic. Otherwise, and with\n"
      "--lines, --count and --json, it prints a line for each thing that happens, and for rates. It sends\n"
      "nothing, so it does not disturb other SOME/IP stacks of this host. To capture frames it needs root,\n"
      "or sudo setcap cap_net_raw+ep; without that it shows only what discovery sends by multicast.\n"
      "For traffic between programs of one host use --interface lo, or any.\n"
      "Exit status: 0; 1 when the network or a capture fails or there were less than --count lines; 2 for a\n"
      "wrong command line.\n\n"
      "Examples:\n"
      "  trestle watch\n"
      "  trestle watch --interface lo\n"
      "  trestle watch --interfaces car.arxml\n"
      "  trestle watch --for 10 > network.txt\n"
      "  trestle watch --read drive.pcapng\n"
      "  trestle watch --json | jq -r 'select(.seen == \"expired\") | .service'");
  const auto options = std::make_shared<WatchArguments>();
  CLI::Option* interface =
      cli::option(*command, "--interface", options->interface, "NAME",
                  "Network interface to capture from, or any (default: that of --address)");
  CLI::Option* file = cli::option(*command, "--read", options->file, "FILE",
                                  "Show the traffic of a capture (pcap or pcapng; - for standard input)")
                          ->excludes(interface);
  CLI::Option* timeout =
      cli::add_seconds(*command, "--timeout", options->timeout_s, "End after this time")->excludes(file);
  CLI::Option* lines =
      command->add_flag("--lines", options->lines, "Print lines even on a terminal or for a file");
  CLI::Option* count = cli::add_count(*command, options->count, "End after this many lines");
  CLI::Option* duration =
      cli::add_seconds(*command, "--for", options->for_s, "Watch for this long, then print the tables once");
  command->add_flag("--once", options->once, "The same as --for 3")
      ->excludes(duration)
      ->excludes(file)
      ->excludes(timeout)
      ->excludes(lines)
      ->excludes(count);
  duration->excludes(file)->excludes(timeout)->excludes(lines)->excludes(count);
  cli::option(*command, "--rates", options->rates_s, "SECONDS", "How often to print rates; 0: never",
              cli::number_between(0, 1e6));
  command->add_flag("--json", options->json, "JSON: an object for each line, or one with the tables");
  options->interfaces.add_to(*command, "show their names");
  options->network.add_to(*command);
  command->callback([options, &status] {
    options->interfaces.load();
    status = run(*options);
  });
}

}  // namespace trestle::inspect
