#include "bridge/conform/commands/results_commands.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/option.hpp"
#include "bridge/cli/terminal.hpp"
#include "bridge/conform/compare_runs.hpp"

namespace trestle::conform {
namespace {

struct ResultsArguments {
  std::string before;
  std::string after;
  std::vector<std::string> runs;
  std::string format = "text";
};

ReadRun run_at(const std::string& argument, const std::string& path) {
  auto run = read_results(path);
  if (!run) {
    throw CLI::ValidationError{argument, run.error()};
  }
  return std::move(*run);
}

int diff(const ResultsArguments& arguments) {
  const ReadRun before = run_at("BEFORE", arguments.before);
  const ReadRun after = run_at("AFTER", arguments.after);
  fmt::print("{}", comparison_text(before, after, cli::colours_for(STDOUT_FILENO)));
  return !after.cancelled && compare(before, after).count(CaseChange::broke) == 0 ? cli::exit_ok
                                                                                  : cli::exit_failure;
}

int matrix(const ResultsArguments& arguments) {
  std::vector<ReadRun> runs;
  for (const std::string& path : arguments.runs) {
    runs.push_back(run_at("RUN", path));
  }
  const StackMatrix matrix = matrix_of(runs);
  fmt::print("{}", arguments.format == "json"       ? matrix_json(matrix)
                   : arguments.format == "markdown" ? matrix_markdown(matrix)
                                                    : matrix_text(matrix, cli::colours_for(STDOUT_FILENO)));
  return cli::exit_ok;
}

}  // namespace

void add_results_commands(CLI::App& conform, int& status) {
  const auto arguments = std::make_shared<ResultsArguments>();
  CLI::App* one =
      conform.add_subcommand("diff", "Compare two runs of one device: what broke, what was mended");
  one->add_option("BEFORE", arguments->before, "The results.json of a run, or its folder")->required();
  one->add_option("AFTER", arguments->after, "The same of a later run")->required();
  one->footer(
      "Examples:\n"
      "  trestle conform diff last-week/ conform-results/\n"
      "  trestle conform run --dut ecu.yaml --out new; trestle conform diff baseline.json new\n"
      "Exit status: 0 when each case that was good still is, 1 when one is not or the later run was ended "
      "before\nall of its cases were run, 2 when a run cannot be read.");
  one->callback([arguments, &status] { status = diff(*arguments); });

  CLI::App* table = conform.add_subcommand(
      "matrix", "Show runs of several devices side by side: by area, and each case that is not alike");
  table->add_option("RUN", arguments->runs, "The results.json of a run, or its folder; one for each device")
      ->required();
  cli::option(*table, "--format", arguments->format, "FORMAT", "text, markdown or json")
      ->check(CLI::IsMember({"text", "markdown", "json"}));
  table->footer(
      "Examples:\n"
      "  trestle conform matrix results/*/\n"
      "  trestle conform matrix vsomeip pysomeip --format markdown > matrix.md");
  table->callback([arguments, &status] { status = matrix(*arguments); });
}

}  // namespace trestle::conform
