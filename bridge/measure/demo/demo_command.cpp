#include "bridge/measure/measure_commands.hpp"

#include <limits>
#include <memory>

#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/option.hpp"
#include "bridge/measure/demo/demo.hpp"
#include "bridge/measure/demo/endpoints.hpp"

namespace trestle::measure {
namespace {

constexpr double rate_max_hz = 1000;

void add_demo(CLI::App& app, int& status) {
  CLI::App* command =
      app.add_subcommand("demo", "Show the bridge at work: live lidar clouds DDS -> SOME/IP -> DDS");
  command->footer(
      "Starts a DDS publisher, two bridges and a DDS subscriber on loopback and shows what crosses.\n"
      "Exit status: 0 when at least 95 % of the clouds sent after discovery arrived, all intact; otherwise "
      "1.\n\n"
      "Examples:\n"
      "  trestle demo\n"
      "  trestle demo --console\n"
      "  trestle demo --seconds 20 --json figures.json\n"
      "  trestle demo --input street.pcd crossing.pcd --rate 20");
  const auto options = std::make_shared<demo::DemoOptions>();
  const auto seconds = std::make_shared<unsigned>(0);
  CLI::Option* limit =
      command->add_option("--seconds", *seconds, "End after this many seconds of clouds (default: Ctrl-C)")
          ->type_name("N")
          ->check(CLI::Range(1U, 1'000'000U));
  cli::option(*command, "--json", options->json_file, "FILE", "Write the figures to this file");
  command
      ->add_option("--input", options->inputs,
                   "Publish these point clouds (PCD) in turn instead of the synthetic scene")
      ->type_name("FILE")
      ->check(CLI::ExistingFile);
  cli::option(*command, "--rate", options->rate_hz, "HZ", "Clouds a second, 0.1 to 1000",
              CLI::Range(0.1, rate_max_hz));
  command->add_flag("--console", options->console,
                    "Show bridge A in the browser, with the cloud in 3D; the address is printed");
  command->callback([options, seconds, limit, &status] {
    if (limit->count() > 0) {
      options->duration = std::chrono::seconds{*seconds};
    }
    status = demo::run_demo(*options);
  });
}

template <typename Options>
std::shared_ptr<Options> add_common(CLI::App& command) {
  command.group("");  // not in the help
  auto options = std::make_shared<Options>();
  command.add_option("--domain", options->domain)->required()->check(CLI::Range(0, 232));
  command.add_option("--report-fd", options->report_fd)
      ->check(CLI::Range(0, std::numeric_limits<int>::max()));
  command.add_option("--topic", options->topic);
  return options;
}

void add_publisher(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("demo-publisher", "The publisher of the demo");
  const auto options = add_common<demo::PublisherOptions>(*command);
  command->add_option("--rate", options->rate_hz)->check(CLI::Range(0.1, rate_max_hz));
  command->add_option("--input", options->inputs);
  command->callback([options, &status] {
    demo::run_publisher(*options);
    status = cli::exit_ok;
  });
}

void add_subscriber(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("demo-subscriber", "The subscriber of the demo");
  const auto options = add_common<demo::EndpointOptions>(*command);
  command->callback([options, &status] {
    demo::run_subscriber(*options);
    status = cli::exit_ok;
  });
}

}  // namespace

void add_demo_commands(CLI::App& app, int& status) {
  add_demo(app, status);
  add_publisher(app, status);
  add_subscriber(app, status);
}

}  // namespace trestle::measure
