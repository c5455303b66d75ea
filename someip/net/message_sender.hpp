#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "someip/core/tp_pacing.hpp"
#include "someip/net/local_room.hpp"
#include "someip/net/neighbours.hpp"
#include "someip/net/send_lanes.hpp"
#include "someip/net/socket_counters.hpp"
#include "someip/net/udp_socket.hpp"
#include "someip/wire/header.hpp"

namespace trestle::someip {

/// Sends messages through a UDP socket: small ones at once, or together, a large one as TP segments, gathered
/// by the kernel from where they lie. Not thread-safe: use it on the thread that runs the io_context.
///
/// A small message on its own leaves before send() returns. The ones that the same handler sends after it
/// leave together, each in a datagram of its own, with one system call: when the handler is done, or there
/// are 64; in a handler of what `socket` has received, when all has been handled that came with it. Where
/// handler follows handler within microseconds and each sends something, their messages leave together, too:
/// as soon as a turn of the event loop brings none, and every 20 us.
///
/// The large messages to one receiver share its bursts, in the order in which they were sent. Messages to
/// another receiver do not wait for its pauses. Where many wait, each address has its turn, and of one
/// address each receiver; the event loop runs in between. Where too much waits, the address with the most
/// loses messages.
class MessageSender {
 public:
  using Counters = SenderCounters;

  /// @param socket  outlives the sender, and has no other one.
  /// @param max_queued_bytes  payload that may wait for its turn; beyond it messages are dropped. Each
  ///                          message that waits counts some hundred bytes more, for its place. Memory for
  ///                          copies of what waits is kept up to as many bytes, for a second or two.
  /// @param collect_for  how long a small message may wait for others to the same receiver, to share one
  ///                     datagram with them; 0: each has one of its own.  [feat_req_someip_741]
  MessageSender(boost::asio::io_context& io, UdpSocket& socket,
                std::size_t max_queued_bytes = std::size_t{64} << 20U, Duration collect_for = Duration{0});
  ~MessageSender();
  MessageSender(const MessageSender&) = delete;
  MessageSender& operator=(const MessageSender&) = delete;

  /// Sends a message or queues it. Messages to one receiver with one Message ID keep their order.
  ///
  /// @param payload     slices that together are the payload.
  /// @param keep_alive  owns what the slices point to; released once the message has been sent or dropped.
  ///                    Without it, the slices need only live during the call: what has to wait is copied.
  /// @return false when the message was dropped; counters() tell why. A message that leaves together with
  ///         later ones is counted when the system refuses it.
  bool send(const Endpoint& to, const Header& header, std::span<const ByteView> payload,
            std::shared_ptr<const void> keep_alive = nullptr, const TpPacing& pacing = {});

  /// Whether a payload of so many bytes for this receiver would be dropped now, because too much waits.
  /// False for what is larger than all that may wait.
  [[nodiscard]] bool is_full_for(const Endpoint& to, std::size_t bytes) const;

  /// From now on a receiver on this host whose pacing has no burst, as it does not tell what it can take,
  /// gets large messages without pauses while its socket has room, as the system tells.
  /// @param room  outlives the sender.
  void ask_for_room(LocalRoom& room);

  /// To be called before send() for a message that a rule is for: drops the oldest one with its Message ID
  /// when too many wait for the receiver, or says that the new one is not to be sent. For a host that nobody
  /// has answered for (Neighbours) it keeps one large message with each Message ID.
  Room make_room(const Endpoint& to, const Header& newer, const WaitRule& rule);

  /// Calls `told` once, for the first message of more bytes than this. Not to destroy the sender.
  void tell_large(std::size_t above, std::function<void()> told);
  /// Calls `told` with the receiver of each message for which there is no room: it is dropped, or others are.
  /// Not to destroy the sender.
  void tell_full(std::function<void(const Endpoint& to)> told);

  /// Of the hosts on the link.
  struct Link {
    /// As Neighbours has it.
    std::function<Neighbours::Answer(const IpAddress& host)> answer_of;
    std::function<Neighbours::Answer(const IpAddress& host)> entry_of{};
    /// Nobody has answered for `patience`.
    std::function<void(const Endpoint& receiver)> unreachable;
  };
  static constexpr Duration patience = std::chrono::milliseconds{3500};  ///< the system itself has 3 s
  /// Within this time the system asks for a new host (ARP, IPv6 neighbour discovery), as an answer to its
  /// subscription is sent there. Otherwise one datagram leaves for it. If the system still does not ask, it
  /// reaches the host in another way.
  static constexpr Duration time_to_ask = std::chrono::milliseconds{200};

  /// From now on hosts are looked at. With `entry_of`, send() looks at a receiver again that was not looked
  /// at for 100 ms, or for 10 ms while much is sent to it. What is for one that has gone waits as after
  /// meet().
  void watch_link(Link link);
  /// This receiver is new. Messages for it are kept here until somebody has answered to its address. In the
  /// send buffer of the system, which all receivers share, they would take the room of the others.
  void meet(const Endpoint& receiver);
  /// This receiver wants nothing any more. If nobody has answered to its address yet, what is kept for it is
  /// dropped: else receivers that come and go would leave more behind than there may be at once.
  void part(const Endpoint& receiver);
  /// This receiver has asked for something, or somebody in its name. If nobody has answered to its address,
  /// one datagram leaves for it, and what follows is kept as after meet(). To be called before each answer;
  /// of a host that has answered, it mostly costs a look into a small table. If more hosts are used than that
  /// has places for (256), the system is asked for some of them each time.
  /// @return false when too many receivers are waited for, or messages wait for this one: drop the answer.
  [[nodiscard]] bool greet(const Endpoint& receiver);
  static constexpr std::size_t max_silent = 32;      ///< receivers that greet() lets wait
  static constexpr std::size_t max_for_silent = 64;  ///< messages that wait for one

  /// Sends the messages that wait to leave together, now.
  void flush();

  /// Sends what was collected and drops what else waits, as destruction does. Nothing is sent afterwards.
  void close();

  /// Whether nothing waits to be sent.
  [[nodiscard]] bool idle() const noexcept;
  [[nodiscard]] Counters counters() const noexcept;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace trestle::someip
