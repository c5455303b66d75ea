#include "bridge/conform/runner.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <fstream>

#include "bridge/conform/capture_writer.hpp"
#include "bridge/conform/device.hpp"
#include "bridge/conform/tester.hpp"
#include "bridge/conform/trial.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::conform {
namespace {

using Clock = std::chrono::steady_clock;

/// The second one is twice as long.
constexpr Duration pause_between_attempts = std::chrono::milliseconds{500};

/// Everything that lives as long as a run.
struct Run {
  const Profile& profile;
  const RunOptions& options;
  Tester tester{profile.tester, profile.multicast, profile.sd_port};
  Device device{profile, options.programs, options.folder + "/device.log", options.fault};
  SdSessions sessions{};
  /// It has answered since it was started last.
  bool has_answered = false;
  /// But before or after the case that was last, it did not.
  bool lost = false;
};

/// Somebody wants the run to end.
struct Cancelled {};

/// A case takes longer than its time budget.
struct OverBudget {
  std::string reason;
};

/// The device that the tester started has ended by itself.
struct DeviceEnded {
  std::string how;
};

/// Ends what waits when somebody wants the run to end, and a case when its time is over.
class Watch {
 public:
  explicit Watch(Run& run) : run_{run} {
    run.tester.watch([this] { check(); });
  }
  ~Watch() {
    run_.tester.watch([] {});
  }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  /// From now on until done().
  void limit(Duration budget) {
    budget_ = budget;
    until_ = Clock::now() + budget;
  }
  void done() { until_.reset(); }

 private:
  void check() const {
    if (run_.options.cancelled && run_.options.cancelled()) {
      throw Cancelled{};
    }
    if (const auto how = run_.device.ended()) {
      throw DeviceEnded{*how};
    }
    if (until_ && Clock::now() >= *until_) {
      throw OverBudget{fmt::format(
          "the case is not over after {:.1f} s, which is its time budget; a device that needs long for its "
          "answers has a longer answer_within in its profile (timing)",
          std::chrono::duration<double>(budget_).count())};
    }
  }

