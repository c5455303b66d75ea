#include "bridge/carry/runtime/loop_check.hpp"

#include <algorithm>
#include <cstring>

namespace trestle::carry {
namespace {

using namespace std::chrono_literals;

constexpr auto memory = 1s;
constexpr auto window = 1s;
// A trial lasts until so many would have come, but not longer than the second time.
constexpr std::uint32_t awaited = 8;
constexpr std::chrono::nanoseconds shortest_trial = 50ms;
constexpr std::chrono::nanoseconds longest_trial = 1s;
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

bool LoopCheck::is_repeat(std::uint64_t hash, TimePoint now) const noexcept {
  const Seen& seen = seen_[hash % seen_.size()];
  return seen.last && seen.hash == hash && now - *seen.last <= memory;
}

bool LoopCheck::may_carry(std::uint64_t hash, std::optional<std::uint64_t> from, TimePoint now) noexcept {
  Seen& seen = seen_[hash % seen_.size()];
  if (!is_repeat(hash, now)) {
    seen = {hash, from, now};
    return true;
  }
  seen.last = now;
  if (from && seen.first_from == from) {
    return true;
  }
  if (trial_end_) {
    came_ += now < *trial_end_ ? 1U : 0U;
    return false;
  }
  if (allowed_until_ && now >= *allowed_until_) {
    allowed_until_.reset();
    allowed_ = limits_.repeats;
  }
  if (now - window_begin_ > window) {
    window_begin_ = now;
    repeats_ = 0;
  }
  if (++repeats_ > allowed_) {
    begin_trial(now);
    return false;
  }
  return true;
}

void LoopCheck::begin_trial(TimePoint now) noexcept {
  const std::chrono::nanoseconds took =
      std::max<std::chrono::nanoseconds>(now - window_begin_, std::chrono::nanoseconds{1ms});
  rate_ = static_cast<std::uint32_t>(std::uint64_t{repeats_} * 1'000'000'000U /
                                     static_cast<std::uint64_t>(took.count()));
  rate_ = std::max(rate_, 1U);
  const std::chrono::nanoseconds time =
      std::clamp(std::chrono::nanoseconds{1s} * awaited / rate_, shortest_trial, longest_trial);
  trial_end_ = now + time;
  expected_ = static_cast<std::uint32_t>(rate_ * std::uint64_t(time.count()) / 1'000'000'000U);
  came_ = 0;
}

bool LoopCheck::judge(TimePoint now) noexcept {
  if (!trial_end_ || now < *trial_end_) {
    return false;
  }
  trial_end_.reset();
  repeats_ = 0;
  window_begin_ = now;
  const bool is_ring = came_ <= expected_ / 2;
  allowed_ = is_ring ? limits_.repeats_in_ring : std::max(limits_.repeats, 2 * rate_);
  allowed_until_ = now + (is_ring ? after_ring : after_no_ring);
  return is_ring;
}

}  // namespace trestle::carry
