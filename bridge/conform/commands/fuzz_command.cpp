#include "bridge/conform/commands/fuzz_command.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <fstream>
#include <memory>

#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/option.hpp"
#include "bridge/cli/signals.hpp"
#include "bridge/cli/terminal.hpp"
#include "bridge/conform/commands/device_options.hpp"
#include "bridge/conform/fuzz/campaign.hpp"
#include "bridge/conform/fuzz/fuzz_report.hpp"
#include "bridge/conform/fuzz/player.hpp"
#include "bridge/conform/tester.hpp"

namespace trestle::conform {
namespace {

struct FuzzArguments : DeviceOptions {
  double seconds = 60;
  std::uint64_t max_sequences = 0;
  generate::SourceArguments interfaces{};
  std::string capture;
  pid_t process = 0;
  std::string fault;
  std::size_t memory_mb = 128;
  std::size_t max_findings = 20;
  bool quiet = false;
};

FuzzOptions options_of(const FuzzArguments& arguments, const std::shared_ptr<cli::Signals>& signals) {
  return {.folder = arguments.folder,
          .programs = programs(),
          .fault = arguments.fault,
          .time = std::chrono::milliseconds{static_cast<std::int64_t>(arguments.seconds * 1e3)},
          .max_sequences = arguments.max_sequences,
          .seed = arguments.seed,
          .process = arguments.process == 0 ? std::nullopt : std::optional{arguments.process},
          .max_memory_growth = arguments.memory_mb << 20U,
          .max_findings = arguments.max_findings,
          .cancelled = [signals, came = std::make_shared<bool>(false)] {
            *came = *came || signals->next().has_value();
            return *came;
          }};
}

void print_finding(const Finding& one, const cli::Colours& colours) {
  fmt::print("{}{:>11}{}  {}{}\n", colours.red, to_string(one.kind), colours.off, one.what,
             one.confirmed ? fmt::format(" {}({} of {} steps){}", colours.dim, one.sequence.steps.size(),
                                         one.steps_found, colours.off)
                           : fmt::format(" {}(seen once){}", colours.dim, colours.off));
  std::fflush(stdout);
}

int replay(const FuzzArguments& arguments, const Profile& profile, const FuzzOptions& options) {
  Sequence sequence;
  try {
    sequence = sequence_of_capture(arguments.capture, profile);
  } catch (const std::runtime_error& error) {
    throw CLI::ValidationError{"--replay", error.what()};
  }
  const cli::Colours colours = cli::colours_for(STDOUT_FILENO);
  const std::vector<Finding> found = replay_sequence(profile, sequence, options);
  for (const Finding& one : found) {
    fmt::print("{}{:>11}{}  {}\n", colours.red, to_string(one.kind), colours.off, one.what);
  }
  fmt::print("{} steps sent; {}; packets are in {}/replay.pcapng\n", sequence.steps.size(),
             found.empty() ? "nothing is wrong" : fmt::format("{} wrong", found.size()), arguments.folder);
  return found.empty() ? cli::exit_ok : cli::exit_failure;
}

/// What the descriptions of --interfaces say; nothing, after it was told why, when they cannot be used.
std::optional<describe::Model> described(FuzzArguments& arguments) {
  if (arguments.interfaces.sources.empty()) {
    return describe::Model{};
  }
  describe::System system = arguments.interfaces.read();
  return system.good ? std::optional{std::move(system.model)} : std::nullopt;
}

/// As they were given: " --interfaces Door.fidl Door.fdepl".
std::string interface_words(const FuzzArguments& arguments) {
  std::string words = arguments.interfaces.sources.empty() ? "" : " --interfaces";
  for (const std::string& one : arguments.interfaces.sources) {
    words += " " + one;
  }
  return words;
}

int fuzz(FuzzArguments& arguments) {
  const auto profile = profile_of(arguments, ProfileServices::optional);
  const auto model = described(arguments);
  if (!profile || !model) {
    return cli::exit_usage;
  }
  prepare_folder(arguments.folder);
  const auto signals = std::make_shared<cli::Signals>(std::initializer_list<int>{SIGINT, SIGTERM, SIGPIPE});
  FuzzOptions options = options_of(arguments, signals);
  options.interfaces = &*model;
  if (!arguments.capture.empty()) {
    return replay(arguments, *profile, options);
  }
  const cli::Colours colours = cli::colours_for(STDOUT_FILENO);
  const bool shown = cli::is_terminal(STDERR_FILENO) && !arguments.quiet;
  const auto clear = [shown] {
    if (shown) {
      fmt::print(stderr, "\r\033[K");
    }
  };
  options.on_finding = [&](const Finding& one) {
    clear();
    print_finding(one, colours);
  };
  if (shown) {
    options.on_progress = [&](const FuzzProgress& now) {
      fmt::print(stderr, "\r\033[K[{:.0f}/{:.0f} s] {} sequences, {} messages, {} answers{}, {} findings",
                 std::chrono::duration<double>(now.since_begin).count(), arguments.seconds, now.sequences,
                 now.messages, now.behaviours, now.places == 0 ? "" : fmt::format(", {} places", now.places),
                 now.findings);
    };
  }
  const FuzzInfo info{
      .device = profile->name,
      .device_version = profile->version,
      .profile_file = arguments.profile,
      .folder = arguments.folder,
      .seed = arguments.seed,
      .command = fmt::format(
          "trestle fuzz{} --seconds {}{}{}", as_words(arguments), arguments.seconds,
          arguments.max_sequences == 0 ? "" : fmt::format(" --sequences {}", arguments.max_sequences),
          interface_words(arguments))};
  const FuzzResult result = fuzz_device(*profile, options);
  clear();
  std::ofstream{arguments.folder + "/results.json"} << fuzz_json(result, info);
  std::ofstream{arguments.folder + "/report.html"} << fuzz_page(result, info);
  fmt::print("{}", fuzz_summary(result, info));
  for (const Finding& one : result.findings) {
    fmt::print("{}again:{} {}\n", colours.dim, colours.off, replay_command(one, info));
  }
  if (!result.gave_up.empty()) {
    fmt::print(stderr, "{}ended early:{} {}\n", colours.yellow, colours.off, result.gave_up);
  }
  const bool good = result.findings.empty() && result.gave_up.empty() && !result.cancelled;
  return good ? cli::exit_ok : cli::exit_failure;
}

}  // namespace

void add_fuzz_command(CLI::App& app, int& status, const generate::SourceReaders& readers) {
  const auto arguments = std::make_shared<FuzzArguments>();
  arguments->folder = "fuzz-results";
  arguments->interfaces = generate::SourceArguments{readers};
  CLI::App* command =
      app.add_subcommand("fuzz", "Send a SOME/IP device always new messages, and watch what becomes of it");
  add_device_options(*command, *arguments);
  cli::option(*command, "--seconds", arguments->seconds, "N", "For how long")->check(CLI::Range(0.1, 1e7));
  command->add_option("--sequences", arguments->max_sequences, "End after so many sequences, if not before")
      ->type_name("N")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--interfaces", arguments->interfaces.sources,
                   "Interface descriptions (FIDL with FDEPL, ARXML, vsomeip JSON, route files; files or "
                   "folders): methods,\n"
                   "fields and events are those of the description, and payloads have their types")
      ->type_name("FILE");
  command
      ->add_option("--replay", arguments->capture,
                   "Send once what the tester sends in this capture, such as that of a finding, and look")
      ->type_name("CAPTURE");
  command
      ->add_option("--pid", arguments->process,
                   "Watch memory and descriptors of this process; else those of what the profile starts")
      ->type_name("N")
      ->check(CLI::PositiveNumber);
  cli::option(*command, "--memory", arguments->memory_mb, "MB",
              "A device whose memory grows by more has a finding")
      ->check(CLI::Range(1, 1 << 20));
  cli::option(*command, "--max-findings", arguments->max_findings, "N", "End when there are so many")
      ->check(CLI::Range(1, 10'000));
  command->add_option("--fault", arguments->fault, "Start the device with this fault of the profile")
      ->type_name("NAME");
  command->add_flag("-q,--quiet", arguments->quiet, "No progress");
  command->footer(
      "Examples:\n"
      "  trestle fuzz --dut examples/ets_device/profile.yaml --seconds 30\n"
      "  trestle fuzz --dut my_ecu.yaml --seconds 3600 --seed 7 --out night\n"
      "  trestle fuzz --dut my_ecu.yaml --interfaces Door.fidl Door.fdepl\n"
      "  trestle fuzz --dut my_ecu.yaml --replay night/finding-001-crash.pcapng\n"
      "Exit status: 0 when nothing was found, 1 when something was, 2 when the command line or the profile "
      "is\n"
      "wrong. The profile is that of 'trestle conform'; docs/fuzzing.md explains findings and reports.");
  command->callback([arguments, &status] {
    try {
      status = fuzz(*arguments);
    } catch (const TesterError& error) {
      fmt::print(stderr, "error: {}\n", error.what());
      status = cli::exit_usage;
    }
  });
}

}  // namespace trestle::conform
