// bridge/program: the program `trestle`.
//
//   main.cpp  puts the commands of all rooms together: bridge/carry/commands, bridge/generate,
//             bridge/conform/commands, bridge/inspect, bridge/measure
//   self_commands.hpp  completion.hpp and man_page.hpp: the program for shells and for `man`
//   command_model.hpp  what commands and options say of themselves
//
// What a wrong command line is answered with is here; everything else is in the room of the command.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdio>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "bridge/carry/commands/carry_commands.hpp"
#include "bridge/carry/commands/ros_graph.hpp"
#include "bridge/carry/config/describe_routes.hpp"
#include "bridge/carry/record/record_commands.hpp"
#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/terminal.hpp"
#include "bridge/conform/commands/conform_command.hpp"
#include "bridge/conform/commands/fuzz_command.hpp"
#include "bridge/documents/section.hpp"
#include "bridge/generate/generate_commands.hpp"
#include "bridge/inspect/decode/decode_command.hpp"
#include "bridge/inspect/tools/tool_commands.hpp"
#include "bridge/measure/measure_commands.hpp"
#include "bridge/program/command_model.hpp"
#include "bridge/program/self_commands.hpp"

namespace {

using namespace trestle;

/// Shows options only with the names of their values: the descriptions say what matters for users.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option_opts(const CLI::Option* option) const override {
    std::string text;
    if (const std::string value = program::value_name(*option); option->nonpositional() && !value.empty()) {
      text = " " + value;
    }
    if (!option->get_default_str().empty()) {
      text += "=" + option->get_default_str();
    }
    if (option->get_expected_max() > 1 && option->get_allow_extra_args()) {
      text += " ...";
    }
    return text;
  }
};

/// The last of the given commands, whose subcommands come next; the program if none was given.
const CLI::App& asked_command(const CLI::App& app) {
  const std::vector<CLI::App*> given = app.get_subcommands();
  return given.empty() ? app : asked_command(*given.front());
}

std::vector<std::string> command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : program::commands_of(app)) {
    names.push_back(command->get_name());
  }
  return names;
}

/// Each room has a header with add_X_command(app, status) for each of its commands. That adds the
/// subcommand, whose callback runs it and stores an exit status (exit_status.hpp) in `status`.
int run(int argc, char** argv) {
  CLI::App app{"Trestle joins DDS (ROS 2) topics and SOME/IP services."};
  app.name("trestle");
  app.formatter(std::make_shared<HelpFormatter>());
  app.set_version_flag("--version", "trestle " TRESTLE_VERSION);
  app.require_subcommand(1);
  app.footer(
      "'trestle COMMAND --help' explains a command and shows examples.\n"
      "Exit status: 0 success, 1 failure, 2 wrong command line or configuration, 3 error as answer "
      "(call).");

  int status = cli::exit_ok;
  carry::add_bridge_command(app, status);
  carry::add_check_command(app, status);
  carry::add_status_command(app, status);
  carry::add_schema_command(app, status);
  carry::add_record_command(app, status);
  carry::add_replay_command(app, status);
  const generate::SourceReaders readers{.route_file = carry::describe_routes,
                                        .types_of_route_file = carry::types_of_routes,
                                        .ros = carry::listen_to_ros};
  generate::add_generate_command(app, status, readers);
  generate::add_diff_command(app, status, readers);
  generate::add_explain_command(app, status, readers);
  conform::add_conform_command(app, status, readers);
  conform::add_fuzz_command(app, status, readers);
  inspect::add_decode_command(app, status);
  inspect::add_find_command(app, status);
  inspect::add_watch_command(app, status);
  inspect::add_call_command(app, status);
  inspect::add_subscribe_command(app, status);
  inspect::add_offer_command(app, status);
  inspect::add_notify_command(app, status);
  measure::add_perf_command(app, status);
  measure::add_demo_commands(app, status);
  program::add_completion_command(app);
  program::add_man_command(app, status, "trestle " TRESTLE_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::RequiredError& error) {
    const CLI::App& asked = asked_command(app);
    const std::vector<std::string> commands = command_names(asked);
    if (commands.empty()) {
      app.exit(error);
      return cli::exit_usage;
    }
    // CLI11 only says that a command is missing, even for one that does not exist.
    if (const std::vector<std::string> unknown = asked.remaining(); !unknown.empty()) {
      const std::string likely = documents::nearest(unknown.front(), commands);
      std::fprintf(stderr, "There is no command or option '%s'%s\n\n",
                   documents::printable(unknown.front()).c_str(),
                   likely.empty() ? "" : ("; did you mean '" + likely + "'?").c_str());
    } else if (&asked != &app) {
      std::fprintf(stderr, "'%s' needs a subcommand\n\n", asked.get_name().c_str());
    }
    std::fputs(app.help().c_str(), stderr);
    return cli::exit_usage;
  } catch (const CLI::ParseError& error) {
    // --help and --version come this way too, with exit code 0. CLI11 has a code for each kind of mistake.
    return app.exit(error) == 0 ? cli::exit_ok : cli::exit_usage;
  }
  return status;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const int status = run(argc, argv);
    // A full disk may show only now, when buffered output is written. If the reader went away, that is no
    // error.
    errno = 0;
    if ((std::fflush(stdout) != 0 || std::ferror(stdout) != 0) && errno != EPIPE) {
      throw std::runtime_error{"cannot write all of the output; is the disk full?"};
    }
    return status;
  } catch (const std::exception& error) {
    const cli::Colours colour = cli::colours_for(STDERR_FILENO);
    std::fprintf(stderr, "%serror:%s %s\n", colour.red, colour.off, error.what());
    return cli::exit_failure;
  }
}
