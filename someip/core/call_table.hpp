#pragma once
#include <array>
#include <optional>

#include "someip/core/session_counter.hpp"
#include "someip/wire/endpoint.hpp"
#include "someip/wire/header.hpp"

namespace trestle::someip {

/// Names a call. Stays safe to use after the call's end: it is then unknown.
struct CallHandle {
  std::uint16_t index = 0;       ///< below CallTable::capacity(), and no other outstanding call's
  std::uint16_t generation = 0;  ///< 0: names nothing
  friend constexpr bool operator==(const CallHandle&, const CallHandle&) = default;
};

/// Where a call goes, and where its answer has to come from.  [feat_req_someip_49]
struct CallTarget {
  Endpoint server;
  Transport transport = Transport::udp;
  friend constexpr bool operator==(const CallTarget&, const CallTarget&) = default;
};

/// Why a received message ends no call.
enum class AnswerDrop : std::uint8_t {
  not_an_answer,   ///< another message type
  wrong_version,   ///< protocol or interface version is not that of the call
  unknown,         ///< no call is, or lately was, answered by it
  late,            ///< its call has timed out or was lost
  after_cancel,    ///< its call was cancelled
  duplicate,       ///< its call has been answered
  foreign_sender,  ///< not from where its call went to
};
inline constexpr std::size_t answer_drop_count = 7;

/// The reason's name as it stands above, for logs and reports.
[[nodiscard]] const char* to_string(AnswerDrop reason) noexcept;

/// How calls ended, and what was received besides.
struct CallCounters {
  std::uint64_t started = 0;
  std::uint64_t answered = 0;   ///< with success or an error
  std::uint64_t errors = 0;     ///< those of them that were answered with an error
  std::uint64_t timed_out = 0;  ///< also those whose connection was lost  [feat_req_someip_326]
  std::uint64_t cancelled = 0;
  std::uint64_t refused = 0;  ///< calls that were not even started: the table was full
  std::array<std::uint64_t, answer_drop_count> drops{};
  [[nodiscard]] constexpr std::uint64_t operator[](AnswerDrop reason) const noexcept {
    return drops[static_cast<std::size_t>(reason)];
  }
  friend constexpr bool operator==(const CallCounters&, const CallCounters&) = default;
};

/// Room for one call. Afterwards it remembers the call until another one takes its place, so that answers
/// that come too late or twice are told from those that nobody asked for.
class CallSlot {
 private:
  friend class CallTable;
  enum class State : std::uint8_t { unused, outstanding, answered, timed_out, cancelled };

  CallTarget target_;
  Header header_;
  TimePoint deadline_{};
  std::uint64_t number_ = 0;  ///< of the call, counted from 1
  std::uint16_t generation_ = 0;
  State state_ = State::unused;
};

/// A call that was started: send `header` with the payload to the target.  [feat_req_someip_329]
struct StartedCall {
  CallHandle call;
  Header header;
};

/// The end of a call by an answer.
struct CallAnswer {
  CallHandle call;
  ReturnCode code{};  ///< ok, or the error: never ok for message type ERROR
};

/// The outstanding calls of one client, sans I/O.
///
/// Gives each call a Session ID that none of the client's outstanding calls has [feat_req_someip_79]
/// [feat_req_someip_669], finds the call that an answer belongs to, and ends calls whose time is over. Each
/// call ends exactly once: with an answer, by its deadline, by connection_lost() or by cancel().
///
/// All is done in constant time, but for deadlines, whose passing looks at every slot.
class CallTable {
 public:
  /// @param slots   as many calls can be outstanding at once; at least 1, at most 0x8000. Outlives the table.
  /// @param client  the Client ID of all calls.  [feat_req_someip_699] [feat_req_someip_701]
  /// @param first   the first Session ID.  [feat_req_someip_649]
  CallTable(std::span<CallSlot> slots, ClientId client, SessionId first = SessionId{1}) noexcept;

  /// Starts a call.
  /// @param timeout  how long to wait for the answer.  [feat_req_someip_436]
  /// @return nothing when the table is full.
  [[nodiscard]] std::optional<StartedCall> start(const CallTarget& target, ServiceId service, MethodId method,
                                                 std::uint8_t interface_version, Duration timeout,
                                                 TimePoint now) noexcept;

  /// Whether this is a RESPONSE or ERROR, or a segment of one, that would end a call.
  [[nodiscard]] bool awaits(const CallTarget& from, const Header& header) const noexcept;

  /// Takes the header of a whole RESPONSE or ERROR; both may carry an error.  [feat_req_someip_107]
  /// @return the call that it ends, or why it is dropped.
  [[nodiscard]] Result<CallAnswer, AnswerDrop> on_answer(const CallTarget& from,
                                                         const Header& header) noexcept;

  /// The call's end is not awaited any more.
  /// @return false for a call that has ended.
  bool cancel(CallHandle call) noexcept;

  /// Calls `timed_out(CallHandle)` for each call whose deadline has passed; it may start and cancel calls.
  template <typename TimedOut>
  void on_time(TimePoint now, TimedOut timed_out) {
    if (outstanding_ == 0 || now < earliest_) {
      return;
    }
    earliest_ = TimePoint::max();
    end_each([now](const CallSlot& slot) { return slot.deadline_ <= now; }, timed_out);
  }

  /// The connection to this server is lost, so that no answer can come any more: ends its calls as if their
  /// time were over.  [feat_req_someip_326] `timed_out` as in on_time().
  template <typename TimedOut>
  void connection_lost(const CallTarget& target, TimedOut timed_out) {
    earliest_ = TimePoint::max();
    // Not a call that `timed_out` starts: that one finds a new connection.
    end_each([&target, last = counters_.started](
                 const CallSlot& slot) { return slot.target_ == target && slot.number_ <= last; },
             timed_out);
  }

  /// When on_time() has something to do, or earlier; nothing while no call is outstanding.
  [[nodiscard]] std::optional<TimePoint> deadline() const noexcept;

  [[nodiscard]] std::size_t size() const noexcept { return outstanding_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return slots_.size(); }
  [[nodiscard]] const CallCounters& counters() const noexcept { return counters_; }

 private:
  /// Whether an answer with this header is to the slot's call, whoever sent it.
  [[nodiscard]] static bool is_of(const CallSlot& slot, const Header& header) noexcept;
  [[nodiscard]] CallSlot& slot_of(SessionId session) const noexcept {
    return slots_[value(session) % slots_.size()];
  }
  [[nodiscard]] CallHandle handle_of(const CallSlot& slot) const noexcept;
  void end(CallSlot& slot, CallSlot::State how) noexcept;

  template <typename Ends, typename TimedOut>
  void end_each(Ends ends, TimedOut& timed_out) {
    for (CallSlot& slot : slots_) {
      if (slot.state_ != CallSlot::State::outstanding) {
        continue;
      }
      if (ends(slot)) {
        end(slot, CallSlot::State::timed_out);
        ++counters_.timed_out;
        timed_out(handle_of(slot));
      } else {
        earliest_ = slot.deadline_ < earliest_ ? slot.deadline_ : earliest_;
      }
    }
  }

  /// The call with Session ID s has the slot s modulo their number: an answer finds it without a search, a
  /// session whose slot is taken is skipped, and what a slot remembers is the oldest when it is overwritten.
  std::span<CallSlot> slots_;
  ClientId client_;
  SessionCounter sessions_;
  std::size_t outstanding_ = 0;
  TimePoint earliest_ = TimePoint::max();  ///< no deadline is before this
  CallCounters counters_;
};

}  // namespace trestle::someip
