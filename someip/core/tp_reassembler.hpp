#pragma once
#include <array>
#include <optional>

#include "someip/wire/counters.hpp"
#include "someip/wire/endpoint.hpp"
#include "someip/wire/tp.hpp"

namespace trestle::someip {

/// Why the reassembler refused a segment or lost a message.
enum class TpDrop : std::uint8_t {
  malformed,             ///< no TP flag, too short for a TP header, or an empty segment that is not the last
  unaligned,             ///< length no multiple of 16 in a segment that is not the last
  session_zero,          ///< Session ID 0: nothing tells this message from the next  [feat_req_someiptp_762]
  too_large,             ///< reaches beyond max_message_bytes  [feat_req_someiptp_782]
  too_many_from_sender,  ///< the sender has max_per_sender messages under way, and none of them gives way
  no_slot,               ///< all slots are under way, and none of their messages gives way
  inconsistent_end,      ///< contradicts an earlier segment about where the message ends
  overlap,               ///< brings bytes that have come before; those are kept  [feat_req_someiptp_797]
  stale,                 ///< of a message that is already complete, given up or replaced
  replaced,              ///< message lost: the next one of its kind began  [feat_req_someiptp_793]
  aged_out,              ///< message lost: not complete after max_age
  gave_way,              ///< message lost: another one needed its place, and it came slowest
  no_memory,             ///< message lost: the memory of all was used up, and it came slowest; see end()
};
inline constexpr std::size_t tp_drop_count = 13;

/// The reason's name as it stands above, for logs and reports.
[[nodiscard]] const char* to_string(TpDrop reason) noexcept;

/// What a reassembler has seen. `drops` counts refused segments and lost messages by reason; a segment that
/// makes its message be given up counts once. A segment with new bytes beside known ones is used, and counts
/// as an overlap.
struct TpCounters {
  std::uint64_t segments = 0;  ///< all that were offered
  std::uint64_t messages = 0;  ///< completed
  std::array<std::uint64_t, tp_drop_count> drops{};
  [[nodiscard]] constexpr std::uint64_t operator[](TpDrop reason) const noexcept {
    return drops[static_cast<std::size_t>(reason)];
  }
  template <typename Visit>
  constexpr void for_each_counter(Visit visit) const {
    using enum CounterKind;
    visit("segments_received", segments, traffic);
    visit("messages_received", messages, traffic);
    for (std::size_t i = 0; i < tp_drop_count; ++i) {
      visit(to_string(static_cast<TpDrop>(i)), drops[i], loss);
    }
  }
  friend constexpr bool operator==(const TpCounters&, const TpCounters&) = default;
};

/// How many words of `map` a TpSlot needs for messages of this size: a bit for each 16 bytes.
[[nodiscard]] constexpr std::size_t tp_map_words(std::size_t max_message_bytes) noexcept {
  constexpr std::size_t bytes_per_word = std::size_t{16} * 32;
  return max_message_bytes / bytes_per_word + (max_message_bytes % bytes_per_word == 0 ? 0 : 1);
}

/// Room for one message while it is reassembled. All memory is the caller's and outlives the reassembler.
class TpSlot {
 public:
  /// Neither memory is read before it is written, so it need not be cleared.
  ///
  /// @param buffer  at least max_message_bytes.
  /// @param map     at least tp_map_words() of them: it tells which bytes are there while others before them
  ///                are missing.  [feat_req_someiptp_789] [feat_req_someiptp_820] [feat_req_someiptp_790]
  constexpr TpSlot(ByteSpan buffer, std::span<std::uint32_t> map) noexcept : buffer_{buffer}, map_{map} {}

 private:
  friend class TpReassembler;
  enum class State : std::uint8_t { unused, collecting, finished };

  [[nodiscard]] constexpr bool has_gaps() const noexcept { return received_ != high_water_; }

