#include "bridge/conform/runner.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <fstream>

#include "bridge/conform/capture_writer.hpp"
#include "bridge/conform/device.hpp"
#include "bridge/conform/tester.hpp"
#include "bridge/conform/trial.hpp"

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
};

/// Somebody wants the run to end.
struct Cancelled {};

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
    if (until_ && Clock::now() >= *until_) {
      // Why it takes so long nobody knows, unless it is the tester's own fault.
      throw Ended{run_.tester.stalled() > Duration{0} ? Verdict::inconclusive : Verdict::error,
                  fmt::format("the case is not over after {:.1f} s, which is its time budget",
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
    // What was noted before says more than that something else did not come, or that it takes too long.
    if (attempt.verdict != Verdict::fail ||
        (ended.verdict != Verdict::fail && ended.verdict != Verdict::error)) {
      attempt.verdict = ended.verdict;
      attempt.reason = ended.reason;
    }
  }
  watch.done();
  return attempt;
}

Attempt attempt_at(const Case& one, Run& run) {
  Watch watch{run};
  run.tester.forget();
  Trial trial{run.profile, run.tester, run.device, run.sessions};
  trial.begin(run.options.seed, one.id);
  Attempt attempt;
  try {
    const bool alive = trial.is_there();
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
  const std::string title = fmt::format("{}: {} ({}){}{}", one.id, one.title, to_string(outcome.verdict),
                                        outcome.reason.empty() ? "" : ": ", outcome.reason);
  std::ofstream{run.options.folder + "/" + result.evidence, std::ios::binary}
      << pcapng(run.tester.packets(), title);
}

void await_device(Run& run) {
  const Watch watch{run};
  Trial trial{run.profile, run.tester, run.device, run.sessions};
  const Clock::time_point until = Clock::now() + run.profile.timing.ready_within;
  while (!(run.has_answered = trial.is_there()) && Clock::now() < until) {
  }
  trial.clean_up();
}

/// A device that a case has killed is started anew, so that the next case has one. One that never answered
/// would not do so then either.
void revive(Run& run) {
  const LifecycleProfile& commands = run.profile.lifecycle;
  if (run.has_answered && !(commands.start.empty() && commands.restart.empty())) {
    run.device.restart(true);
    await_device(run);
  }
}

/// Leaves a device that answers, where that can be.
Attempt attempt_with_device(const Case& one, Run& run) {
  Attempt outcome = attempt_at(one, run);
  if (!outcome.alive_before || !outcome.alive_after) {
    revive(run);
  }
  return outcome;
}

CaseResult run_one(const Case& one, Run& run) {
  CaseResult result{.what = &one};
  const Clock::time_point began = Clock::now();
  if (const auto why = unsupported(one, run.profile)) {
    result.outcome = {.verdict = Verdict::unsupported, .reason = *why};
    return result;
  }
  result.outcome = attempt_with_device(one, run);
  for (result.attempts = 1; try_again(result.outcome, result.attempts); ++result.attempts) {
    // Whatever was in the way may be over by then.
    const Watch watch{run};
    run.tester.receive(result.attempts * pause_between_attempts, [] { return false; });
    result.outcome = attempt_with_device(one, run);
  }
  if (run.options.keep_evidence) {
    write_evidence(one, result.outcome, run, result);
  }
  result.took = std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - began);
  return result;
}

}  // namespace

std::size_t RunResult::count(Verdict verdict) const {
  return static_cast<std::size_t>(std::ranges::count_if(
      cases, [verdict](const CaseResult& one) { return one.outcome.verdict == verdict; }));
}

RunResult run_cases(const Profile& profile, const std::vector<const Case*>& cases,
                    const RunOptions& options) {
  const Clock::time_point began = Clock::now();
  RunResult result{.started = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)))};
  Run run{profile, options};
  run.device.start();
  try {
    await_device(run);
    for (const Case* one : cases) {
      if (options.skip && options.skip(*one)) {
        continue;
      }
      if (options.on_begin) {
        options.on_begin(*one);
      }
      result.cases.push_back(run_one(*one, run));
      if (options.on_end) {
        options.on_end(result.cases.back());
      }
      if (options.stop_at_failure && result.cases.back().outcome.verdict == Verdict::fail) {
        break;
      }
    }
  } catch (const Cancelled&) {
    result.cancelled = true;
  }
  run.device.stop();
  result.took = std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - began);
  return result;
}

}  // namespace trestle::conform
