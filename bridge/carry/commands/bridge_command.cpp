#include "bridge/carry/commands/carry_commands.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/system/system_error.hpp>
#include <csignal>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

#include "bridge/carry/commands/counter_output.hpp"
#include "bridge/carry/commands/drop_root.hpp"
#include "bridge/carry/commands/explain.hpp"
#include "bridge/carry/commands/summary.hpp"
#include "bridge/carry/commands/viewer_sources.hpp"
#include "bridge/carry/config/load_console.hpp"
#include "bridge/carry/runtime/bridge.hpp"
#include "bridge/carry/runtime/limited_sink.hpp"
#include "bridge/carry/runtime/spare_memory.hpp"
#include "bridge/carry/runtime/takes_at_once.hpp"
#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/on_signal.hpp"
#include "bridge/console/console.hpp"
#include "bridge/console/record_process.hpp"
#include "bridge/console/status_place.hpp"
#include "bridge/console/status_socket.hpp"
#include "bridge/guest/host.hpp"
#include "bridge/messages/types/type_library.hpp"
#include "bridge/picture/picture_json.hpp"
#include "sd/net/busy_run.hpp"
#include "sd/net/service_spec.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::carry {
namespace {

struct Options {
  std::string file;
  std::string user;
  std::string console;
  int report_fd = -1;
  bool quiet = false;
};

/// As text, and as lines of the report.
/// @param guests  null: there have been none.
std::string tell_counters(const Bridge& bridge, Report& report, const guest::HostCounters* guests) {
  std::string text;
  const auto print = [&](const CounterGroup& group) {
    text += to_string(group) + '\n';
    report.line(to_json(group));
  };
  for (const CounterGroup& group : bridge.counters()) {
    print(group);
  }
  if (guests != nullptr) {
    CounterGroup group{.name = "tools beside it", .counters = {}};
    guests->for_each_counter(into(group));
    print(group);
  }
  if (report.is_open()) {
    print({.name = "report", .counters = {{"lines_left_out", report.lines_left_out()}}});
  }
  return text;
}

// A connection takes one. Where the usual limit is less than what the system lets one have, that is for the
// sake of old programs.
void raise_descriptor_limit() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) == 0 && limit.rlim_cur < limit.rlim_max) {
    limit.rlim_cur = std::max(limit.rlim_cur, std::min<rlim_t>(limit.rlim_max, 65'536));
    ::setrlimit(RLIMIT_NOFILE, &limit);
  }
}

// The token that the console asks for.
std::string token_of(const std::string& file) {
  if (file.empty()) {
    return {};
  }
  constexpr std::size_t least = 16;
  std::ifstream in{file};
  std::string token;
  std::getline(in, token);
  while (!token.empty() && (token.back() == '\r' || token.back() == ' ')) {
    token.pop_back();
  }
  if (token.size() < least) {
    throw std::runtime_error{
        fmt::format("console: {} has no token in its first line, of at least {} characters", file, least)};
  }
  return token;
}

/// Runs the bridge of a configuration, and can replace it by the bridge of another one.
class Runner {
 public:
  Runner(boost::asio::io_context& io, const Options& options, Loaded loaded)
      : io_{io},
        file_{options.file},
        console_address_{options.console},
        report_{options.report_fd},
        counters_{io, STDOUT_FILENO},
        loaded_{std::move(loaded)} {
    open_status();  // first: whoever reads that the bridge is ready can ask for its state
    start();
  }

  void show() {
    if (!counters_.write(tell_counters(*bridge_, report_, guest_counters()))) {
      spdlog::warn("the counters are not printed, because nobody has read those before");
    }
  }

  /// The last counters. False: not all that was to be printed could be.
  [[nodiscard]] bool show_last() {
    return counters_.finish(tell_counters(*bridge_, report_, guest_counters()));
  }

  void stop() {
    spdlog::info("stopping: withdrawing offers and subscriptions");
    leave_guests();
    bridge_->stop();
    records_.allow({});
    if (const std::uint64_t lines = report_.lines_left_out()) {
      spdlog::warn("{} lines of the report were left out, because its reader was too slow", lines);
    }
  }

  /// Waits for the record that is made, though not for ever.
  void finish_record() { records_.finish(); }

  /// Reads the configuration and the message types anew. If something is wrong with them, the bridge goes on
  /// as before.
  void reload() {
    auto changed = load_or_explain(file_);
    if (!changed) {
      spdlog::error("{} has errors now: going on as before", file_);
      return;
    }
    spdlog::info("{} was read again: beginning anew", file_);
    show();
    leave_guests();
    bridge_->stop();
    console_.reset();
    bridge_.reset();  // frees the sockets for the new bridge
    const Loaded before = std::exchange(loaded_, std::move(*changed));
    try {
      start();
    } catch (const std::exception& error) {
      spdlog::error("{}", error.what());
      spdlog::error("the bridge cannot start with {}: going on as before", file_);
      loaded_ = before;
      start();
    }
  }

  /// Where `trestle status` finds this bridge; empty: nowhere.
  [[nodiscard]] std::string status_path() const { return status_ ? status_->path().string() : std::string{}; }
  /// Where tools find it that use its address; empty: nowhere.
  [[nodiscard]] std::string guests_path() const { return guests_ ? guests_->path().string() : std::string{}; }

  /// The value in the present configuration.
  [[nodiscard]] const Duration& busy_poll() const noexcept { return loaded_.config.someip.busy_poll; }

 private:
  void start() {
    // The files of the types are read again too, because they may have changed.
    const BridgeConfig& config = loaded_.config;
    types_.emplace(messages::TypeLibrary::in(config.types));
    bridge_ = std::make_unique<Bridge>(io_, config, *types_, report_, loaded_.names);
    try {
      open_console();
    } catch (...) {
      bridge_->stop();  // what was offered a moment ago is withdrawn
      bridge_.reset();
      throw;
    }
    if (guests_) {
      const auto& someip = config.someip;
      guests_->open(bridge_->node(), {someip.address, someip.port}, file_,
                    [this](sd::SubscribeSpec& wish) { return bridge_->share_with_routes(wish); });
    }
    spdlog::info("carrying {}; Ctrl-C stops, SIGUSR1 prints counters, SIGHUP reads {} again",
                 count_of_all(config), file_);
  }

  void open_console() {
    std::optional<ConsoleSettings> settings = loaded_.config.console;
    if (!console_address_.empty()) {
      if (!settings) {
        settings.emplace();
      }
      settings->at = *console_address().read(console_address_);
    }
    if (!settings) {
      records_.allow({});
      return;
    }
    if (const std::string fault = fault_of(*settings); !fault.empty()) {
      throw std::runtime_error{"console: " + fault};
    }
    if (const std::string fault = fault_of(loaded_.records, file_); !fault.empty()) {
      throw std::runtime_error{fault};
    }
    try {
      console_ = std::make_unique<console::Console>(
          io_, console::ConsoleSettings{settings->at, token_of(settings->token_file), &records_},
          [this] { return picture(); }, [this](std::size_t route) { return newest(route); },
          viewer_sources([this] { return bridge_.get(); },
                         [this]() -> messages::TypeLibrary& { return *types_; }));
    } catch (const boost::system::system_error& error) {
      throw std::runtime_error{fmt::format("console: cannot listen at {}: {}",
                                           someip::to_string(settings->at), error.code().message())};
    }
    records_.allow(loaded_.records.folder);
    spdlog::info("console: {}", console_->url());
  }

  // Without it everything else works.
  void open_status() {
    try {
      const auto folder = console::status_folder();
      if (!folder) {
        throw std::runtime_error{folder.error()};
      }
      status_.emplace(io_, *folder, [this] { return to_json(picture()); });
      guests_.emplace(io_, *folder);
    } catch (const std::exception& error) {
      spdlog::info("'trestle status' cannot show this bridge: {}", error.what());
    }
  }

  void leave_guests() {
    if (guests_) {
      guests_->close();
    }
  }
  [[nodiscard]] const guest::HostCounters* guest_counters() const {
    return guests_ && guests_->counters().guests > 0 ? &guests_->counters() : nullptr;
  }

  [[nodiscard]] Picture picture() const {
    Picture picture = bridge_ ? bridge_->picture() : Picture{};
    picture.program = TRESTLE_VERSION;
    return picture;
  }

  // The newest message of a route.
  [[nodiscard]] std::optional<console::ShownMessage> newest(std::size_t route) {
    auto seen = bridge_ ? bridge_->look_at(route) : std::nullopt;
    auto tree = seen ? types_->resolve(seen->type) : tl::unexpected{messages::TypeError{}};
    if (!tree) {
      return std::nullopt;
    }
    std::optional<console::ShownMap> map;
    if (seen->mapping) {
      auto payload = types_->resolve(seen->mapping->payload.text);
      if (!payload) {
        return std::nullopt;
      }
      map.emplace();
      map->payload = std::move(*payload);
      map->mapping = std::move(*seen->mapping);
    }
    return console::ShownMessage{std::move(seen->name),  std::move(seen->type),   std::move(*tree),
                                 std::move(seen->rules), std::move(seen->newest), std::move(map)};
  }

  boost::asio::io_context& io_;
  std::string file_;
  std::string console_address_;  ///< of the command line
  Report report_;
  CounterOutput counters_;
  Loaded loaded_;
  std::optional<messages::TypeLibrary> types_;
  std::unique_ptr<Bridge> bridge_;
  /// Goes on while the bridge begins anew.
  console::RecordProcess records_{io_, file_, [](bool good, const std::string& line) {
                                    spdlog::log(good ? spdlog::level::info : spdlog::level::warn,
                                                "record: {}", line);
                                  }};
  std::unique_ptr<console::Console> console_;
  std::optional<console::StatusSocket> status_;
  std::optional<guest::Host> guests_;
};

int run(const Options& options) {
  auto loaded = load_or_explain(options.file);
  if (!loaded) {
    return cli::exit_usage;
  }
  // Logs go to standard error, counters to standard output. The bridge goes on without their readers, whether
  // they end or do not read.
  std::signal(SIGPIPE, SIG_IGN);
  auto logger = std::make_shared<spdlog::logger>(
      "trestle", std::make_shared<LimitedSink>(std::make_shared<spdlog::sinks::stderr_color_sink_mt>(),
                                               [] { return takes_at_once(STDERR_FILENO); }));
  logger->set_pattern("%H:%M:%S.%e %^%l%$ %v");
  logger->set_level(options.quiet ? spdlog::level::warn : spdlog::level::info);
  spdlog::set_default_logger(logger);

  std::optional<DropRoot> drop_root;
  if (!options.user.empty()) {
    drop_root.emplace(options.user);
  }
  boost::asio::io_context io{1};
  std::optional<Runner> runner;
  const bool has_terminal = isatty(STDERR_FILENO) != 0;
  // Before the bridge, because its DDS starts threads.
  const cli::OnSignal signals{io, {SIGINT, SIGTERM, SIGUSR1, SIGHUP}, [&](int signal) {
                                const bool terminal_gone =
                                    signal == SIGHUP && has_terminal && isatty(STDERR_FILENO) == 0;
                                if (signal == SIGINT || signal == SIGTERM || terminal_gone) {
                                  runner->stop();
                                  io.stop();
                                } else if (signal == SIGHUP) {
                                  runner->reload();
                                } else {
                                  runner->show();
                                }
                              }};
  raise_descriptor_limit();  // before the bridge, which shares out what it may have
  const SpareMemory spare_memory{io};
  runner.emplace(io, options, std::move(*loaded));
  if (drop_root) {
    drop_root->give(runner->status_path());
    drop_root->give(runner->guests_path());
    drop_root->now();
    spdlog::info("running as {}", options.user);
  }
  sd::run_busy(io, runner->busy_poll());
  runner->finish_record();
  const bool all_shown = runner->show_last();
  logger->flush();
  if (!all_shown) {
    throw std::runtime_error{"cannot write all of the output; is the disk full?"};
  }
  return cli::exit_ok;
}

}  // namespace

