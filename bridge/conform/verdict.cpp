#include "bridge/conform/verdict.hpp"

#include <fmt/format.h>

namespace trestle::conform {

const char* to_string(Verdict verdict) noexcept {
  switch (verdict) {
    case Verdict::pass:
      return "pass";
    case Verdict::pass_nonstrict:
      return "pass-nonstrict";
    case Verdict::fail:
      return "fail";
    case Verdict::inconclusive:
      return "inconclusive";
    case Verdict::unsupported:
      return "unsupported";
    case Verdict::error:
      return "error";
  }
  return "error";
}

Attempt settled(Attempt attempt) {
  if (attempt.verdict == Verdict::error || attempt.verdict == Verdict::unsupported) {
    return attempt;
  }
  if (!attempt.alive_before) {
    attempt.verdict = Verdict::inconclusive;
    attempt.reason = "the device did not answer before the case began";
    return attempt;
  }
  const bool good = attempt.verdict == Verdict::pass || attempt.verdict == Verdict::pass_nonstrict;
  if (attempt.stalled && (!good || !attempt.alive_after)) {
    attempt.verdict = Verdict::inconclusive;
    attempt.reason =
        "the tester did not run for a while; before that: " +
        (attempt.reason.empty() ? std::string{"no answer to the check afterwards"} : attempt.reason);
    return attempt;
  }
  if (attempt.verdict == Verdict::pass && attempt.retries > tolerated_retries && !attempt.stalled) {
    attempt.verdict = Verdict::pass_nonstrict;
    attempt.reason = fmt::format("it {}; {} messages were sent again", attempt.retried, attempt.retries);
  }
  if (!attempt.alive_after) {
    attempt.verdict = Verdict::fail;
    attempt.reason = (attempt.reason.empty() ? "" : attempt.reason + "; ") +
                     std::string{"the device does not answer any more after this"};
  }
  return attempt;
}

bool try_again(const Attempt& settled_attempt, int attempts_made) noexcept {
  return settled_attempt.verdict == Verdict::inconclusive && attempts_made < max_attempts;
}

}  // namespace trestle::conform