  ByteSpan buffer_;
  std::span<std::uint32_t> map_;  ///< from mapped_from_ to high_water_, and while there are gaps
  Endpoint from_;
  Header header_;         ///< with TP flag and the session of the message
  SessionId previous_{};  ///< the session before that one
  State state_ = State::unused;
  bool written_ = false;              ///< since forget() has named it
  std::optional<std::uint32_t> end_;  ///< where the message ends, once the last segment has told
  std::uint32_t received_ = 0;        ///< bytes that are there
  std::uint32_t high_water_ = 0;      ///< where the furthest received byte ends
  std::uint32_t mapped_from_ = 0;     ///< all before it is there
  TimePoint until_{};                 ///< collecting: when it is too old; finished: when it is forgotten
};

/// A message put together. `payload` points into a slot's buffer until the next on_segment() or on_time().
struct Reassembled {
  Header header;  ///< without TP flag; return code of the segment that came last  [feat_req_someiptp_784]
  ByteView payload;
  Endpoint from;
  std::size_t slot;
};

/// What a TpReassembler stores at most, and how long.
struct TpReassemblyLimits {
  std::size_t max_message_bytes;  ///< payload of a message; at most 0xfffffff7
  std::size_t max_per_sender;     ///< messages under way from one IP address, whatever its ports
  /// From a message's first segment to its last. For as long again after that its Session ID is remembered,
  /// so that stragglers and duplicates do not begin it anew.
  Duration max_age;
  /// A message that comes at least this fast, from its first segment to now, keeps its slot; the slowest of
  /// the others gives way to a message that begins when no slot is free. 0: none does.
  std::uint32_t protected_bytes_per_s = 1'000'000;
};

/// Puts SOME/IP-TP segments together again.
///
/// A message is told from others by sender, Message ID, Client ID, versions and type
/// [feat_req_someiptp_781] [feat_req_someiptp_787]; another Session ID begins the next one of its kind and
/// ends the wait for the old one [feat_req_someiptp_795]. Segments may come in any order
/// [feat_req_someiptp_789] [feat_req_someiptp_820] [feat_req_someiptp_790]. A segment in order costs a
/// comparison of headers and one copy; one that leaves a gap or fills one, some words of a map beside.
/// Nothing is done byte by byte.
///
/// At most slots.size() messages are under way, and nothing is ever stored outside the slots. Whoever begins
/// many messages and leaves them unfinished, be it in the name of others, keeps nobody out: when no slot is
/// free, or the sender has its share, the slowest message gives way, unless all are fast. Only the segment
/// that begins a message, at offset 0, has that effect, so that the rest of those that gave way does not
/// drive out others; a segment in the middle takes the place only of what has as good as stopped.
class TpReassembler {
 public:
  TpReassembler(std::span<TpSlot> slots, const TpReassemblyLimits& limits) noexcept;

  /// Takes one received segment: a message whose type has the TP flag.
  /// @return the message if the segment made it complete, nothing if others are awaited, or why the segment
  ///         was dropped. too_large, inconsistent_end, malformed and unaligned also give up the message that
  ///         the segment belongs to, the rest of which is then stale.  [feat_req_someiptp_792]
  [[nodiscard]] Result<std::optional<Reassembled>, TpDrop> on_segment(const Endpoint& from,
                                                                      const Message& segment,
                                                                      TimePoint now) noexcept;

  /// Gives up messages that are too old. Early and repeated calls change nothing; on_segment() does it too.
  void on_time(TimePoint now) noexcept;
  /// When on_time() has something to do, if nothing else happens; nothing while no message is under way.
  [[nodiscard]] std::optional<TimePoint> deadline() const noexcept;

  [[nodiscard]] const TpCounters& counters() const noexcept { return counters_; }
  /// Messages under way.
  [[nodiscard]] std::size_t size() const noexcept;

  // For a caller that takes the memory of slots from the system, and gives it back.

