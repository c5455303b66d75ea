#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <memory>

#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/terminal.hpp"
#include "bridge/tools/listener.hpp"
#include "bridge/tools/options.hpp"
#include "bridge/tools/service_table.hpp"
#include "bridge/tools/session.hpp"
#include "bridge/tools/sighting_text.hpp"
#include "bridge/tools/tool_commands.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::bridge {
namespace {

using namespace std::chrono_literals;

constexpr Duration table_period = 500ms;
/// How long a service that is gone stays in the table.
constexpr Duration shown_after_gone = 5s;

struct Options {
  NetworkOptions network;
  double timeout_s = 0;
  std::uint64_t count = 0;
  bool json = false;
};

/// Now, in UTC with milliseconds.
std::string time_text() {
  const auto now = std::chrono::time_point_cast<std::chrono::milliseconds>(std::chrono::system_clock::now());
  return fmt::format("{:%FT%T}.{:03}Z", fmt::gmtime(std::chrono::system_clock::to_time_t(now)),
                     now.time_since_epoch().count() % 1000);
}

int watch_as_lines(const Options& options, const sd::NodeConfig& network) {
  Session session{options.timeout_s};
  std::uint64_t lines = 0;
  Listener listener{
      session.io, network, [&](const std::vector<Sighting>& sightings) {
        for (const Sighting& one : sightings) {
          if (options.count != 0 && lines == options.count) {
            return;
          }
          const std::string time = time_text();
          session.print((options.json ? to_json(one, time) : time + "  " + describe(one)) + "\n");
          if (++lines == options.count) {
            session.finish();
          }
        }
      }};
  // What expired is told within this time; the TTL of an offer is whole seconds.
  session.every(100ms, [&] {
    listener.on_time();
    listener.view().forget_gone(std::chrono::steady_clock::now() - shown_after_gone);
  });
  session.run();
  return options.count == 0 || lines == options.count ? exit_ok : exit_failure;
}

int watch_as_table(const Options& options, const sd::NodeConfig& network) {
  Session session{options.timeout_s};
  Listener listener{session.io, network, [](const std::vector<Sighting>&) {}};
  const std::string where =
      fmt::format("{} from {}", someip::to_string(Endpoint{network.multicast, network.port}),
                  someip::to_string(network.address));
  const auto draw = [&] {
    listener.on_time();
    const TimePoint now = std::chrono::steady_clock::now();
    listener.view().forget_gone(now - shown_after_gone);
    winsize window{};
    const bool known = ioctl(STDOUT_FILENO, TIOCGWINSZ, &window) == 0 && window.ws_row > 0;
    const TableSize size = known ? TableSize{window.ws_row, window.ws_col} : TableSize{};
    session.print(screen_of(listener.view(), where, now, size, colours_for(STDOUT_FILENO)));
  };
  session.print("\033[?25l");  // no cursor
  draw();
  session.every(table_period, draw);
  session.run();
  session.print("\033[?25h\n");
  return exit_ok;
}

int run(const Options& options) {
  const sd::NodeConfig network = options.network.config();
  const bool table = is_terminal(STDOUT_FILENO) && !options.json && options.count == 0;
  return table ? watch_as_table(options, network) : watch_as_lines(options, network);
}

}  // namespace

void add_watch_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("watch", "Watch what is offered and looked for on the network");
  command->footer(
      "On a terminal a live table of all services that are offered; else, and with --count, a line for "
      "everything\n"
      "that happens. It only listens, beside other SOME/IP stacks of this host. What peers send to each "
      "other alone\n"
      "(most subscriptions, all events) it cannot hear: tcpdump -U -w - | trestle decode - shows that.\n"
      "Exit status: 0; 1 when the group cannot be joined or there were less than --count lines; 2 for a "
      "wrong\n"
      "command line.\n\n"
      "Examples:\n"
      "  trestle watch\n"
      "  trestle watch --address 192.168.1.10 | tee network.log\n"
      "  trestle watch --json | jq -r 'select(.seen == \"expired\") | .service'");
  const auto options = std::make_shared<Options>();
  command->add_option("--timeout", options->timeout_s, "End after so long")
      ->type_name("SECONDS")
      ->check(CLI::PositiveNumber);
  command->add_option("--count", options->count, "End after so many lines")
      ->type_name("N")
      ->check(CLI::PositiveNumber);
  command->add_flag("--json", options->json, "Print a JSON object for each line");
  options->network.add_to(*command);
  command->callback([options, &status] { status = run(*options); });
}

}  // namespace trestle::bridge
