#pragma once
#include <cstdint>
#include <string>
#include <vector>

/// What became of a case. Nothing here knows a network: verdicts are made of what was seen.
namespace trestle::conform {

enum class Verdict : std::uint8_t {
  pass,
  pass_nonstrict,  ///< what was done is allowed, or only advised against; the reason says what was expected
  fail,
  inconclusive,  ///< the tester stalled, the case took too long, or the device was not there before: nothing
                 ///< can be said
  unsupported,   ///< the profile says that the device cannot do this
  error,         ///< the runner itself could not go on
};

inline constexpr Verdict all_verdicts[]{Verdict::pass,         Verdict::pass_nonstrict, Verdict::fail,
                                        Verdict::inconclusive, Verdict::unsupported,    Verdict::error};

/// Whether the device does what it has to.
[[nodiscard]] constexpr bool is_good(Verdict verdict) noexcept {
  return verdict == Verdict::pass || verdict == Verdict::pass_nonstrict;
}

/// "pass", "pass-nonstrict", ...
[[nodiscard]] const char* to_string(Verdict verdict) noexcept;

/// One field that is not as it should be.
struct Difference {
  std::string field;  ///< "Session ID"
  std::string expected;
  std::string actual;
  std::uint64_t packet = 0;  ///< its number in the evidence; 0: none
};

/// What one attempt at a case showed.
struct Attempt {
  Verdict verdict = Verdict::pass;
  std::string reason{};  ///< why it is no plain pass
  std::vector<Difference> differences{};
  /// How often something was sent again, as no answer came: over UDP a datagram may get lost.
  int retries = 0;
  /// "answered the 3rd of 3 requests": of what took most; empty: nothing was sent again.
  std::string retried{};
  bool alive_before = true;  ///< the device answered before
  bool alive_after = true;   ///< and afterwards
  bool stalled = false;      ///< the tester itself did not run for a while
};

/// More than one datagram that gets lost in one case is no accident any more.
inline constexpr int tolerated_retries = 1;

/// Judges an attempt with what is known of its surroundings:
/// - where the device did not even answer before, nothing can be said;
/// - where the tester stalled, a failure may be its own;
/// - a device that had to be asked again and again is no plain pass;
/// - a device that does not answer any more afterwards has failed, whatever it did before.
[[nodiscard]] Attempt settled(Attempt attempt);

inline constexpr int max_attempts = 3;
/// Whether to try once more.
[[nodiscard]] bool try_again(const Attempt& settled_attempt, int attempts_made) noexcept;

}  // namespace trestle::conform
