#include "bridge/measure/measure_commands.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <fstream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>

#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/interface_options.hpp"
#include "bridge/cli/session.hpp"
#include "bridge/cli/terminal.hpp"
#include "bridge/measure/perf/bridge_path.hpp"
#include "bridge/measure/perf/client.hpp"
#include "bridge/measure/perf/server.hpp"
#include "someip/net/message_sender.hpp"

namespace trestle::measure {
namespace {

using namespace std::chrono_literals;

/// The output options that all measuring commands share.
struct OutputOptions {
  bool json = false;
  bool quiet = false;
  std::string plot;

  void add_to(CLI::App& command) {
    command.add_flag("--json", json, "Print the result as JSON, and no progress");
    cli::option(command, "--plot", plot, "FILE", "Draw latency over percentile into this file (SVG)");
    command.add_flag("-q,--quiet", quiet, "Show no progress");
  }

  /// Prints the progress once a second.
  [[nodiscard]] perf::Client::Progress progress() const {
    if (json || quiet) {
      return {};
    }
    return [](const perf::Result& so_far) {
      cli::Session::note(fmt::format("{:5.1f} s  {:10.0f} /s  {:9.2f} MB/s  p50 {:>8}  p99 {:>8}  lost {}",
                                     so_far.seconds, so_far.per_second(), so_far.megabytes_per_second(),
                                     cli::duration_text(so_far.latency.percentile(50)),
                                     cli::duration_text(so_far.latency.percentile(99)), so_far.lost));
    };
  }

  void show(const perf::Result& result) const {
    std::fputs(json ? (perf::to_json(result).dump() + "\n").c_str() : perf::to_text(result).c_str(), stdout);
    if (!plot.empty()) {
      std::ofstream out{plot};
      out << perf::to_svg(result);
      if (!out.flush()) {
        throw std::runtime_error{"cannot write " + plot};
      }
    }
  }
};

/// How a program waits for the network.
struct WaitOptions {
  double busy_poll_us = 0;

  void add_to(CLI::App& command) {
    cli::option(command, "--busy-poll", busy_poll_us, "MICROSECONDS",
                "Poll for this long before waiting: quicker, but uses a core", cli::number_between(0, 1e6));
  }
  [[nodiscard]] Duration busy_poll() const {
    return std::chrono::duration_cast<Duration>(std::chrono::duration<double, std::micro>{busy_poll_us});
  }
};

struct ServerOptions {
  cli::NetworkOptions network;
  cli::InterfaceOptions interfaces;
  WaitOptions wait;
  std::string service = perf::default_service;
  double timeout_s = 0;
  bool quiet = false;
};

int serve(ServerOptions& options) {
  options.interfaces.load();
  const cli::ServiceArgument service =
      cli::parse_target(options.interfaces.get(), options.service, cli::UnnamedInstance::only).service;
  sd::NodeConfig network = options.network.config();
  network.unproven_answer_bytes = std::numeric_limits<std::size_t>::max();  // large answers are its purpose
  cli::Session session{options.timeout_s};
  sd::Node node{session.io, network, cli::Session::log(options.quiet), cli::Session::warn};
  {
    const perf::Server server{node, service.service, service.instance};
    session.run(options.wait.busy_poll());
  }
  node.shutdown();
  return cli::exit_ok;
}

void add_server(CLI::App& perf, int& status) {
  CLI::App* command = perf.add_subcommand("server", "Offer the service that 'trestle perf client' measures");
  command->footer(
      "Offers an ordinary SOME/IP service by UDP and TCP until Ctrl-C or --timeout; docs/tools.md has its\n"
      "methods and events, for other stacks to be measured against it. One client at a time gets events.\n"
      "Exit status: 0; 1 when a port is taken; 2 for a wrong command line.\n\n"
      "Examples:\n"
      "  trestle perf server\n"
      "  trestle perf server 0x7e57.2 --address 192.168.1.5");
  const auto options = std::make_shared<ServerOptions>();
  command->add_option("SERVICE.INSTANCE", options->service, "Its ids; with --interfaces its name")
      ->capture_default_str();
  cli::add_seconds(*command, "--timeout", options->timeout_s, "End after this time");
  cli::add_quiet(*command, options->quiet);
  options->wait.add_to(*command);
  options->interfaces.add_to(*command, "the service may be a name");
  options->network.add_to(*command);
  command->callback([options, &status] { status = serve(*options); });
}

/// The times that all measurements share.
struct TimeOptions {
  double seconds = 5;
  double warm_up_s = 0.2;
  double timeout_s = 5;

