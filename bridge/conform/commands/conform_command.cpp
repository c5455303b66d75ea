#include "bridge/conform/commands/conform_command.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <memory>

#include "bridge/cli/exit_status.hpp"
#include "bridge/cli/option.hpp"
#include "bridge/cli/signals.hpp"
#include "bridge/cli/terminal.hpp"
#include "bridge/conform/cases/all_cases.hpp"
#include "bridge/conform/commands/device_options.hpp"
#include "bridge/conform/commands/profile_command.hpp"
#include "bridge/conform/commands/replay_command.hpp"
#include "bridge/conform/commands/result_output.hpp"
#include "bridge/conform/commands/results_commands.hpp"
#include "bridge/conform/parallel.hpp"
#include "bridge/conform/replay/rules.hpp"
#include "bridge/conform/report.hpp"
#include "bridge/conform/runner.hpp"
#include "bridge/conform/selftest.hpp"
#include "bridge/conform/tester.hpp"

namespace trestle::conform {
namespace {

struct Arguments : DeviceOptions {
  std::vector<std::string> selectors;
  std::string level = "tc8";
  std::string role = "both";
  std::vector<std::string> faults;
  bool quiet = false;
  bool quick = false;
  bool every_pair = false;
  unsigned jobs = default_jobs();
};

Level level_of(const std::string& word) {
  return word == "must" ? Level::must : word == "should" ? Level::should : Level::tc8;
}

/// The TC8 case of this id, when there is a reason why no case is about it. Null: it is something else.
const Tc8Row* without_case(const std::string& selector) {
  const Tc8Row* row = find_tc8(selector);
  return row != nullptr && !row->why_no_case.empty() ? row : nullptr;
}

/// Whether a selector chooses no case.
bool chooses_none(const std::string& selector) {
  return choose(all_cases(), {selector}, Level::tc8).empty();
}

/// The requirement of this id, when no case is about it, or a rule of replay is. Null: it is something else.
const RequirementRow* beyond_cases(const std::string& selector) {
  const RequirementRow* row = find_requirement(selector);
  return row != nullptr && (chooses_none(selector) || row->testable == "pcap" ||
                            !choose(replay_rules(), {selector}, Level::tc8).empty())
             ? row
             : nullptr;
}

/// Why a requirement that is selected has no case.
std::string reason_without_case(const RequirementRow& row) {
  const std::string why = why_no_case(row);
  return why.empty()
             ? "a capture shows it: 'trestle conform replay' judges it, and 'trestle conform explain " +
                   row.id + "' says how"
             : why;
}

/// The cases that are asked for. A selector that chooses none is a mistake.
std::vector<const Case*> cases_of(const Arguments& arguments) {
  for (const std::string& selector : arguments.selectors) {
    if (const Tc8Row* row = without_case(selector)) {
      throw CLI::ValidationError{selector, "has no case: " + row->why_no_case};
    }
    if (!chooses_none(selector)) {
      continue;
    }
    if (const RequirementRow* row = find_requirement(selector)) {
      throw CLI::ValidationError{selector, "has no case: " + reason_without_case(*row)};
    }
    throw CLI::ValidationError{selector,
                               "chooses no case; 'trestle conform list' shows all. A selector is an id "
                               "('sd.offer.ttl'), the start of "
                               "one ('sd.offer'), a pattern ('*.ttl'), a TC8 id, or the id of a requirement"};
  }
  const auto chosen_by = [&](const std::vector<std::string>& selectors) {
    std::vector<const Case*> all = choose(all_cases(), selectors, level_of(arguments.level));
    std::erase_if(all, [&](const Case* one) {
      return arguments.role != "both" && arguments.role != to_string(one->role);
    });
    return all;
  };
  // What asks for something and gets nothing must not look like something that went well.
  for (const std::string& selector : arguments.selectors) {
    if (chosen_by({selector}).empty()) {
      throw CLI::ValidationError{
          selector, fmt::format("chooses no case with --level {} --role {}; 'trestle conform explain' tells "
                                "the level and the role of a case",
                                arguments.level, arguments.role)};
    }
  }
  return chosen_by(arguments.selectors);
}

/// The case that runs now, on a line that the next one takes away. Only where somebody looks.
class Progress {
 public:
  explicit Progress(std::size_t count) : count_{count}, shown_{cli::is_terminal(STDERR_FILENO)} {}
  ~Progress() { clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void begin(const std::string& what) {
    ++number_;
    if (shown_) {
      fmt::print(stderr, "\r\033[K[{}/{}] {}", number_, count_, what);
    }
  }
  void clear() const {
    if (shown_) {
      fmt::print(stderr, "\r\033[K");
    }
  }

 private:
  std::size_t count_;
  std::size_t number_ = 0;
  bool shown_;
};

RunInfo info_of(const Arguments& arguments, const Profile& profile) {
  return {.profile_file = arguments.profile,
          .device = profile.name,
          .device_version = profile.version,
          .folder = arguments.folder,
          .level = level_of(arguments.level),
          .seed = arguments.seed,
          .command = "trestle conform run" + as_words(arguments)};
}

/// What run and selftest begin with.
struct Begun {
  std::vector<const Case*> cases;
  Profile profile;
  RunInfo info;
  std::shared_ptr<cli::Signals> signals;

