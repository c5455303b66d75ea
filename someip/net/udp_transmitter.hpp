#pragma once
#include <sys/socket.h>

#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include "someip/net/addresses.hpp"
#include "someip/net/udp_socket.hpp"

namespace trestle::someip {

/// Sends datagrams through a socket with as few system calls as the system allows, which is found out by
/// trying: UDP segmentation offload, sendmmsg, sendmsg.
///
/// Whether there is offload depends on the way to the receiver: not all devices and tunnels can do it. A
/// receiver that it fails for gets datagram by datagram; after `offload_pause` trains it is tried again.
class UdpTransmitter {
 public:
  using Batch = UdpSocket::Batch;
  static constexpr std::size_t max_datagrams = 64;  ///< at a time; the kernel's UDP_MAX_SEGMENTS
  static constexpr std::size_t max_slices = 3 * max_datagrams;
  static constexpr std::size_t max_refusals = 16;  ///< receivers without offload that are kept in mind
  static constexpr unsigned offload_pause = 1000;
  static constexpr int max_told_errors = 4;  ///< in a row; more are taken for ours

  /// @param scope  of link-local IPv6 receivers, else 0.
  UdpTransmitter(int fd, unsigned scope);

  /// From now on send() gives the datagrams this address as their source.
  void send_from(const IpAddress& source) noexcept;

  /// The socket tells errors of earlier datagrams, keep_udp_errors(): what it does not send is tried again.
  void expect_told_errors() noexcept { told_errors_ = true; }
  /// Whether an error may have been told since the last call.
  [[nodiscard]] bool take_told_error() noexcept { return std::exchange(told_error_, false); }
  /// Whether the last that would block found the queue of the network interface full, not the send buffer: no
  /// event tells when it has room.
  [[nodiscard]] bool interface_full() const noexcept { return interface_full_; }

  // As those of UdpSocket.
  SendStatus send(const Endpoint& to, std::span<const ByteView> slices);
  Batch send_segments(const Endpoint& to, std::span<const ByteView> slices,
                      std::span<const std::uint8_t> slice_counts, std::size_t datagram_bytes);
  Batch send_trains(std::span<const Train> trains);

  [[nodiscard]] const UdpSendCounters& counters() const noexcept { return counters_; }

 private:
  struct Refusal {
    IpAddress receiver;
    unsigned trains_left = 0;
  };

  [[nodiscard]] bool offload_for(const IpAddress& receiver);
  void note_refusal(const IpAddress& receiver);
  [[nodiscard]] int transmit(mmsghdr* messages, std::size_t count);
  [[nodiscard]] int try_transmit(mmsghdr* messages, std::size_t count);
  [[nodiscard]] Batch transmit_all(std::size_t count);
  mmsghdr& message(std::size_t index, SocketAddress& to, iovec* parts, std::size_t part_count);

  int fd_;
  unsigned scope_;
  bool has_sendmmsg_ = true;
  bool told_errors_ = false;
  bool told_error_ = false;
  bool interface_full_ = false;
  /// The control message that sets the source address (IP_PKTINFO); empty: the socket's own address.
  alignas(std::max_align_t) std::array<std::byte, 64> source_{};
  std::size_t source_bytes_ = 0;
  std::vector<Refusal> refusals_;
  std::size_t next_refusal_ = 0;  ///< to be forgotten, when there are max_refusals
  UdpSendCounters counters_;
  // Of one batch; kept to reuse their memory.
  std::vector<mmsghdr> messages_;
  std::vector<iovec> parts_;
  std::vector<SocketAddress> addresses_;
};

}  // namespace trestle::someip
