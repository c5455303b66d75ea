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

/// Everything that lives as long as a run.
struct Run {
  const Profile& profile;
  const RunOptions& options;
  Tester tester{profile.tester, profile.multicast, profile.sd_port};
  Device device{profile, options.programs, options.folder + "/device.log", options.fault};
  SdSessions sessions{};
};

Attempt attempt_at(const Case& one, Run& run) {
  run.tester.forget();
  Trial trial{run.profile, run.tester, run.device, run.sessions};
  Attempt attempt;
  try {
    const bool alive = trial.is_there();
    if (alive) {
      try {
        one.run(trial);
        attempt = trial.attempt();
      } catch (const Ended& ended) {
        attempt = trial.attempt();
        // What was noted before says more than that something else did not come.
        if (attempt.verdict != Verdict::fail || ended.verdict != Verdict::fail) {
          attempt.verdict = ended.verdict;
          attempt.reason = ended.reason;
        }
      }
      attempt.alive_after = trial.alive();
    }
    attempt.alive_before = alive;
    attempt.stalled = run.tester.stalled() > Duration{0};
    trial.clean_up();
    // What the clean-up made the device say belongs to no other case.
    (void)trial.alive();
    run.tester.close_all();
  } catch (const std::exception& error) {
    attempt.verdict = Verdict::error;
    attempt.reason = error.what();
    run.tester.close_all();
  }
  return settled(attempt);
}

void write_evidence(const Case& one, const Attempt& outcome, Run& run, CaseResult& result) {
  result.evidence = one.id + ".pcapng";
  const std::string title = fmt::format("{}: {} ({}){}{}", one.id, one.title, to_string(outcome.verdict),
                                        outcome.reason.empty() ? "" : ": ", outcome.reason);
  std::ofstream{run.options.folder + "/" + result.evidence, std::ios::binary}
      << pcapng(run.tester.packets(), title);
}

CaseResult run_one(const Case& one, Run& run) {
  CaseResult result{.what = &one};
  const Clock::time_point began = Clock::now();
  if (const auto why = unsupported(one, run.profile)) {
    result.outcome = {.verdict = Verdict::unsupported, .reason = *why};
    return result;
  }
  do {
    result.outcome = attempt_at(one, run);
    ++result.attempts;
  } while (try_again(result.outcome, result.attempts));
  if (run.options.keep_evidence) {
    write_evidence(one, result.outcome, run, result);
  }
  result.took = std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - began);
  return result;
}

void await_device(Run& run) {
  Trial trial{run.profile, run.tester, run.device, run.sessions};
  const Clock::time_point until = Clock::now() + run.profile.timing.ready_within;
  while (!trial.is_there() && Clock::now() < until) {
  }
  trial.clean_up();
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
  await_device(run);
  for (const Case* one : cases) {
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
  run.device.stop();
  result.took = std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - began);
  return result;
}

}  // namespace trestle::conform
