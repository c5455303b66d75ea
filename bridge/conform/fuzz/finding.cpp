#include "bridge/conform/fuzz/finding.hpp"

#include <algorithm>
#include <utility>

namespace trestle::conform {

const char* to_string(FindingKind kind) noexcept {
  switch (kind) {
    case FindingKind::ended:
      return "crash";
    case FindingKind::silent:
      return "silence";
    case FindingKind::restarted:
      return "restart";
    case FindingKind::breaks_rule:
      return "rule";
    case FindingKind::slow:
      return "slowness";
    case FindingKind::grows:
      return "memory";
    case FindingKind::leaks:
      return "descriptors";
  }
  return "?";
}

namespace {

using Shows = std::function<bool(const Sequence&)>;

/// Tries a smaller sequence as long as there is budget; takes it when it shows the same.
bool take(Sequence& sequence, Sequence smaller, std::size_t& budget, const Shows& shows) {
  if (budget == 0) {
    return false;
  }
  --budget;
  if (!shows(smaller)) {
    return false;
  }
  sequence = std::move(smaller);
  return true;
}

/// Halves first, then quarters, down to single steps.
void leave_out_steps(Sequence& sequence, std::size_t& budget, const Shows& shows) {
  for (std::size_t count = (sequence.steps.size() + 1) / 2; count > 0; count /= 2) {
    for (std::size_t at = 0; at < sequence.steps.size() && sequence.steps.size() > 1 && budget > 0;) {
      Sequence smaller = sequence;
      const std::size_t end = std::min(at + count, smaller.steps.size());
      smaller.steps.erase(smaller.steps.begin() + static_cast<std::ptrdiff_t>(at),
                          smaller.steps.begin() + static_cast<std::ptrdiff_t>(end));
      if (smaller.steps.empty() || !take(sequence, std::move(smaller), budget, shows)) {
        at += count;
      }
    }
  }
}

/// The end of each step's bytes, with its lengths set right and without.
void cut_bytes(Sequence& sequence, std::size_t& budget, const Shows& shows) {
  constexpr std::size_t header_bytes = 16;
  for (std::size_t at = 0; at < sequence.steps.size(); ++at) {
    while (sequence.steps[at].bytes.size() > header_bytes && budget > 0) {
      Sequence smaller = sequence;
      fuzz::Bytes& bytes = smaller.steps[at].bytes;
      bytes.resize(header_bytes + (bytes.size() - header_bytes) / 2);
      Sequence repaired = smaller;
      fuzz::repair_lengths(repaired.steps[at].bytes);
      if (!take(sequence, std::move(repaired), budget, shows) &&
          !take(sequence, std::move(smaller), budget, shows)) {
        break;
      }
    }
  }
}

}  // namespace

Sequence minimised(Sequence sequence, std::size_t budget, const Shows& shows) {
  leave_out_steps(sequence, budget, shows);
  cut_bytes(sequence, budget, shows);
  return sequence;
}

}  // namespace trestle::conform