  /// Whether somebody pressed Ctrl-C, or the like. May be copied, and asked by several threads.
  [[nodiscard]] std::function<bool()> cancelled() const {
    return [signals = signals, came = std::make_shared<std::atomic<bool>>(false)] {
      if (signals->next()) {
        *came = true;
      }
      return came->load();
    };
  }
};

/// Nothing, after it has said why, when the profile cannot be used.
std::optional<Begun> begin(const Arguments& arguments) {
  std::vector<const Case*> cases = cases_of(arguments);
  auto profile = profile_of(arguments);
  if (!profile) {
    return std::nullopt;
  }
  prepare_folder(arguments.folder);
  RunInfo info = info_of(arguments, *profile);
  // From here on they wait until somebody asks, so that the device is stopped and results are written. Where
  // nobody reads what is printed, that fails with an error, and the device is stopped, too.
  return Begun{
      .cases = std::move(cases),
      .profile = std::move(*profile),
      .info = std::move(info),
      .signals = std::make_shared<cli::Signals>(std::initializer_list<int>{SIGINT, SIGTERM, SIGPIPE})};
}

int run(const Arguments& arguments) {
  const auto begun = begin(arguments);
  if (!begun) {
    return cli::exit_usage;
  }
  const auto& [cases, profile, info, signals] = *begun;
  ResultTree tree{info};
  Progress progress{cases.size()};
  const std::vector<Profile> devices = neighbours(profile, arguments.jobs);
  if (arguments.jobs > 1 && devices.size() == 1) {
    fmt::print(stderr,
               "note: there is one device, so that cases run one after the other: --jobs is for one that the "
               "profile starts on loopback\n");
  }
  const RunResult result = run_side_by_side(
      devices, cases,
      {.folder = arguments.folder,
       .programs = programs(),
       .seed = arguments.seed,
       .command = info.command,
       .cancelled = begun->cancelled(),
       .on_begin = [&](const Case& one) { progress.begin(one.id); },
       .on_end =
           [&](const CaseResult& one) {
             progress.clear();
             if (!arguments.quiet ||
                 !(is_good(one.outcome.verdict) || one.outcome.verdict == Verdict::unsupported)) {
               tree.add(one);
             }
           },
       .on_problem =
           [&](const std::string& text) {
             progress.clear();
             fmt::print(stderr, "{}\n", text);
           }});
  progress.clear();
  write_results(result, info);
  fmt::print("{}\n{}report.html, results.json, junit.xml and a capture of each case are in {}; seed {}{}\n",
             summary(result, tree.colours()), tree.colours().dim, arguments.folder, arguments.seed,
             tree.colours().off);
  if (!result.gave_up.empty()) {
    fmt::print(stderr, "{}error:{} {}\n", tree.colours().red, tree.colours().off, result.gave_up);
  }
  const bool good =
      !result.cancelled &&
      result.count(Verdict::fail) + result.count(Verdict::error) + result.count(Verdict::inconclusive) == 0;
  return good ? cli::exit_ok : cli::exit_failure;
}

int list(const Arguments& arguments) {
  for (const Case* one : cases_of(arguments)) {
    std::string tc8;
    for (const Tc8Id& id : one->tc8) {
      tc8 += " " + std::string{id.text()};
    }
    fmt::print("{:48} {:6} {}{}\n", one->id, to_string(one->level), one->title,
               tc8.empty() ? "" : " [" + tc8.substr(1) + "]");
  }
  return cli::exit_ok;
}

/// Rules of replay by their own ids, which verdicts from captures and findings of `trestle fuzz` name.
std::vector<const Case*> rules_named(const std::string& selector) {
  return selector.starts_with("pcap.") ? choose(replay_rules(), {selector}, Level::tc8)
                                       : std::vector<const Case*>{};
}

int explain(const Arguments& arguments) {
  Arguments with_case = arguments;
  std::erase_if(with_case.selectors, [](const std::string& selector) {
    return without_case(selector) != nullptr || !rules_named(selector).empty() ||
           (beyond_cases(selector) != nullptr && chooses_none(selector));
  });
  // No selector at all means all cases.
  if (arguments.selectors.empty() || !with_case.selectors.empty()) {
    for (const Case* one : cases_of(with_case)) {
      fmt::print("{}", explanation(*one));
    }
  }
  for (const std::string& selector : arguments.selectors) {
    for (const Case* rule : rules_named(selector)) {
      fmt::print("{}", explanation(*rule));
    }
    if (const Tc8Row* row = without_case(selector)) {
      fmt::print("{}", explanation(*row));
    }
    if (const RequirementRow* row = beyond_cases(selector)) {
      fmt::print("{}", explanation(*row, replay_rules()));
    }
  }
  return cli::exit_ok;
}

int check_itself(const Arguments& arguments) {
  const auto begun = begin(arguments);
  if (!begun) {
    return cli::exit_usage;
  }
  const auto& [cases, profile, info, signals] = *begun;
  ResultTree tree{info};
  const cli::Colours& colours = tree.colours();
  const SelftestResult result =
      selftest(profile, cases,
               {.folder = arguments.folder,
                .programs = programs(),
                .only_faults = arguments.faults,
                .only_finders = arguments.quick,
                .seed = arguments.seed,
                .cancelled = begun->cancelled(),
                .every_pair = arguments.every_pair,
                .jobs = arguments.jobs,
                .on_case =
                    [&](const CaseResult& one) {
                      if (!is_good(one.outcome.verdict) && one.outcome.verdict != Verdict::unsupported) {
                        tree.add(one);
                      }
                    },
                .on_fault =
                    [&](const FaultResult& one) {
                      std::string names;
                      for (const std::string& id : one.found_by) {
                        names += (names.empty() ? "" : ", ") + id;
                      }
                      const bool is_found = !one.found_by.empty();
                      fmt::print("{}{:>9}{}  {:28} {}{}{}\n", is_found ? colours.green : colours.red,
                                 is_found ? "found" : "NOT FOUND", colours.off, one.fault.name, colours.dim,
                                 is_found ? names
                                          : fmt::format("{}; tried {} cases, of which {} could not be judged",
                                                        one.fault.what, one.tried, one.unjudged.size()),
                                 colours.off);
                      std::fflush(stdout);
                    }});
  // Whether a case is blind is known when it has met all faults.
  const bool all_faults = arguments.faults.empty();
  const std::vector<std::string> passing = result.blind_cases();
  for (const std::string& id : passing) {
    fmt::print("{}{:>9}{}  {} fails with none of the{} faults\n", colours.yellow,
               all_faults ? "blind" : "passes", colours.off, id, all_faults ? "" : " chosen");
  }
  fmt::print("without a fault: {}\n", summary(result.reference, colours));
  // Those that the device fails without a fault, or that cannot be judged, show nothing with one.
  const std::size_t judged = result.reference.cases.size() - result.reference.count(Verdict::unsupported);
  fmt::print("{} of {} faults are found; {} of {} cases fail with a fault", result.found(),
             result.faults.size(), result.passed() - passing.size(), judged);
  if (judged != result.passed()) {
    fmt::print("; {} do not pass without one", judged - result.passed());
  }
  if (const std::size_t left_out = result.reference.count(Verdict::unsupported); left_out > 0) {
    fmt::print("; {} unsupported", left_out);
  }
  fmt::print("\n");
  const bool good = !result.reference.cancelled && result.found() == result.faults.size() &&
                    result.passed() == judged && (passing.empty() || !all_faults);
  return good ? cli::exit_ok : cli::exit_failure;
}

void add_selection(CLI::App& command, Arguments& arguments) {
  command.add_option(
      "SELECTOR", arguments.selectors,
      "Only these: ids of cases ('sd.offer.ttl'), their start ('sd.offer'), patterns ('*.ttl'), TC8 ids, ids "
      "of requirements");
  cli::option(
      command, "--level", arguments.level, "LEVEL",
      "must: what the specification demands. should: also what it advises. tc8: also what only TC8 asks for")
      ->check(CLI::IsMember({"must", "should", "tc8"}));
  cli::option(command, "--role", arguments.role, "ROLE",
              "Cases of the device as a server, as a client, or both")
      ->check(CLI::IsMember({"server", "client", "both"}));
}

}  // namespace

void add_conform_command(CLI::App& app, int& status, const generate::SourceReaders& readers) {
  CLI::App* conform = app.add_subcommand("conform", "Test whether a device does what SOME/IP asks of it");
  conform->require_subcommand(1);
  const auto command = [&](const char* name, const char* what, int (*action)(const Arguments&),
                           const char* footer, bool with_device) {
    const auto arguments = std::make_shared<Arguments>();
    CLI::App* one = conform->add_subcommand(name, what);
    add_selection(*one, *arguments);
    if (with_device) {
      add_device_options(*one, *arguments);
    }
    one->footer(footer);
    one->callback([arguments, action, &status] {
      try {
        status = action(*arguments);
      } catch (const TesterError& error) {
        // The addresses come from the profile and the command line.
        fmt::print(stderr, "error: {}\n", error.what());
        status = cli::exit_usage;
      }
    });
    return std::pair{one, arguments};
  };
  const auto [run_command, run_arguments] =
      command("run", "Run cases against a device", run,
              "Examples:\n"
              "  trestle conform run --dut examples/ets_device/profile.yaml\n"
              "  trestle conform run sd.offer 'sd.subscribe.ack.*' --dut my_ecu.yaml --out results\n"
              "Exit status: 0 when no case failed, 1 when one did or could not be judged, 2 when the command "
              "line or the\n"
              "profile is wrong. docs/conform.md explains profiles, verdicts and results.",
              true);
  // What a person looks at is one device at its own addresses.
  run_arguments->jobs = 1;
  cli::option(*run_command, "--jobs", run_arguments->jobs, "N",
              "So many devices at once, where the profile starts one on loopback")
      ->check(CLI::Range(1, 64));
  run_command->add_flag("-q,--quiet", run_arguments->quiet,
                        "Print only cases that fail, or cannot be judged");
  command("list", "List cases", list, "Example:\n  trestle conform list sd --level must", false);
  command("explain", "Say what cases are about: requirements and TC8 cases in our words", explain,
          "Examples:\n"
          "  trestle conform explain sd.offer.ttl\n"
          "  trestle conform explain feat_req_someipsd_614",
          false);
  const auto [test_command, test_arguments] = command(
      "selftest", "Show that the cases find faults: run them against a device with faults made on purpose",
      check_itself,
      "Examples:\n"
      "  trestle conform selftest --dut examples/ets_device/profile.yaml\n"
      "  trestle conform selftest --dut examples/ets_device/profile.yaml --fault ack-ttl --quick\n"
      "Exit status: 0 when all faults are found, each case passes without a fault, and fails with one "
      "(without "
      "--fault);\n1 otherwise.",
      true);
  add_profile_command(*conform, status, readers);
  add_replay_command(*conform, status);
  add_results_commands(*conform, status);
  test_command->add_option("--fault", test_arguments->faults, "Only this fault; can be repeated")
      ->type_name("NAME");
  cli::option(
      *test_command, "--jobs", test_arguments->jobs, "N",
      "So many devices at once, on loopback; cases mostly wait, so that may be more than there are cores")
      ->check(CLI::Range(1, 64));
  test_command->add_flag("--every", test_arguments->every_pair,
                         "Every case that may find a fault, also when it is found already");
  test_command->add_flag("--quick", test_arguments->quick, "Only cases that may find one of the faults");
}

}  // namespace trestle::conform
