#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <optional>

#include "bridge/carry/runtime/recent_messages.hpp"
#include "someip/wire/types.hpp"

namespace trestle::carry {

/// Names a message by its length and up to 256 of its bytes. Others may have the same.
[[nodiscard]] std::uint64_t message_hash(ByteView message) noexcept;
/// Finds out that a route is part of a ring which is closed by something that does not say it is a bridge: an
/// older version, or another maker's. In a ring the same messages come again and again, from another sender
/// than the first one, but only as long as they are carried. So when many such messages come, the route does
/// not carry them for a moment, in which each would have come again. If they stop, it was a ring, which is
/// empty now. If they do not, several senders just say the same. They may go on, also with twice as many.
///
/// No clock, no memory but its own. docs/several_bridges.md has the figures.
class LoopCheck {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  struct Limits {
    /// It is tried from so many messages in a second on that others sent in the second before.
    std::uint32_t repeats = 100;
    /// The same, in the minute after a ring was found.
    std::uint32_t repeats_in_ring = 10;
    /// As so many counts one whose sender has no name.
    std::uint32_t weight_of_unnamed = 1;
  };

  LoopCheck() = default;
  explicit LoopCheck(const Limits& limits) : limits_{limits}, allowed_{limits.repeats} {}

  /// Of each message that the route is to carry: whether it may.
  /// @param from  names its sender. Nothing: one behind which others are, of whom it says nothing; all that
  ///              it repeats counts.
  [[nodiscard]] bool may_carry(std::uint64_t hash, std::optional<std::uint64_t> from, TimePoint now) noexcept;
  /// Whether such a message was to be carried in the last second.
  [[nodiscard]] bool is_repeat(std::uint64_t hash, TimePoint now) const noexcept {
    return seen_.has(hash, now);
  }

  /// When to judge(); nothing: there is no trial.
  [[nodiscard]] std::optional<TimePoint> deadline() const noexcept { return trial_end_; }
  /// To be called at the deadline, or later.
  /// @return whether the route is part of a ring.
  [[nodiscard]] bool judge(TimePoint now) noexcept;

 private:
  void begin_trial(TimePoint now) noexcept;
  void note_of_trial(const RecentMessages::Before& before, std::optional<std::uint64_t> from,
                     TimePoint now) noexcept;

  Limits limits_{};
  std::uint32_t allowed_ = limits_.repeats;  ///< repeats in a second
  std::optional<TimePoint> allowed_until_{};
  RecentMessages seen_;
  TimePoint window_begin_{};
  std::uint32_t repeats_ = 0;           ///< since then
  std::chrono::microseconds rounds_{};  ///< of these together: the time since each came before
  TimePoint trial_begin_{};
  std::optional<TimePoint> trial_end_{};
  std::uint32_t trial_ = 0;  ///< its number: the mark of messages that came in its first half
  std::uint32_t came_ = 0;   ///< repeats during the trial
  std::array<std::optional<std::uint64_t>, 4> brought_{};  ///< senders of these
  /// Who brought back what went round. Of them each repeat counts, as who sent a message first may be
  /// forgotten.
  std::array<std::optional<std::uint64_t>, 4> returners_{};
  std::uint32_t went_on_ = 0;  ///< of these, in its second half, those that came in the first, too
};

/// Of calls: many clients may have the same question at once. But each may move something, so that 100 are
/// enough from where somebody could close a ring.
inline constexpr LoopCheck::Limits limits_of_calls{
    .repeats = 300, .repeats_in_ring = 10, .weight_of_unnamed = 3};

}  // namespace trestle::carry
