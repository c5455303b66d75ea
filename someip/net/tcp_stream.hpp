#pragma once
#include <functional>
#include <memory>
#include <string>

#include "someip/core/magic_cookie.hpp"
#include "someip/core/stream_parser.hpp"
#include "someip/net/socket_counters.hpp"
#include "someip/net/wait_rule.hpp"
#include "someip/wire/endpoint.hpp"

namespace boost::asio {
class io_context;
}

namespace trestle::someip {

class CopyPool;
class Descriptor;
class ReceiveBudget;
class SendBudget;
class TlsContext;

/// How TCP connections are kept, on either end.
struct TcpOptions {
  /// Payload of a received message. Memory for one is taken as it comes.
  std::size_t max_message_bytes = std::size_t{16} << 20U;
  /// What all connections that have it may take together for messages that come; none: no bound.
  std::shared_ptr<ReceiveBudget> receive_budget = nullptr;
  /// Bytes that may wait to be sent; a message beyond them is dropped. Of the memory for copies of them, a
  /// client or a server keeps as much for the next ones, for a second or two.
  std::size_t max_queued_bytes = std::size_t{64} << 20U;
  /// What may wait to be sent over all connections that have it together: see there; none: no bound.
  std::shared_ptr<SendBudget> send_budget = nullptr;
  /// A server reads no more of a client while so many bytes of answers wait that this client does not read.
  std::size_t max_unread_answer_bytes = std::size_t{1} << 20U;
  /// A peer that acknowledges nothing for so long, data or the probes of an idle connection, is given up.
  Duration dead_after = std::chrono::seconds{10};
  /// A connection on which a message is under way for longer is closed: half a message must not hold its
  /// place for ever. 0: never.
  Duration message_timeout = std::chrono::seconds{30};
  /// For test setups: sends Magic Cookies, and waits for one when framing is lost. A peer that sends them is
  /// waited for in any case, any other is disconnected.  [feat_req_someip_586]
  bool magic_cookies = false;
  /// Where the Magic Cookies stand that are sent: one at the start of each TCP segment, and nowhere else;
  /// only the further segments of a message that is larger than one segment cannot have any. Or, with false,
  /// before a message every ten seconds.  [feat_req_someip_591] [feat_req_someip_592] [feat_req_someip_593]
  bool cookie_in_each_segment = true;
  int receive_buffer_bytes = 0;  ///< of the kernel; 0: it adapts them itself
  int send_buffer_bytes = 0;     ///< likewise
  std::uint8_t dscp = 0;         ///< class of service of what is sent, 0 to 63
  std::uint8_t unicast_ttl = 0;  ///< hops that packets may take; 0: as the system has it
  /// The connection is encrypted, and the peer has to prove who it is, before anything else; none: plain TCP.
  std::shared_ptr<const TlsContext> tls = nullptr;
  /// Told of each message that is dropped for max_queued_bytes. Not to end the connection.
  std::function<void()> queue_is_full = nullptr;
};

/// Why a connection is over that held too much for too long, or for which the system has no memory.
inline constexpr const char* no_memory_for_a_message =
    "there is no memory for a message that comes (max_tcp_receive_bytes)";

/// The kernel's buffers of a connection.
struct TcpBuffers {
  int receive_bytes = 0;
  int send_bytes = 0;
};
/// What the system grants a connection with these options, which may be less than they ask for (sysctl
/// net.core.rmem_max, wmem_max). Found out with a socket of its own, before there is any connection.
/// @throws NetError
[[nodiscard]] TcpBuffers granted_buffers(const TcpOptions& options);

/// An open TCP connection that carries messages, driven by an io_context. Not thread-safe: use it on the
/// thread that runs the io_context.
class TcpStream {
 public:
  /// Gets each message, valid during the call. May destroy the stream.
  using MessageHandler = std::function<void(const Message& message)>;
  /// Told once, in words, why the connection is over; not at destruction. May destroy the stream.
  using CloseHandler = std::function<void(const std::string& why)>;

  using Counters = TcpStreamCounters;

  /// @param connected  a connected socket.
  /// @param own        which end of the connection we are.
  /// @param copies     memory for what has to wait to be sent; other streams may have the same.
  /// @throws std::bad_alloc
  TcpStream(boost::asio::io_context& io, Descriptor connected, StreamEnd own, const TcpOptions& options,
            std::shared_ptr<CopyPool> copies);
  /// Closes the connection; what waits to be sent is lost.
  ~TcpStream();
  TcpStream(const TcpStream&) = delete;
  TcpStream& operator=(const TcpStream&) = delete;

  /// Starts to receive. Call once. With TLS the handshake comes first; what is sent meanwhile waits.
  /// @param on_secured  told when the handshake is done; without TLS not at all. May destroy the stream.
  void receive(MessageHandler on_message, CloseHandler on_closed, std::function<void()> on_secured = {});
  /// Whether messages can go: there is no TLS, or its handshake is done.
  [[nodiscard]] bool is_secured() const noexcept;

  /// Sends a message or queues it, as MessageSender::send(). Messages keep their order.
  /// @return false when the message was dropped: the queue is full, or the connection is over.
  bool send(const Header& header, std::span<const ByteView> payload,
            std::shared_ptr<const void> keep_alive = nullptr);

  /// As MessageSender::is_full_for().
  [[nodiscard]] bool is_full_for(std::size_t bytes) const noexcept;

  /// As MessageSender::make_room().
  Room make_room(const Header& newer, const WaitRule& rule);

  /// Finds out whether the peer still knows the connection, by a Magic Cookie: if it does not, the connection
  /// is over soon. Counts as a message that was sent.
  void probe();

  [[nodiscard]] const Endpoint& local() const noexcept;
  /// Whether nothing waits to be sent.
  [[nodiscard]] bool idle() const noexcept;
  /// What waits for the peer: here, in the system, or on its way.
  struct Unread {
    bool some = false;
    std::uint64_t taken = 0;  ///< bytes that the peer's system has acknowledged since the connection stands
  };
  [[nodiscard]] Unread unread() const noexcept;
  /// What waits is not to be sent any more when the connection is closed: else the system would hold it for a
  /// peer that does not read it.
  void drop_unread() noexcept;
  [[nodiscard]] Counters counters() const noexcept;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace trestle::someip
