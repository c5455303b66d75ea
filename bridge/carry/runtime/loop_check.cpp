#include "bridge/carry/runtime/loop_check.hpp"

#include <algorithm>
#include <cstring>

namespace trestle::carry {
namespace {

using namespace std::chrono_literals;

constexpr auto window = 1s;
// A trial lasts until so many would have come, and each so many times, but not longer than the second time.
constexpr std::uint32_t awaited = 8;
constexpr std::uint32_t awaited_rounds = 4;
constexpr std::chrono::nanoseconds shortest_trial = 50ms;
constexpr std::chrono::nanoseconds longest_trial = 2s;
constexpr auto after_ring = 60s;
constexpr auto after_no_ring = 3600s;

std::uint64_t mixed(std::uint64_t hash, std::uint64_t word) noexcept {
  hash = (hash ^ word) * 0x9e3779b97f4a7c15U;
  return hash ^ (hash >> 32U);
}

std::uint64_t mixed(std::uint64_t hash, ByteView bytes) noexcept {
  while (!bytes.empty()) {
    std::uint64_t word = 0;
    const std::size_t size = std::min(bytes.size(), sizeof word);
    std::memcpy(&word, bytes.data(), size);
    hash = mixed(hash, word);
    bytes = bytes.subspan(size);
  }
  return hash;
}

}  // namespace

std::uint64_t message_hash(ByteView message) noexcept {
  constexpr std::size_t most = 128;  // of either end
  const std::uint64_t hash = mixed(mixed(0, message.size()), message.first(std::min(message.size(), most)));
  return message.size() <= most ? hash : mixed(hash, message.last(std::min(message.size() - most, most)));
}

bool LoopCheck::may_carry(std::uint64_t hash, std::optional<std::uint64_t> from, TimePoint now) noexcept {
  const auto before = seen_.note(hash, from, now);
  if (!before) {
    return true;
  }
  if (!trial_end_ && allowed_until_ && now >= *allowed_until_) {
    allowed_until_.reset();
    allowed_ = limits_.repeats;
    returners_ = {};
  }
  if (before->same_sender && std::ranges::find(returners_, from) == returners_.end()) {
    return true;
  }
  if (trial_end_) {
    note_of_trial(*before, from, now);
    return false;
  }
  if (now - window_begin_ > window) {
    window_begin_ = now;
    repeats_ = 0;
    rounds_ = {};
  }
  const std::uint32_t weight = from ? 1 : limits_.weight_of_unnamed;
  rounds_ += before->ago * weight;
  repeats_ += weight;
  if (repeats_ > allowed_) {
    begin_trial(now);
    note_of_trial(*before, from, now);
    return false;
  }
  return true;
}

void LoopCheck::begin_trial(TimePoint now) noexcept {
  const auto took = std::max<std::chrono::nanoseconds>(now - window_begin_, 1ms);
  trial_begin_ = now;
  trial_end_ =
      now + std::clamp<std::chrono::nanoseconds>(
                std::max<std::chrono::nanoseconds>(took * awaited, rounds_ * awaited_rounds) / repeats_,
                shortest_trial, longest_trial);
  ++trial_;
  came_ = 0;
  went_on_ = 0;
  brought_ = {};
}

// What is not carried in the first half has come back to nobody, so that in a ring it is not there in the
// second.
void LoopCheck::note_of_trial(const RecentMessages::Before& before, std::optional<std::uint64_t> from,
                              TimePoint now) noexcept {
  if (now >= *trial_end_) {
    return;
  }
  if (from && std::ranges::find(brought_, from) == brought_.end()) {
    brought_[came_ % brought_.size()] = from;
  }
  ++came_;
  if (now - trial_begin_ < *trial_end_ - now) {
    *before.mark = trial_;
  } else if (*before.mark == trial_) {
    ++went_on_;
  }
}

bool LoopCheck::judge(TimePoint now) noexcept {
  if (!trial_end_ || now < *trial_end_) {
    return false;
  }
  const bool is_ring = went_on_ <= came_ / 8;
  const auto rate =
      static_cast<std::uint32_t>(came_ * std::chrono::nanoseconds{1s} / (*trial_end_ - trial_begin_));
  trial_end_.reset();
  repeats_ = 0;
  rounds_ = {};
  window_begin_ = now;
  allowed_ = is_ring ? limits_.repeats_in_ring : std::max(limits_.repeats, 2 * rate);
  if (is_ring) {
    returners_ = brought_;
  }
  allowed_until_ = now + (is_ring ? after_ring : after_no_ring);
  return is_ring;
}

}  // namespace trestle::carry
