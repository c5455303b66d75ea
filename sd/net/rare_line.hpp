#pragma once
#include <chrono>
#include <cstdint>
#include <string>
#include <utility>

#include "sd/net/clock.hpp"

namespace trestle::sd {

/// Log lines of one kind, of which one is written in each pause: a peer must not fill the log. Each kind has
/// one of its own, so that no kind hides another.
class RareLine {
 public:
  /// Counts `more` cases. Returns how many the next line reports; 0: no line is due.
  std::uint64_t to_tell(std::uint64_t more, Duration pause = std::chrono::seconds{10}) {
    note(more);
    return more == 0 ? 0 : due(pause);
  }
  /// Counts cases without a line.
  void note(std::uint64_t more) noexcept { unsaid_ += more; }
  /// How many the next line reports, of what is noted already; 0: no line is due.
  std::uint64_t due(Duration pause = std::chrono::seconds{10}) {
    if (unsaid_ == 0) {
      return 0;
    }
    const TimePoint time = now();
    if (time < next_line_) {
      return 0;
    }
    next_line_ = time + pause;
    return std::exchange(unsaid_, 0);
  }

 private:
  TimePoint next_line_{};
  std::uint64_t unsaid_ = 0;
};

/// The end of a line that describes only one of several cases.
[[nodiscard]] inline std::string and_others(std::uint64_t times) {
  return times == 1 ? "" : " (and " + std::to_string(times - 1) + " others before)";
}

}  // namespace trestle::sd