  /// Other slots: the same, and some more or some less at the end, where used() tells which have to stay.
  void use(std::span<TpSlot> slots) noexcept { slots_ = slots; }
  /// Whether the slot has a message under way, or remembers one.
  [[nodiscard]] bool used(std::size_t slot) const noexcept {
    return slots_[slot].state_ != TpSlot::State::unused;
  }
  /// Forgets messages whose time is over.
  /// @return a slot that was written and is not used() any more: each once, then nothing.
  std::optional<std::size_t> forget(TimePoint now) noexcept;
  /// When forget() has something to do, if nothing else happens.
  [[nodiscard]] std::optional<TimePoint> forget_deadline() const noexcept;
  /// The slot that the last segment went to which was not dropped.
  [[nodiscard]] std::size_t recent() const noexcept { return recent_; }
  [[nodiscard]] bool under_way(std::size_t slot) const noexcept {
    return slots_[slot].state_ == TpSlot::State::collecting;
  }
  /// Since when a slot that is not under way is of no use any more, or will be.
  [[nodiscard]] TimePoint until(std::size_t slot) const noexcept { return slots_[slot].until_; }
  /// How fast a message under way comes, in bytes per second from its first segment to now.
  [[nodiscard]] std::uint64_t rate(std::size_t slot, TimePoint now) const noexcept;
  /// Whether a message under way keeps its slot.
  [[nodiscard]] bool is_protected(std::size_t slot, TimePoint now) const noexcept {
    return rate(slot, now) >= limits_.protected_bytes_per_s;
  }
  /// Ends a message under way; what still comes of it is stale.
  /// @return for on_segment() to return, if the segment was of it.
  Result<std::optional<Reassembled>, TpDrop> end(std::size_t slot, TpDrop reason, TimePoint now) noexcept {
    return give_up(slots_[slot], reason, now);
  }
  /// Counts a segment that is not taken.
  Result<std::optional<Reassembled>, TpDrop> refuse(TpDrop reason) noexcept {
    ++counters_.segments;
    return drop(reason);
  }

 private:
  using Outcome = Result<std::optional<Reassembled>, TpDrop>;

  TpSlot* find(const Endpoint& from, const Header& header, TimePoint now) noexcept;
  /// Whether one more message from this address may be under way; if need be, another one of it gives way.
  bool within_share(const IpAddress& address, bool at_start, TimePoint now) noexcept;
  /// Ends the slowest message, of all or of this sender. Nothing if none gives way.
  TRESTLE_ONCE TpSlot* make_way(const IpAddress* sender, bool at_start, TimePoint now) noexcept;
  /// Since the message began, in units of 1024 ns; at least 1.
  [[nodiscard]] std::uint64_t age(const TpSlot& slot, TimePoint now) const noexcept;
  TpSlot* vacant() noexcept;
  void begin(TpSlot& slot, const Endpoint& from, const Header& header, TimePoint now) noexcept;
  Outcome add(TpSlot& slot, const TpView& segment, ReturnCode code, TimePoint now) noexcept;
  std::optional<TpDrop> contradiction(const TpSlot& slot, const TpView& segment) const noexcept;
  /// Copies what is missing and lies before high_water_. How many bytes that was.
  static std::uint32_t fill_gaps(TpSlot& slot, std::uint32_t offset, ByteView slice) noexcept;
  void finish(TpSlot& slot, TimePoint now) const noexcept;
  TRESTLE_ONCE Outcome give_up(TpSlot& slot, TpDrop reason, TimePoint now) noexcept;
  TRESTLE_ONCE Outcome drop(TpDrop reason) noexcept;
  TRESTLE_ONCE void count(TpDrop reason) noexcept { ++counters_.drops[static_cast<std::size_t>(reason)]; }

  std::span<TpSlot> slots_;
  TpReassemblyLimits limits_;
  std::size_t recent_ = 0;  ///< the slot that the last segment went to: most likely the next one's
  TimePoint earliest_ = TimePoint::max();  ///< no message under way is too old before this
  TpCounters counters_;
};

}  // namespace trestle::someip
