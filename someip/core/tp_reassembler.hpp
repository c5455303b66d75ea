#pragma once
#include <array>
#include <optional>

#include "someip/wire/endpoint.hpp"
#include "someip/wire/tp.hpp"

namespace trestle::someip {

/// Why the reassembler refused a segment or lost a message.
enum class TpDrop : std::uint8_t {
  malformed,             ///< no TP flag, too short for a TP header, or an empty segment that is not the last
  unaligned,             ///< length no multiple of 16 in a segment that is not the last
  session_zero,          ///< Session ID 0: nothing tells this message from the next  [feat_req_someiptp_762]
  too_large,             ///< reaches beyond max_message_bytes  [feat_req_someiptp_782]
  too_many_from_sender,  ///< the sender has max_per_sender messages under way: a further one is refused
  no_slot,               ///< all slots are under way: a further message is refused
  too_many_gaps,         ///< more gaps than a slot can note  [feat_req_someiptp_796]
  inconsistent_end,      ///< contradicts an earlier segment about where the message ends
  overlap,               ///< brings bytes that have come before; those are kept  [feat_req_someiptp_797]
  stale,                 ///< of a message that is already complete, given up or replaced
  replaced,              ///< message lost: the next one of its kind began  [feat_req_someiptp_793]
  aged_out,              ///< message lost: not complete after max_age
};
inline constexpr std::size_t tp_drop_count = 12;

/// The reason's name as it stands above, for logs and reports.
[[nodiscard]] const char* to_string(TpDrop reason) noexcept;

/// What a reassembler has seen. `drops` counts refused segments and lost messages by reason; a segment that
/// makes its message be given up counts once. A segment that brings new bytes beside known ones is used and
/// counts as an overlap.
struct TpCounters {
  std::uint64_t segments = 0;  ///< all that were offered
  std::uint64_t messages = 0;  ///< completed
  std::array<std::uint64_t, tp_drop_count> drops{};
  [[nodiscard]] constexpr std::uint64_t operator[](TpDrop reason) const noexcept {
    return drops[static_cast<std::size_t>(reason)];
  }
  friend constexpr bool operator==(const TpCounters&, const TpCounters&) = default;
};

/// Bytes of a message that are missing although later ones are there.
struct TpGap {
  std::uint32_t begin = 0;
  std::uint32_t end = 0;
};

/// Room for one message while it is reassembled. All memory is the caller's and outlives the reassembler.
class TpSlot {
 public:
  /// @param buffer  at least max_message_bytes; never read before written, so it need not be cleared.
  /// @param gaps    how many gaps one message may have at a time. In order none is needed, in descending
  ///                order one, for a reorder distance of 3 three.  [feat_req_someiptp_790]
  constexpr TpSlot(ByteSpan buffer, std::span<TpGap> gaps) noexcept : buffer_{buffer}, gaps_{gaps} {}

 private:
  friend class TpReassembler;
  enum class State : std::uint8_t { unused, collecting, finished };

  ByteSpan buffer_;
  std::span<TpGap> gaps_;
  Endpoint from_;
  Header header_;         ///< with TP flag and the session of the message
  SessionId previous_{};  ///< the session before that one
  State state_ = State::unused;
  std::optional<std::uint32_t> end_;  ///< where the message ends, once the last segment has told
  std::uint32_t high_water_ = 0;      ///< where the furthest received byte ends
  std::size_t gap_count_ = 0;         ///< the first gaps_, ascending, all below high_water_
  TimePoint until_{};                 ///< collecting: when it is too old; finished: when it is forgotten
};

/// A message put together again. `payload` points into a slot's buffer until the next on_segment() or
/// on_time().
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
};

/// Puts SOME/IP-TP segments together again.
///
/// A message is told from others by sender, Message ID, Client ID, versions and type
/// [feat_req_someiptp_781] [feat_req_someiptp_787]; another Session ID begins the next one of its kind and
/// ends the wait for the old one [feat_req_someiptp_795]. Segments may come in any order
/// [feat_req_someiptp_789] [feat_req_someiptp_820] that leaves no more gaps than a slot can note. A segment
/// in order costs a comparison of headers and one copy, others look at each gap; nothing is done byte by
/// byte.
///
/// At most slots.size() messages are under way, and nothing is ever stored outside the slots.
class TpReassembler {
 public:
  TpReassembler(std::span<TpSlot> slots, const TpReassemblyLimits& limits) noexcept;

  /// Takes one received segment: a message whose type has the TP flag.
  /// @return the message if the segment made it complete, nothing if others are awaited, or why the segment
  ///         was dropped. too_large, too_many_gaps, inconsistent_end, malformed and unaligned also give up
  ///         the message that the segment belongs to, the rest of which is then stale.
  ///         [feat_req_someiptp_792]
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

 private:
  using Outcome = Result<std::optional<Reassembled>, TpDrop>;

  TpSlot* find(const Endpoint& from, const Header& header, TimePoint now) noexcept;
  /// Why no message from `from` may begin now, given the slot it would take; nothing if it may.
  std::optional<TpDrop> refusal(const Endpoint& from, const TpSlot* slot) const noexcept;
  TpSlot* vacant() noexcept;
  void begin(TpSlot& slot, const Endpoint& from, const Header& header, TimePoint now) noexcept;
  Outcome add(TpSlot& slot, const TpView& segment, ReturnCode code, TimePoint now) noexcept;
  std::optional<TpDrop> contradiction(const TpSlot& slot, const TpView& segment) const noexcept;
  /// Copies what falls into gaps. How many bytes did, or nothing when a gap cannot be noted.
  static std::optional<std::uint32_t> fill_gaps(TpSlot& slot, std::uint32_t offset, ByteView slice) noexcept;
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
