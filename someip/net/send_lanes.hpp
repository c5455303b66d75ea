#pragma once
#include <list>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "someip/core/tp_pacing.hpp"
#include "someip/core/tp_segmenter.hpp"
#include "someip/net/copy_pool.hpp"
#include "someip/net/wait_rule.hpp"
#include "someip/wire/bytes.hpp"
#include "someip/wire/endpoint.hpp"
#include "someip/wire/header.hpp"

namespace trestle::someip {

/// Where in a list of slices the next byte is.
struct SliceCursor {
  std::size_t slice = 0;
  std::size_t offset = 0;
};

/// Takes the next `bytes` bytes as views. There are that many.
void take(const std::vector<ByteView>& slices, SliceCursor& cursor, std::size_t bytes,
          std::vector<ByteView>& to);

/// A message, or a datagram with several, that waits to be sent.
struct PendingMessage {
  Header header;
  std::vector<ByteView> slices{};
  std::vector<std::byte> copy{};  ///< has room for what they point to, unless somebody else keeps it
  std::size_t bytes = 0;
  std::shared_ptr<const void> keep_alive{};
  TpPacing pacing{};
  TpSegmenter segments{{}, 0, tp_default_segment_bytes};
  SliceCursor cursor{};
  std::size_t messages = 1;
  bool datagram = false;  ///< the slices are a datagram with so many messages, headers and all
  bool begun = false;     ///< a part of it has left
  bool lent = false;      ///< the slices belong to the caller, which waits

  /// Whether it may give way to others.
  [[nodiscard]] bool may_go() const noexcept { return !begun && !lent; }
  [[nodiscard]] bool plain() const noexcept { return datagram || bytes <= max_plain_payload_bytes; }
};

/// A host that may not be there.
struct AwaitedHost {
  TimePoint since{};
  TimePoint next_look{};
  Duration pause{};
  bool probe = false;                 ///< one datagram leaves all the same, so that the system asks
  bool asked = false;                 ///< the system has asked
  std::optional<TimePoint> probed{};  ///< when that datagram left
};

/// What waits for all receivers of one address together: who has many of them gets no more for that.
struct AddressShare {
  IpAddress address{};
  std::size_t lanes = 0;  ///< of receivers with this address; 0: free for another one
  std::size_t bytes = 0;  ///< that wait in them, with the places of their messages
  bool served = false;    ///< it has had its turn; MessageSender uses this
};

/// What waits for one receiver, and what has left for it lately.
struct SendLane {
  Endpoint to;
  AddressShare* share = nullptr;  ///< that of its address
  std::list<PendingMessage> queue{};
  PaceWindow pace{};
  std::size_t bytes = 0;              ///< that wait, with the places of their messages
  std::optional<AwaitedHost> host{};  ///< nobody has answered to its address yet: nothing leaves
};

/// What waits to be sent, in a lane for each receiver. What may wait is shared by address, and then by
/// receiver. Keeps its memory for what comes later.
class SendLanes {
 public:
  /// @param max_bytes  of payload that may wait, and of the places that messages take while they do. Of the
  ///                   memory for copies as much is kept when nothing waits.
  explicit SendLanes(std::size_t max_bytes) noexcept : max_bytes_{max_bytes}, copies_{max_bytes} {}
  /// @param io  has the timer by which unused memory for copies goes back.
  SendLanes(std::size_t max_bytes, boost::asio::io_context& io)
      : max_bytes_{max_bytes}, copies_{max_bytes, io} {}

  /// In turn: each lane is served before one is served again.
  [[nodiscard]] std::list<SendLane>& all() noexcept { return lanes_; }
  /// Begins a round, in which each address has one turn.
  void begin_round() noexcept;
  /// In how many lanes something waits.
  [[nodiscard]] std::size_t waiting() const noexcept;
  /// Serves this one after the others.
  void put_last(std::list<SendLane>::iterator lane) { lanes_.splice(lanes_.end(), lanes_, lane); }

  [[nodiscard]] bool empty() const noexcept;
  /// Whether something waits that a message with this header must not overtake.
  [[nodiscard]] bool must_wait(const Endpoint& to, const Header& header) const;

