#include "bridge/carry/runtime/log_budget.hpp"

namespace trestle::carry {
namespace {

constexpr std::size_t time_and_level = 24;  // that stand before each line
constexpr std::size_t most_of_a_quiet_kind = 1000;
constexpr std::size_t most_examples = 8;  // in one window
constexpr std::size_t example_characters = 100;

// Addresses and ids are left out, and text that a peer may have chosen comes late.
std::size_t kind_of(std::string_view line) {
  constexpr std::string_view of_numbers = "0123456789abcdefABCDEF";
  std::size_t hash = 0xcbf2'9ce4'8422'2325;
  for (const char character : line.substr(0, 60)) {
    if (of_numbers.find(character) == std::string_view::npos) {
      hash = (hash ^ static_cast<unsigned char>(character)) * 0x100'0000'01b3;
    }
  }
  return hash ^ (hash >> 32U);
}

}  // namespace

bool LogBudget::take(std::string_view line, TimePoint now, bool error) {
  if (now >= begin_ + window) {
    begin_ = now;
    bytes_ = 0;
    for (Kind& kind : kinds_) {
      kind.bytes = 0;
    }
  }
  const std::size_t number = kind_of(line);
  Kind& kind = kinds_[error ? number % kinds_of_errors : kinds_of_errors + number % kinds_of_others];
  const std::size_t size = line.size() + time_and_level;
  const std::size_t allowed = kind.bytes + size > most_of_a_quiet_kind ? most_of_talkers
                              : error                                  ? most
                                                                       : most_of_warnings;
  if (kind.bytes + size > most_of_a_kind || bytes_ + size > allowed) {
    if (kind.left_out++ == 0) {
      kind.example = line.substr(0, example_characters);
    }
    return false;
  }
  kind.bytes += size;
  bytes_ += size;
  return true;
}

std::vector<std::string> LogBudget::left_out(TimePoint now) {
  return now >= begin_ + window ? left_out() : std::vector<std::string>{};
}

std::vector<std::string> LogBudget::left_out() {
  std::vector<std::string> lines;
  std::uint64_t others = 0;
  for (Kind& kind : kinds_) {
    if (kind.left_out == 0) {
      continue;
    }
    if (lines.size() < most_examples) {
      lines.push_back("left out " + std::to_string(kind.left_out) +
                      " more lines of this kind: " + kind.example);
    } else {
      others += kind.left_out;
    }
    kind.left_out = 0;
  }
  if (others > 0) {
    lines.push_back("left out " + std::to_string(others) + " lines of other kinds");
  }
  return lines;
}

}  // namespace trestle::carry