  void add_to(CLI::App& command, const char* timeout) {
    cli::option(command, "--seconds", seconds, "N", "How long to measure", cli::number_between(0.01, 1e6));
    cli::option(command, "--warm-up", warm_up_s, "SECONDS", "How long to warm up before that",
                cli::number_between(0, 1e3));
    cli::add_seconds(command, "--timeout", timeout_s, timeout);
  }
};

struct ClientCommand {
  cli::InterfaceOptions interfaces;
  cli::NetworkOptions network;
  WaitOptions wait;
  OutputOptions output;
  TimeOptions time;
  std::string service = perf::default_service;
  perf::ClientOptions client;
  bool tcp = false;
  double rate_hz = 0;
  std::uint32_t window = 1;
  double separation_us = std::chrono::duration<double, std::micro>{someip::TpPacing{}.separation}.count();
};

Duration seconds(double count) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>{count});
}

int measure(ClientCommand& command) {
  perf::ClientOptions options = command.client;
  command.interfaces.load();
  const cli::ServiceArgument service =
      cli::parse_target(command.interfaces.get(), command.service, cli::UnnamedInstance::any).service;
  options.service = service.service;
  options.instance = service.instance;
  options.plan.tcp = command.tcp;
  options.plan.rate_hz = command.rate_hz;
  options.plan.window = command.window;
  options.plan.separation_ns = static_cast<std::uint32_t>(command.separation_us * 1000);
  options.measured = seconds(command.time.seconds);
  options.warm_up = seconds(command.time.warm_up_s);
  options.patience = seconds(command.time.timeout_s);
  if (options.events && options.plan.bytes < perf::min_event_bytes) {
    throw CLI::ValidationError("--size", fmt::format("events have at least {} bytes", perf::min_event_bytes));
  }
  sd::NodeConfig network = command.network.config();
  // All calls in flight may wait to be sent at once, and so may their answers at the server, whose node has
  // the same limit.
  constexpr std::size_t most_beside_payload = 1024;  // what a queue counts for each besides its payload
  if (!options.events &&
      options.in_flight * (options.plan.bytes + most_beside_payload) > network.max_queued_bytes) {
    throw CLI::ValidationError(
        "--in-flight, --size",
        fmt::format("{} calls of {} bytes at a time: no more than {} bytes can wait to be sent",
                    options.in_flight, options.plan.bytes, network.max_queued_bytes));
  }
  network.timing.initial_delay_min = 0ms;
  network.timing.initial_delay_max = 0ms;
  cli::Session session{0};
  sd::Node node{session.io, network, {}, cli::Session::warn};
  std::optional<std::string> fault;
  {
    perf::Client client{node, options, command.output.progress(), [&](const std::string& why) {
                          fault = why;
                          session.finish();
                        }};
    session.run(command.wait.busy_poll());
    if (fault && fault->empty()) {
      command.output.show(client.result());
    }
  }
  node.shutdown();
  if (!fault.value_or("").empty()) {
    cli::Session::note("error: " + *fault);
  }
  return fault && fault->empty() ? cli::exit_ok : cli::exit_failure;
}