  /// A place at the end of the receiver's lane, with `parts` as they lie. Unless they are kept, own() has to
  /// be called while they live, if the message still waits then. When too much waits, messages to the
  /// address with the most give way, as long as more waits for it than for that of this receiver; of its
  /// receivers, the one with the most, the oldest first that have not begun to leave. Among the receivers of
  /// one address it is the same. So a slow receiver leaves room for others, and who subscribes many times has
  /// no more than others. Before all that, what waits for hosts that nobody has answered for gives way to the
  /// others, which do not give way to it. To be followed by let_go().
  /// @return nothing if so much may not wait.
  [[nodiscard]] PendingMessage* add(const Endpoint& to, std::span<const ByteView> parts, std::size_t bytes,
                                    bool keep);
  /// Whether add() would give no place to a message of so many bytes for this receiver now, but may later.
  [[nodiscard]] bool is_full_for(const Endpoint& to, std::size_t bytes);
  /// To be called before add(): makes room as MessageSender::make_room() does. For a host that nobody has
  /// answered for only one large message with each Message ID waits. Call let_go() afterwards, as after
  /// add().
  Room make_room(const Endpoint& to, const Header& newer, const WaitRule& rule);
  /// Ends the messages that gave way. Their owners are let go, and may call us.
  void let_go();
  [[nodiscard]] bool some_gave_way() const noexcept { return !dropped_.empty(); }
  [[nodiscard]] std::uint64_t gave_way() const noexcept { return gave_way_; }
  /// Copies what of the message, which is not kept by anybody else, is left from its cursor on.
  static void own(PendingMessage& message);
  /// The first message of the lane is sent or dropped. Its owner is let go last, and may call us.
  void finish(SendLane& lane);
  /// From now on everything for this receiver waits.
  SendLane& await_host(const Endpoint& to, const AwaitedHost& host);
  /// The lane of this receiver, if everything for it waits; else null.
  [[nodiscard]] SendLane* awaiting(const Endpoint& to) noexcept;
  /// How many receivers everything waits for.
  [[nodiscard]] std::size_t awaited() const noexcept;
  /// The lane of a host that is not there.
  /// @return how many messages waited for it.
  std::size_t give_up(SendLane& lane);
  /// Drops everything.
  /// @return how many messages that were.
  std::size_t clear();

 private:
  [[nodiscard]] SendLane& lane_of(const Endpoint& to);
  [[nodiscard]] AddressShare& share_of(const IpAddress& address);
  /// So many bytes more, or less, wait in the lane.
  void count(SendLane& lane, std::size_t bytes) noexcept;
  void discount(SendLane& lane, std::size_t bytes) noexcept;
  using Queue = std::list<PendingMessage>;
  /// A message in segments with the Message ID of `newer`; end() if there is none.
  [[nodiscard]] static Queue::iterator large_like(Queue& queue, const Header& newer);
  void drop(SendLane& lane, Queue::iterator message);
  [[nodiscard]] bool fits(std::size_t bytes) const noexcept {
    return bytes_ <= max_bytes_ && bytes <= max_bytes_ - bytes_;
  }
  /// The message that gives way to one of so many bytes for this receiver; no lane: none does.
  struct Yielding {
    SendLane* lane = nullptr;
    Queue::iterator message{};
  };
  [[nodiscard]] Yielding who_gives_way(const Endpoint& to, std::size_t bytes);
  /// Whether so many more bytes may wait for this receiver, after others have given way.
  [[nodiscard]] bool make_way(const Endpoint& to, std::size_t bytes);
  void reuse(Queue& from);

  std::size_t max_bytes_;
  std::size_t bytes_ = 0;  // exceeds max_bytes_ by the last message's place at most
  std::list<SendLane> lanes_;
  std::list<AddressShare> shares_;  // no more than lanes
  std::list<PendingMessage> unused_;
  std::list<PendingMessage> dropped_;  // their owners are not let go yet
  std::uint64_t gave_way_ = 0;
  CopyPool copies_;
};

}  // namespace trestle::someip