  Run& run_;
  Duration budget_{};
  std::optional<Clock::time_point> until_{};
};

/// A device that has more time for its answers, or for its start, gets more time for the case, too.
Duration budget_of(const Case& one, const Profile& profile) {
  const bool starts = has(one.needs, Need::restart) || has(one.needs, Need::stop);
  return one.budget * std::max<std::int64_t>(1, profile.timing.answer_within / std::chrono::seconds{1}) +
         (starts ? 2 * profile.timing.ready_within : Duration{0});
}

Attempt outcome_of(const Case& one, Trial& trial, Watch& watch) {
  Attempt attempt;
  watch.limit(budget_of(one, trial.profile));
  try {
    one.run(trial);
    attempt = trial.attempt();
  } catch (const Ended& ended) {
    attempt = trial.attempt();
    attempt.differences.insert(attempt.differences.end(), ended.differences.begin(), ended.differences.end());
    // What was noted before says more than that something else did not come.
    if (attempt.verdict != Verdict::fail || ended.verdict != Verdict::fail) {
      attempt.verdict = ended.verdict;
      attempt.reason = ended.reason;
    }
  } catch (const OverBudget& over) {
    attempt = trial.attempt();
    // A slow tester takes longer, too: only what was noted before tells something of the device.
    if (attempt.verdict != Verdict::fail) {
      attempt.verdict = Verdict::inconclusive;
      attempt.reason = over.reason;
    }
  }
  watch.done();
  return attempt;
}

/// Whether the device answers; waits for it as long as the profile says.
bool await_device(Run& run) {
  const Watch watch{run};
  Trial trial{run.profile, run.tester, run.device, run.sessions};
  const Clock::time_point until = Clock::now() + run.profile.timing.ready_within;
  run.has_answered = trial.is_there();
  while (!run.has_answered && Clock::now() < until) {
    run.has_answered = trial.is_there();
  }
  trial.clean_up();
  return run.has_answered;
}

/// A device that has ended is started again, and one that answers no more is started anew, where the profile
/// has a command for it. One that never answered would not do so then either.
/// @throws DeviceEnded when it ends once more.
void bring_back(Run& run) {
  const LifecycleProfile& commands = run.profile.lifecycle;
  if (run.device.ended()) {
    run.device.start();
  } else if (run.lost && run.has_answered && !(commands.start.empty() && commands.restart.empty())) {
    run.device.restart(true);
  } else {
    return;
  }
  (void)await_device(run);
}

Attempt absent(const DeviceEnded& ended) {
  return {.verdict = Verdict::inconclusive,
          .reason = "the device " + ended.how + " before the case began; see device.log",
          .alive_before = false};
}

/// With a device that answers, where that can be.
Attempt attempt_at(const Case& one, Run& run) {
  try {
    bring_back(run);
  } catch (const DeviceEnded& ended) {
    run.tester.close_all();
    return absent(ended);
  } catch (const std::runtime_error& error) {
    // Of a command, or a person, that was to start it.
    run.tester.close_all();
    return {.verdict = Verdict::error, .reason = error.what(), .alive_before = false};
  }
  Watch watch{run};
  run.tester.forget();
  Trial trial{run.profile, run.tester, run.device, run.sessions};
  trial.begin(run.options.seed, one.id);
  Attempt attempt;
  bool alive = false;
  try {
    alive = trial.is_there();
    if (alive) {
      attempt = outcome_of(one, trial, watch);
      attempt.alive_after = trial.alive();
    }
    attempt.alive_before = alive;
    attempt.stalled = run.tester.stalled() > Duration{0};
    trial.clean_up();
    // What the clean-up made the device say belongs to no other case.
    (void)trial.alive();
    run.tester.close_all();
  } catch (const Cancelled&) {
    trial.clean_up();
    throw;
  } catch (const DeviceEnded& ended) {
    run.tester.close_all();
    if (!alive) {
      return absent(ended);
    }
    attempt = trial.attempt();
    attempt.verdict = Verdict::fail;
    attempt.reason += (attempt.reason.empty() ? "" : "; ") + ("the device " + ended.how) + "; see device.log";
    return attempt;
  } catch (const std::exception& error) {
    attempt.verdict = Verdict::error;
    attempt.reason = error.what();
    run.tester.close_all();
  }
  return settled(attempt);
}

void write_evidence(const Case& one, const Attempt& outcome, Run& run, CaseResult& result) {
  result.evidence = one.id + ".pcapng";
  result.timeline = timeline(run.tester.packets());
  std::string title = fmt::format("{}: {} ({}){}{}", one.id, one.title, to_string(outcome.verdict),
                                  outcome.reason.empty() ? "" : ": ", outcome.reason);
  for (const RequirementId& id : one.requirements) {
    title += fmt::format("\n{}: {}", id.text(), find_requirement(id.text())->summary);
  }
  if (!run.options.command.empty()) {
    title += fmt::format("\nagain: {} {}", run.options.command, one.id);
  }
  std::ofstream{run.options.folder + "/" + result.evidence, std::ios::binary}
      << pcapng(run.tester.packets(), title);
}

Attempt attempt_and_look(const Case& one, Run& run) {
  Attempt outcome = attempt_at(one, run);
  run.lost = !outcome.alive_before || !outcome.alive_after;
  return outcome;
}

/// @param once  the device was not there before, so that it is not waited for again and again.
CaseResult run_one(const Case& one, Run& run, bool once) {
  CaseResult result{.what = &one};
  const Clock::time_point began = Clock::now();
  if (const auto why = unsupported(one, run.profile)) {
    result.outcome = {.verdict = Verdict::unsupported, .reason = *why};
    return result;
  }
  result.outcome = attempt_and_look(one, run);
  for (result.attempts = 1;
       try_again(result.outcome, result.attempts) && !(once && !result.outcome.alive_before);
       ++result.attempts) {
    // Whatever was in the way may be over by then.
    try {
      const Watch watch{run};
      run.tester.receive(result.attempts * pause_between_attempts, [] { return false; });
    } catch (const DeviceEnded&) {
      // It is started again.
    }
    result.outcome = attempt_and_look(one, run);
  }
  if (run.options.keep_evidence) {
    write_evidence(one, result.outcome, run, result);
  }
  result.took = std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - began);
  return result;
}

/// The last line of what the device printed; empty: it printed nothing.
std::string last_line(const std::string& file) {
  constexpr std::streamoff most = 4096;
  std::ifstream in{file, std::ios::binary | std::ios::ate};
  in.seekg(std::max<std::streamoff>(0, static_cast<std::streamoff>(in.tellg()) - most));
  std::string last;
  for (std::string line; std::getline(in, line);) {
    last = line.empty() ? last : line;
  }
  std::ranges::replace_if(
      last, [](char c) { return static_cast<unsigned char>(c) < 0x20; }, '?');
  return last;
}

