#pragma once
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

/// Who else on this host may have the port.
enum class PortSharing : std::uint8_t {
  exclusive,  ///< nobody, on this address or on all
  /// Nobody on this very address; but some socket may have it on all addresses, if that one agrees to share
  /// too: so do the SD sockets of other stacks.
  by_address,
  shared,  ///< anybody: for multicast groups, which every member receives
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
  PortSharing sharing = PortSharing::exclusive;
  int multicast_ttl = 1;  ///< hops that multicast may take
  std::uint8_t dscp = 0;  ///< class of service of what is sent, 0 to 63
  int receive_buffer_bytes = 8 << 20;
  int send_buffer_bytes = 4 << 20;
};

enum class SendStatus : std::uint8_t {
  sent,
  would_block,  ///< the send buffer is full: nothing was sent, ask wait_writable()
  failed,       ///< the system refused the datagram (no route, too large, ...), errno says why: it is lost
};

/// A UDP socket driven by an io_context. Not thread-safe: use it on the thread that runs the io_context.
class UdpSocket {
 public:
  /// Gets each datagram, valid during the call, and who sent it.
  using Handler = std::function<void(ByteView datagram, const Endpoint& from)>;
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

  /// Sends one datagram, gathered from `slices` (at most 64).
  SendStatus send(const Endpoint& to, std::span<const ByteView> slices);

  /// Sends several datagrams to one receiver with as few system calls as the system allows (UDP segmentation
  /// offload, else sendmmsg). Datagram i is gathered from the next `slice_counts[i]` slices. All but the last
  /// datagram are `datagram_bytes` long and the last one not longer; at most 64 datagrams, 64 KB together.
  Batch send_segments(const Endpoint& to, std::span<const ByteView> slices,
                      std::span<const std::uint8_t> slice_counts, std::size_t datagram_bytes);

  /// Calls `ready` once, later, when there is room to send again.
  void wait_writable(std::function<void()> ready);

  /// Where it is bound, with the port that the system chose.
  [[nodiscard]] Endpoint local() const;
  /// Datagrams that arrived while the receive buffer was full and are lost, as the system told with the last
  /// one received.
  [[nodiscard]] std::uint64_t receive_overflows() const;
  /// What the system granted, which may be less than asked for (sysctl net.core.rmem_max).
  [[nodiscard]] int receive_buffer_bytes() const;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace trestle::someip
