#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bridge/conform/case.hpp"
#include "bridge/conform/packet_text.hpp"
#include "bridge/conform/profile.hpp"
#include "bridge/conform/verdict.hpp"

namespace trestle::conform {

/// What became of one case.
struct CaseResult {
  const Case* what = nullptr;
  Attempt outcome{};  ///< of the last attempt
  int attempts = 0;
  std::chrono::milliseconds took{0};
  Timeline timeline{};     ///< what the capture has, in short
  std::string evidence{};  ///< the capture, from the folder; empty: nothing was written
};

/// What became of all.
struct RunResult {
  std::vector<CaseResult> cases{};
  std::string started{};  ///< in UTC, "2026-01-31T12:00:00Z"
  std::chrono::milliseconds took{0};
  bool cancelled = false;  ///< there were more cases to run
  /// Why the rest was not run: the device was not there, case after case. Empty: it was not so.
  std::string gave_up{};

  [[nodiscard]] std::size_t count(Verdict verdict) const;
};

struct RunOptions {
  std::string folder{};    ///< for evidence and what the device prints; it exists
  std::string programs{};  ///< the folder of the running program
  std::string fault{};     ///< the device is started with it
  std::uint64_t seed = 1;  ///< of everything random
  std::string command{};   ///< runs a case again when its id is appended; for evidence
  bool keep_evidence = true;
  /// Return at the first case that fails.
  bool stop_at_failure = false;
  /// Asked again and again, also while a case waits; true ends the run, and what was found so far is
  /// returned.
  std::function<bool()> cancelled{};
  /// Asked right before a case; true leaves it out, also from the result.
  std::function<bool(const Case& one)> skip{};
  std::function<void(const Case& one)> on_begin{};
  std::function<void(const CaseResult& result)> on_end{};
  /// What somebody who waits wants to know at once: that the device does not answer, and what may be wrong.
  std::function<void(const std::string& text)> on_problem{};
};

/// So many cases in a row for which the device is not there end a run.
inline constexpr std::size_t most_absences = 3;

/// Starts the device, runs the cases one after the other, and stops it. A device that ends by itself is
/// started again before the next case.
/// @throws TesterError when the tester cannot use its addresses.
/// @throws std::runtime_error when the device cannot be started.
[[nodiscard]] RunResult run_cases(const Profile& profile, const std::vector<const Case*>& cases,
                                  const RunOptions& options);

}  // namespace trestle::conform
