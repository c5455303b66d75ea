// someip/net: sockets under Boost.Asio. One thread, that of the io_context.
//
//   udp_socket.hpp      datagrams in and out, several with one system call; udp_transmitter.hpp sends them
//   message_sender.hpp  messages over UDP: small ones together, large ones in segments (send_lanes.hpp)
//   reassembly.hpp      a TpReassembler with memory from the system, within a budget
//   tcp_server.hpp, tcp_client.hpp  messages over TCP; tcp_stream.hpp is what both share
//   parameters.hpp      C++ values as payloads: pack(), unpack()
//   address_text.hpp, addresses.hpp, neighbours.hpp  addresses as text, of interfaces, of the link
//   local_room.hpp      how full the sockets of this host are
//
// No decision about the protocol is made here; an `if` about a protocol field belongs into someip/core.
#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "someip/net/net_error.hpp"
#include "someip/wire/endpoint.hpp"
#include "someip/wire/types.hpp"

namespace boost::asio {
class io_context;
}

namespace trestle::someip {

/// Which other sockets of this host may have the port.
enum class PortSharing : std::uint8_t {
  exclusive,  ///< nobody, on this address or on all
  /// Nobody on this very address; but some socket may have it on all addresses, if that one agrees to share
  /// too: so do the SD sockets of other stacks.
  by_address,
  shared,  ///< every socket that also shares it: for multicast groups, where each member receives
};

/// The network interface for multicast, both ways.
struct MulticastInterface {
  IpAddress own;       ///< an own address: the interface that has it, unless `name` says otherwise
  std::string name{};  ///< such as "eth0"
};

struct UdpOptions {
  Endpoint local = {};  ///< port 0: any dynamic port that is free
  /// Group to receive from, on `interface`; `local` is then the group itself.
  std::optional<IpAddress> join = std::nullopt;
  std::optional<MulticastInterface> interface = std::nullopt;
  /// Where `local` is a group: the own address that what is sent comes from. Only send() has it.
  std::optional<IpAddress> source = std::nullopt;
  PortSharing sharing = PortSharing::exclusive;
  int multicast_ttl = 1;         ///< hops that multicast may take
  std::uint8_t unicast_ttl = 0;  ///< hops that unicast may take; 0: as the system has it
  std::uint8_t dscp = 0;         ///< class of service of what is sent, 0 to 63
  int receive_buffer_bytes = 8 << 20;
  int send_buffer_bytes = 4 << 20;
  std::chrono::microseconds busy_poll{0};  ///< SO_BUSY_POLL, as far as it is granted
  /// Batches, of at most 16 datagrams each, that are received in a row before others get their turn.
  int batches_in_a_row = 16;
};

enum class SendStatus : std::uint8_t {
  sent,
  would_block,  ///< the send buffer is full: nothing was sent, ask wait_writable()
  failed,       ///< the system refused the datagram (no route, too large, ...), errno says why: it is lost
};

/// Datagrams from, or to, one peer in a row: all `datagram_bytes` long, but the last, which may be shorter.
struct Train {
  Endpoint peer{};
  ByteView bytes{};  ///< of all datagrams; none: one datagram that is empty
  std::size_t datagram_bytes = 0;

  /// How many datagrams it has.
  [[nodiscard]] std::size_t size() const noexcept {
    return bytes.size() <= datagram_bytes ? 1 : (bytes.size() + datagram_bytes - 1) / datagram_bytes;
  }
  [[nodiscard]] ByteView operator[](std::size_t index) const noexcept {
    const ByteView rest = bytes.subspan(index * datagram_bytes);
    return rest.first(rest.size() < datagram_bytes ? rest.size() : datagram_bytes);
  }
};

/// What a UDP socket needed to send.
struct UdpSendCounters {
  std::uint64_t calls = 0;            ///< system calls
  std::uint64_t offload_refused = 0;  ///< trains that had to be sent singly, as the way there has no offload
};

/// A UDP socket driven by an io_context. Not thread-safe: use it on the thread that runs the io_context.
class UdpSocket {
 public:
  /// Gets each datagram, valid during the call, and who sent it.
  using Handler = std::function<void(ByteView datagram, const Endpoint& from)>;
  /// Gets the datagrams that came together from one sender, valid during the call.
  using TrainHandler = std::function<void(const Train& train)>;
  /// What send_segments() did: how many datagrams were sent, and why it stopped if that is not all.
  struct Batch {
    std::size_t sent = 0;
    SendStatus status = SendStatus::sent;
  };

  /// @throws NetError when the socket cannot be opened, e.g. because the port is taken.
  UdpSocket(boost::asio::io_context& io, const UdpOptions& options);
  ~UdpSocket();
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;

  /// Starts to receive. Call once. The handler may destroy the socket.
  void receive(Handler handler);
  /// The same; the datagrams that the system has joined come together.
  void receive_trains(TrainHandler handler);

  /// From now on tells which receivers cannot be reached, by ICMP errors (nobody has the port, the host is
  /// down, no way to it). Only for a socket that receives. The handler may destroy the socket. What others
  /// than the receiver or this host say is only counted, see next_udp_error().
  void report_unreachable(std::function<void(const Endpoint& receiver)> handler);

  /// Whether a handler of receive() is being called. After it, and those for what else was received with the
  /// same system call, `done` of after_receiving() will be called.
  [[nodiscard]] bool receiving() const noexcept;
  void after_receiving(std::function<void()> done);

  /// Sends one datagram, gathered from `slices` (at most 64).
  SendStatus send(const Endpoint& to, std::span<const ByteView> slices);

  /// Whether multicast that is sent from now on also reaches this host's members of the group; it does at
  /// first. A loopback interface brings it back all the same. Leaves errno.
  void loop_multicast(bool on);

  /// Sends several datagrams to one receiver with as few system calls as the system allows (UDP segmentation
  /// offload, else sendmmsg). Datagram i is gathered from the next `slice_counts[i]` slices. All but the last
  /// datagram are `datagram_bytes` long and the last one not longer; at most 64 datagrams, 64 KB together.
  Batch send_segments(const Endpoint& to, std::span<const ByteView> slices,
                      std::span<const std::uint8_t> slice_counts, std::size_t datagram_bytes);

  /// Sends datagrams to one receiver or several, likewise: at most 64 in all, 64 KB of each train.
  Batch send_trains(std::span<const Train> trains);

  /// Calls `ready` once, later, when there is room to send again; replaces the one before. Empty: nobody.
  void wait_writable(std::function<void()> ready);

  /// When the interface for multicast may have been removed and made anew: joins and sends there.
  /// @throws NetError when it cannot; nothing else has changed then, and it can be tried again.
  void follow_interface();

  /// Where it is bound, with the port that the system chose.
  [[nodiscard]] Endpoint local() const;
  /// Datagrams lost as the receive buffer was full, as the system told with the last one received.
  [[nodiscard]] std::uint64_t receive_overflows() const;
  /// ICMP errors that neither the receiver nor this host sent: report_unreachable() does not tell.
  [[nodiscard]] std::uint64_t unreachable_ignored() const noexcept;
  /// What the system granted, which may be less than asked for (sysctl net.core.rmem_max).
  [[nodiscard]] int receive_buffer_bytes() const;
  [[nodiscard]] int send_buffer_bytes() const;                ///< likewise (net.core.wmem_max)
  [[nodiscard]] std::chrono::microseconds busy_poll() const;  ///< that the system granted
  [[nodiscard]] const UdpSendCounters& send_counters() const noexcept;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace trestle::someip
