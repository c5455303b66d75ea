#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "someip/wire/types.hpp"

namespace trestle::carry {

/// How much may be logged, so that nobody fills a disk from outside: at most 56 kB in any ten seconds, which
/// two windows touch. In a window 8 kB are for lines of one kind, and 28 kB for all, of which 6 kB are for
/// kinds that say little, and 2 kB for errors. Lines are of one kind when they differ in numbers alone.
class LogBudget {
 public:
  static constexpr Duration window = std::chrono::seconds{10};
  static constexpr std::size_t most_of_a_kind = 8'000;
  static constexpr std::size_t most_of_talkers = 20'000;
  static constexpr std::size_t most_of_warnings = 26'000;
  static constexpr std::size_t most = 28'000;

  /// Whether the line may be logged; what may not is counted.
  /// @param error  whether it tells of an error; else what it says is less.
  [[nodiscard]] bool take(std::string_view line, TimePoint now, bool error = false);
  /// What is to be said of lines that were left out in a window that is over, once; call it before take().
  [[nodiscard]] std::vector<std::string> left_out(TimePoint now);
  /// The same at the end, when no window will follow.
  [[nodiscard]] std::vector<std::string> left_out();

 private:
  struct Kind {
    std::size_t bytes = 0;
    std::uint64_t left_out = 0;
    std::string example;
  };
  /// Of errors, so that no warning counts as their kind; then of warnings and less.
  static constexpr std::size_t kinds_of_errors = 16;
  static constexpr std::size_t kinds_of_others = 64;
  std::array<Kind, kinds_of_errors + kinds_of_others> kinds_{};
  std::size_t bytes_ = 0;
  TimePoint begin_{};
};

}  // namespace trestle::carry