void add_client(CLI::App& perf, int& status) {
  CLI::App* command = perf.add_subcommand("client", "Measure a 'trestle perf server'");
  command->footer(
      "Finds the service, warms up, and measures: calls of its echo method, from call() to the response, or\n"
      "with --events its events, from notify() to the handler. If the two ends have different clocks, these\n"
      "are compared first, and the result says how exact that is.\n"
      "--window 1 sends an event when the one before has arrived, which measures latency. --window 0 does\n"
      "not wait for acknowledgements; with --rate 0 it sends as fast as it can, and some may be lost.\n"
      "With --rate the latency of an event counts from the time when it was due, even if it was sent late.\n"
      "Exit status: 0; 1 when there was no service or nothing came; 2 for a wrong command line.\n\n"
      "Examples:\n"
      "  trestle perf client                                        # UDP calls of 64 bytes, one after "
      "another\n"
      "  trestle perf client --tcp --in-flight 32\n"
      "  trestle perf client --events --size 1MB --separation 0     # large events, in TP segments\n"
      "  trestle perf client --events --size 4MB --window 4 --seconds 10 --json\n"
      "  trestle perf client --events --rate 1000 --window 0 --plot latency.svg");
  const auto options = std::make_shared<ClientCommand>();
  command->add_option("SERVICE.INSTANCE", options->service, "Ids of the server; with --interfaces its name")
      ->capture_default_str();
  CLI::Option* const events =
      command->add_flag("--events", options->client.events, "Measure events, not calls");
  cli::option(*command, "--size", options->client.plan.bytes, "BYTES", "Bytes of payload; 64KB, 4MB: of 1024")
      ->transform(CLI::AsSizeValue(false))
      ->check(CLI::Range(std::uint32_t{0}, perf::max_event_bytes));
  CLI::Option* const tcp = command->add_flag("--tcp", options->tcp, "Use TCP instead of UDP");
  // An option that would have no effect is refused.
  cli::option(*command, "--in-flight", options->client.in_flight, "N", "Calls at a time", CLI::Range(1, 1000))
      ->excludes(events);
  cli::option(*command, "--window", options->window, "N", "Events under way at a time; 0: no limit",
              CLI::Range(0, 1'000'000))
      ->needs(events);
  cli::option(*command, "--rate", options->rate_hz, "HZ", "Events a second; 0: as many as the window allows",
              cli::number_between(0, 1e7))
      ->needs(events);
  cli::option(*command, "--separation", options->separation_us, "MICROSECONDS",
              "Time between two bursts of segments", cli::number_between(0, 1e6))
      ->excludes(tcp);
  cli::option(*command, "--burst", options->client.plan.burst, "N",
              "Segments in a burst; 0: as many as the other end says it can take", CLI::Range(0, 10'000))
      ->excludes(tcp);
  options->time.add_to(*command, "For finding the service, and for each answer");
  options->output.add_to(*command);
  options->wait.add_to(*command);
  options->interfaces.add_to(*command, "the service may be a name");
  options->network.add_to(*command);
  command->callback([options, &status] { status = measure(*options); });
}

struct BridgeCommand {
  OutputOptions output;
  TimeOptions time;
  perf::PathOptions path;
  bool reflect = false;
};

int measure_bridge(const BridgeCommand& command) {
  perf::PathOptions options = command.path;
  options.warn = cli::Session::warn;
  if (command.reflect) {
    perf::reflect(options);
    return cli::exit_ok;
  }
  options.measured = seconds(command.time.seconds);
  options.warm_up = seconds(command.time.warm_up_s);
  options.patience = seconds(command.time.timeout_s);
  const auto result = perf::measure_path(options, command.output.progress());
  if (!result || result->received == 0) {
    cli::Session::note("error: nothing came back: is 'trestle perf bridge --reflect' at the other end?");
    return cli::exit_failure;
  }
  command.output.show(*result);
  return cli::exit_ok;
}

void add_bridge(CLI::App& perf, int& status) {
  CLI::App* command = perf.add_subcommand("bridge", "Measure a way through DDS and bridges");
  command->footer(
      "Writes PointCloud2 messages to TOPIC/there and waits for them on TOPIC/back, where 'trestle perf "
      "bridge\n"
      "--reflect' at the other end writes them. The latency is half of the round trip. With a --window of\n"
      "more than 1 it measures throughput. Between the two ends are two bridges that carry both topics, as\n"
      "in examples/perf_bridge_a.yaml and _b.yaml, or nothing: a hop of DDS alone.\n"
      "The CPU time is that of this end, without the other end and the bridges.\n"
      "Exit status: 0; 1 when nothing came back; 2 for a wrong command line.\n\n"
      "Examples:\n"
      "  trestle perf bridge --domain 92 --interface 127.0.0.1 --reflect\n"
      "  trestle perf bridge --domain 91 --interface 127.0.0.1 --size 1MB --seconds 10 --json\n"
      "  trestle perf bridge --domain 91 --interface 127.0.0.1 --size 1MB --window 4");
  const auto options = std::make_shared<BridgeCommand>();
  CLI::Option* const reflect =
      command->add_flag("--reflect", options->reflect, "Be the other end, until Ctrl-C");
  cli::option(*command, "--domain", options->path.domain, "N", "DDS domain", CLI::Range(0, 232));
  command
      ->add_option("--interface", options->path.interfaces, "Own addresses that DDS may use (default: all)")
      ->type_name("IP")
      ->allow_extra_args(false);
  command->add_flag("--shared-memory", options->path.shared_memory,
                    "Let DDS use shared memory, as the bridges' `shared_memory: true`");
  command->add_option("--topic", options->path.topic, "Before /there and /back")->capture_default_str();
  cli::option(*command, "--size", options->path.bytes, "BYTES",
              "Bytes of points, 16 each; 64KB, 4MB: of 1024")
      ->transform(CLI::AsSizeValue(false))
      ->check(CLI::Range(std::uint32_t{16}, perf::max_event_bytes));
  cli::option(*command, "--window", options->path.window, "N", "Messages under way at a time",
              CLI::Range(std::uint32_t{1}, perf::max_path_window));
  cli::option(*command, "--rate", options->path.rate_hz, "HZ",
              "Messages a second at most; 0: as many as the window allows", cli::number_between(0, 1e6));
  options->time.add_to(*command, "For the first message to come back");
  options->output.add_to(*command);
  for (const char* of_who_measures :
       {"--size", "--window", "--rate", "--seconds", "--warm-up", "--timeout", "--json", "--plot"}) {
    reflect->excludes(command->get_option(of_who_measures));
  }
  command->callback([options, &status] { status = measure_bridge(*options); });
}

}  // namespace

void add_perf_command(CLI::App& app, int& status) {
  CLI::App* perf =
      app.add_subcommand("perf", "Measure calls, events and bridges between two programs or hosts");
  perf->require_subcommand(1);
  add_server(*perf, status);
  add_client(*perf, status);
  add_bridge(*perf, status);
}

}  // namespace trestle::measure
