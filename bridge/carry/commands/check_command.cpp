#include "bridge/carry/commands/carry_commands.hpp"

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <memory>

#include "bridge/carry/commands/explain.hpp"
#include "bridge/carry/commands/field_packages.hpp"
#include "bridge/carry/commands/network_check.hpp"
#include "bridge/carry/commands/summary.hpp"
#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/option.hpp"
#include "bridge/cli/terminal.hpp"

namespace trestle::carry {

void add_check_command(CLI::App& app, int& status) {
  CLI::App* command = app.add_subcommand("check", "Check configurations and show what they would do");
  command->footer(
      "Prints each problem with FILE:LINE:COLUMN and what was expected there.\n"
      "With --network it also joins both networks as the bridge would, offers and writes nothing, and says "
      "for\n"
      "each route whether what it takes messages from is there now, and if not, why.\n"
      "Exit status: 0 when all files are correct, otherwise 2; 1 when services cannot be written, or, with\n"
      "--network, when something is not there.\n\n"
      "Examples:\n"
      "  trestle check bridge.yaml\n"
      "  trestle check --quiet examples/*.yaml && echo good\n"
      "  trestle check --network --wait 10 bridge.yaml\n"
      "  trestle check --field-services ws/src bridge.yaml && cd ws && colcon build");
  const auto files = std::make_shared<std::vector<std::string>>();
  const auto quiet = std::make_shared<bool>(false);
  command->add_option("FILE", *files, "Configuration files (YAML)")->required();
  command->add_flag("-q,--quiet", *quiet, "Print problems only");
  const auto folder = std::make_shared<std::string>();
  cli::option(*command, "--field-services", *folder, "FOLDER",
              "Write ROS packages with the services that are made for fields into this folder");
  const auto network = std::make_shared<bool>(false);
  command->add_flag("--network", *network, "Look whether the sources of the routes are there now");
  const auto patience = std::make_shared<int>(5);
  cli::option(*command, "--wait", *patience, "SECONDS",
              "With --network: wait so long at most for what is missing")
      ->check(CLI::Range(1, 3600))
      ->needs("--network");
  command->callback([files, quiet, folder, network, patience, &status] {
    const cli::Colours colours = cli::colours_for(STDOUT_FILENO);
    status = answer_descriptions(*files).value_or(status);
    for (const std::string& file : *files) {
      const auto loaded = load_or_explain(file);
      if (!loaded) {
        status = cli::exit_usage;
        continue;
      }
      const BridgeConfig& config = loaded->config;
      if (!*quiet && !*network) {
        std::fputs(summary(config, colours, loaded->names).c_str(), stdout);
      }
      if (!folder->empty()) {
        if (const std::string fault = write_field_packages(config, *folder); !fault.empty()) {
          std::fprintf(stderr, "%s\n", fault.c_str());
          status = cli::exit_failure;
        }
      }
      if (*network) {
        const NetworkCheck found = check_network(config, std::chrono::seconds{*patience}, colours);
        if (!*quiet || !found.is_all) {
          std::fputs(found.text.c_str(), stdout);
        }
        if (!found.is_all && status == cli::exit_ok) {
          status = cli::exit_failure;
        }
      }
    }
  });
}

}  // namespace trestle::carry