void add_bridge_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("bridge", "Run the bridge that a configuration describes");
  command->footer(
      "Runs until Ctrl-C (SIGINT) or SIGTERM, then withdraws its offers and subscriptions. Counters of "
      "everything\n"
      "received, sent and lost go to standard output, then and on SIGUSR1; the log goes to standard error.\n"
      "'trestle status' shows it while it runs.\n"
      "On SIGHUP it reads the configuration and the message types again and starts over with them; if they\n"
      "have errors, it goes on as before.\n"
      "Exit status: 0 after a clean stop, 1 when something cannot be opened, 2 for a wrong configuration.\n\n"
      "Examples:\n"
      "  trestle bridge bridge.yaml\n"
      "  trestle bridge --console 127.0.0.1:9464 bridge.yaml\n"
      "  trestle bridge --report-fd 3 bridge.yaml 3>report.jsonl");
  const auto options = std::make_shared<Options>();
  command->add_option("FILE", options->file, "Configuration (YAML); see 'trestle check'")->required();
  command->allow_extras();  // see below
  command
      ->add_option("--report-fd", options->report_fd,
                   "Write a JSON line for each message carried to this file descriptor")
      ->type_name("FD")
      ->check(CLI::Range(0, std::numeric_limits<int>::max()));
  command
      ->add_option(
          "--user", options->user,
          "Started by root: give up its rights for those of this user as soon as the sockets are open")
      ->type_name("NAME");
  command
      ->add_option(
          "--console", options->console,
          "Serve a page that shows the bridge, and /metrics, /healthz and /readyz, at this address of "
          "this host (port 9464 unless told); other hosts need the key `console` with a token")
      ->type_name("ADDRESS[:PORT]");
  command->add_flag("-q,--quiet", options->quiet, "Log only problems");
  command->callback([command, options, &status] {
    const std::vector<std::string> more = command->remaining();
    std::vector<std::string> files{options->file};
    files.insert(files.end(), more.begin(), more.end());
    // Who names interface descriptions, and so maybe several files, is told what to do with them.
    const bool has_unknown_option = !more.empty() && more.front().starts_with('-');
    if (const auto answered = has_unknown_option ? std::nullopt : answer_descriptions(files, true)) {
      status = *answered;
      return;
    }
    if (!more.empty()) {
      throw CLI::ExtrasError{more};
    }
    if (options->report_fd >= 0 && fcntl(options->report_fd, F_GETFD) < 0) {
      throw CLI::ValidationError("--report-fd",
                                 "file descriptor " + std::to_string(options->report_fd) + " is not open");
    }
    if (!options->console.empty() && !console_address().read(options->console)) {
      throw CLI::ValidationError("--console", "expected " + console_address().expected);
    }
    status = run(*options);
  });
}

}  // namespace trestle::carry
