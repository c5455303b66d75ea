#include "bridge/runtime/bridge_command.hpp"

#include <fcntl.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <csignal>
#include <cstdio>
#include <functional>
#include <memory>

#include "bridge/check/explain.hpp"
#include "bridge/cli/exit_status.hpp"
#include "bridge/runtime/bridge.hpp"
#include "bridge/types/type_library.hpp"

namespace trestle::bridge {
namespace {

struct Options {
  std::string file;
  int report_fd = -1;
  bool quiet = false;
};

void print_counters(const Bridge& bridge, Report& report) {
  for (const CounterGroup& group : bridge.counters()) {
    std::printf("%s\n", to_string(group).c_str());
    report.line(to_json(group));
  }
  std::fflush(stdout);
}

int run(const Options& options) {
  const auto config = load_or_explain(options.file);
  if (!config) {
    return exit_usage;
  }
  // Logs go to standard error, counters to standard output.
  auto logger = spdlog::stderr_color_mt("trestle");
  logger->set_pattern("%H:%M:%S.%e %^%l%$ %v");
  logger->set_level(options.quiet ? spdlog::level::warn : spdlog::level::info);
  spdlog::set_default_logger(logger);

  boost::asio::io_context io{1};
  boost::asio::signal_set stop{io, SIGINT, SIGTERM};
  boost::asio::signal_set show{io, SIGUSR1};
  TypeLibrary types{{config->type_paths.begin(), config->type_paths.end()}, ament_prefixes()};
  Report report{options.report_fd};
  Bridge bridge{io, *config, types, report};

  stop.async_wait([&](const boost::system::error_code& error, int) {
    if (!error) {
      spdlog::info("stopping: withdrawing offers and subscriptions");
      bridge.stop();
      io.stop();
    }
  });
  std::function<void()> await_show = [&] {
    show.async_wait([&](const boost::system::error_code& error, int) {
      if (!error) {
        print_counters(bridge, report);
        await_show();
      }
    });
  };
  await_show();
  spdlog::info("carrying {} route{}; Ctrl-C stops, SIGUSR1 prints counters", config->routes.size(),
               config->routes.size() == 1 ? "" : "s");
  io.run();
  print_counters(bridge, report);
  return exit_ok;
}

}  // namespace

void add_bridge_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("bridge", "Carry topics and events as a configuration says");
  command->footer(
      "Runs until Ctrl-C (SIGINT) or SIGTERM, then withdraws its offers and subscriptions. Counters of "
      "everything\n"
      "received, sent and lost go to standard output, then and on SIGUSR1; the log goes to standard error.\n"
      "Exit status: 0 after a clean stop, 1 when something cannot be opened, 2 for a wrong configuration.\n\n"
      "Examples:\n"
      "  trestle bridge bridge.yaml\n"
      "  trestle bridge --report-fd 3 bridge.yaml 3>report.jsonl");
  const auto options = std::make_shared<Options>();
  command->add_option("FILE", options->file, "Configuration (YAML); see 'trestle check'")->required();
  command
      ->add_option("--report-fd", options->report_fd,
                   "Write a JSON line for each message carried to this file descriptor")
      ->type_name("FD")
      ->check(CLI::NonNegativeNumber);
  command->add_flag("-q,--quiet", options->quiet, "Log only what is wrong");
  command->callback([options, &status] {
    if (options->report_fd >= 0 && fcntl(options->report_fd, F_GETFD) < 0) {
      throw CLI::ValidationError("--report-fd",
                                 "file descriptor " + std::to_string(options->report_fd) + " is not open");
    }
    status = run(*options);
  });
}

}  // namespace trestle::bridge