/// What to look at when the device that the tester started has ended.
std::string hint_of_end(const Run& run) {
  const std::string& command =
      run.options.fault.empty() ? run.profile.lifecycle.start : run.profile.faults.start;
  const std::string log = run.options.folder + "/device.log";
  const std::string line = last_line(log);
  return fmt::format(
      "its command is '{}' (start, in {}); {}",
      filled_in(command, run.profile, run.options.programs, run.options.fault),
      run.profile.file.empty() ? "the profile" : run.profile.file,
      line.empty() ? "it printed nothing" : fmt::format("the last that it printed, in {}: {}", log, line));
}

/// What to look at when the device is not there.
std::string hint(Run& run) {
  if (run.device.ended()) {
    return hint_of_end(run);
  }
  std::string text = fmt::format("look at the addresses in the profile (device {}, tester {}, SD port {}",
                                 someip::to_string(run.profile.device), someip::to_string(run.profile.tester),
                                 run.profile.sd_port);
  text += fmt::format(", service {:#06x}), at firewalls and routes",
                      value(run.profile.services.empty() ? run.profile.used_by_itself().service
                                                         : run.profile.service().service));
  if (!run.profile.lifecycle.start.empty()) {
    text += ", and at what the device printed: " + run.options.folder + "/device.log";
  }
  return text;
}

/// A device that cannot be stopped takes no results along.
/// @param is_left  somebody wants the run to end now.
void end_with(Run& run, RunResult& result, bool is_left) {
  const auto tell = [&](const std::exception& error) {
    if (run.options.on_problem) {
      run.options.on_problem(std::string{"the device may run on: "} + error.what());
    }
  };
  try {
    // One that the tester does not stop is there for the next run.
    if (run.profile.lifecycle.start.empty() && !is_left) {
      bring_back(run);
    }
  } catch (const Cancelled&) {
    result.cancelled = true;
  } catch (const std::runtime_error& error) {
    tell(error);
  }
  try {
    run.device.stop();
  } catch (const std::runtime_error& error) {
    tell(error);
  }
}

/// Says at once when the device is not there after its start.
void begin_with(Run& run) {
  std::string problem;
  try {
    if (!await_device(run)) {
      problem = "does not answer after its start; " + hint(run);
    }
  } catch (const DeviceEnded& ended) {
    run.tester.close_all();
    problem = ended.how + " after its start; " + hint_of_end(run);
  }
  if (!problem.empty() && run.options.on_problem) {
    run.options.on_problem("the device " + problem);
  }
}

}  // namespace

std::size_t RunResult::count(Verdict verdict) const {
  return static_cast<std::size_t>(std::ranges::count_if(
      cases, [verdict](const CaseResult& one) { return one.outcome.verdict == verdict; }));
}

RunResult run_cases(const Profile& profile, const std::vector<const Case*>& cases,
                    const RunOptions& options) {
  const Clock::time_point began = Clock::now();
  bool is_left = false;
  RunResult result{.started = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)))};
  Run run{profile, options};
  run.device.start();
  try {
    begin_with(run);
    std::size_t absences = 0;
    for (const Case* one : cases) {
      if (options.skip && options.skip(*one)) {
        continue;
      }
      if (options.on_begin) {
        options.on_begin(*one);
      }
      result.cases.push_back(run_one(*one, run, absences > 0));
      const Attempt& outcome = result.cases.back().outcome;
      if (outcome.verdict != Verdict::unsupported) {
        absences = outcome.alive_before ? 0 : absences + 1;
      }
      if (options.on_end) {
        options.on_end(result.cases.back());
      }
      if (options.stop_at_failure && outcome.verdict == Verdict::fail) {
        break;
      }
      if (absences >= most_absences && one != cases.back()) {
        result.gave_up =
            fmt::format("the device was not there for {} cases in a row; {}", absences, hint(run));
        result.cancelled = true;
        break;
      }
    }
  } catch (const Cancelled&) {
    result.cancelled = true;
    is_left = true;
  }
  end_with(run, result, is_left);
  result.took = std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - began);
  return result;
}

}  // namespace trestle::conform
