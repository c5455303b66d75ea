#include "someip/net/udp_socket.hpp"

#include <net/if.h>
#include <netinet/udp.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cassert>
#include <cerrno>
#include <cstring>
#include <utility>

#include "someip/net/address_text.hpp"
#include "someip/net/addresses.hpp"
#include "someip/net/socket_calls.hpp"

namespace trestle::someip {
namespace {

constexpr std::size_t max_datagrams = 64;  // of one send_segments(); the kernel's UDP_MAX_SEGMENTS
constexpr std::size_t max_slices = 3 * max_datagrams;
constexpr std::size_t receive_batch = 16;    // datagrams, or trains of datagrams with GRO, a system call
constexpr std::size_t receive_room = 65536;  // bytes of each
constexpr int receive_rounds = 16;           // batches before other handlers get their turn

[[noreturn]] void fail(const Endpoint& endpoint, const char* what, int error) {
  someip::fail(Transport::udp, endpoint, what, error);
}

// 0 when no interface is asked for.
unsigned interface_index(const UdpOptions& options) {
  if (!options.interface) {
    return 0;
  }
  const MulticastInterface& wanted = *options.interface;
  if (!wanted.name.empty()) {
    const unsigned index = if_nametoindex(wanted.name.c_str());
    if (index == 0) {
      throw NetError{"there is no network interface '" + wanted.name + "' (see: ip link)"};
    }
    return index;
  }
  const unsigned index = interface_of(wanted.own);
  if (index == 0) {
    fail({wanted.own, options.local.port}, "find the network interface", EADDRNOTAVAIL);
  }
  return index;
}

void join_group(int fd, const UdpOptions& options, unsigned interface) {
  const IpAddress& group = *options.join;
  int result = 0;
  if (group.v6) {
    ipv6_mreq request{};
    std::memcpy(&request.ipv6mr_multiaddr, group.bytes.data(), sizeof request.ipv6mr_multiaddr);
    request.ipv6mr_interface = interface;
    result = setsockopt(fd, IPPROTO_IPV6, IPV6_JOIN_GROUP, &request, sizeof request);
  } else {
    ip_mreqn request{};
    std::memcpy(&request.imr_multiaddr, group.bytes.data(), sizeof request.imr_multiaddr);
    request.imr_ifindex = static_cast<int>(interface);
    result = setsockopt(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &request, sizeof request);
    // Only groups that this very socket joined, not those of other programs of the host.
    set_option(fd, IPPROTO_IP, IP_MULTICAST_ALL, 0);
  }
  if (result != 0) {
    fail({group, options.local.port}, "join the multicast group", errno);
  }
}

void send_multicast_from(int fd, const UdpOptions& options, unsigned interface) {
  int result = 0;
  if (options.interface->own.v6) {
    result = set_option(fd, IPPROTO_IPV6, IPV6_MULTICAST_IF, static_cast<int>(interface)) |
             set_option(fd, IPPROTO_IPV6, IPV6_MULTICAST_HOPS, options.multicast_ttl);
  } else {
    ip_mreqn request{};
    std::memcpy(&request.imr_address, options.interface->own.bytes.data(), sizeof request.imr_address);
    request.imr_ifindex = static_cast<int>(interface);
    result = setsockopt(fd, IPPROTO_IP, IP_MULTICAST_IF, &request, sizeof request) |
             set_option(fd, IPPROTO_IP, IP_MULTICAST_TTL, options.multicast_ttl);
  }
  if (result != 0) {
    fail(options.local, "choose the interface for multicast", errno);
  }
}

int open_socket(const UdpOptions& options) {
  const bool v6 = options.local.address.v6;
  const int fd = ::socket(v6 ? AF_INET6 : AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  Descriptor socket{fd};
  if (fd < 0) {
    fail(options.local, "open a socket", errno);
  }
  const unsigned interface = interface_index(options);
  if (v6) {
    set_option(fd, IPPROTO_IPV6, IPV6_V6ONLY, 1);
  }
  if (options.sharing != PortSharing::exclusive) {
    // With this the kernel would give us an address that another socket has, and that one's datagrams.
    if (options.sharing == PortSharing::by_address && udp_endpoint_in_use(options.local)) {
      fail(options.local, "bind", EADDRINUSE);
    }
    set_option(fd, SOL_SOCKET, SO_REUSEADDR, 1);
  }
  set_buffer(fd, SO_RCVBUFFORCE, SO_RCVBUF, options.receive_buffer_bytes);
  set_buffer(fd, SO_SNDBUFFORCE, SO_SNDBUF, options.send_buffer_bytes);
  set_option(fd, SOL_SOCKET, SO_RXQ_OVFL, 1);
  set_option(fd, SOL_UDP, UDP_GRO, 1);  // an older kernel delivers datagram by datagram
  set_dscp(fd, options.dscp);
  if (const int error = bind_to(fd, options.local, v6 ? interface : 0); error != 0) {
    fail(options.local, "bind", error);
  }
  if (options.join) {
    join_group(fd, options, interface);
  }
  if (options.interface) {
    send_multicast_from(fd, options, interface);
  }
  return socket.release();
}

// What the kernel tells beside a datagram.
struct Ancillary {
  /// The size of the datagrams in a train that it joined (UDP_GRO); 0 when it is a single one.
  std::size_t segment_bytes = 0;
  /// Datagrams lost so far because the receive buffer was full (SO_RXQ_OVFL); it counts with 32 bits.
  std::optional<std::uint32_t> overflows = std::nullopt;
};
constexpr std::size_t ancillary_room = CMSG_SPACE(sizeof(int)) + CMSG_SPACE(sizeof(std::uint32_t));

Ancillary ancillary_of(msghdr& message) noexcept {
  Ancillary result;
  for (cmsghdr* control = CMSG_FIRSTHDR(&message); control != nullptr;
       control = CMSG_NXTHDR(&message, control)) {
    if (control->cmsg_level == SOL_UDP && control->cmsg_type == UDP_GRO) {
      int bytes = 0;
      std::memcpy(&bytes, CMSG_DATA(control), sizeof bytes);
      result.segment_bytes = static_cast<std::size_t>(bytes);
    } else if (control->cmsg_level == SOL_SOCKET && control->cmsg_type == SO_RXQ_OVFL) {
      std::uint32_t lost = 0;
      std::memcpy(&lost, CMSG_DATA(control), sizeof lost);
      result.overflows = lost;
    }
  }
  return result;
}

}  // namespace

struct UdpSocket::State : std::enable_shared_from_this<State> {
  State(boost::asio::io_context& io, const UdpOptions& options)
      : descriptor{io, open_socket(options)}, fd{descriptor.native_handle()}, v6{options.local.address.v6} {
    SocketAddress own;
    getsockname(fd, own.data(), &own.size());
    local = own.endpoint();
    scope = v6 ? interface_index(options) : 0;
  }

  void wait_readable() {
    descriptor.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                          [self = shared_from_this()](const boost::system::error_code& error) {
                            if (!error && !self->closed) {
                              self->drain();
                            }
                          });
  }

  void drain() {
    for (int round = 0; round < receive_rounds; ++round) {
      if (!receive_once()) {
        break;
      }
    }
    if (!closed) {
      wait_readable();
    }
  }

  // Receives one batch; false when there was less than a batch, so that nothing more waits.
  bool receive_once() {
    std::array<mmsghdr, receive_batch> messages{};
    std::array<iovec, receive_batch> places{};
    std::array<SocketAddress, receive_batch> senders;
    std::array<std::array<std::byte, ancillary_room>, receive_batch> controls;
    for (std::size_t i = 0; i < receive_batch; ++i) {
      places[i] = {room.get() + i * receive_room, receive_room};
      msghdr& header = messages[i].msg_hdr;
      header.msg_name = senders[i].data();
      header.msg_namelen = sizeof(sockaddr_storage);
      header.msg_iov = &places[i];
      header.msg_iovlen = 1;
      header.msg_control = controls[i].data();
      header.msg_controllen = controls[i].size();
    }
    const int received = recvmmsg(fd, messages.data(), receive_batch, 0, nullptr);
    for (std::size_t i = 0; received > 0 && i < static_cast<std::size_t>(received); ++i) {
      const ByteView train{room.get() + i * receive_room, messages[i].msg_len};
      const Ancillary ancillary = ancillary_of(messages[i].msg_hdr);
      const std::size_t step =
          ancillary.segment_bytes == 0 ? std::max<std::size_t>(train.size(), 1) : ancillary.segment_bytes;
      if (ancillary.overflows) {
        overflows += *ancillary.overflows - static_cast<std::uint32_t>(overflows);
      }
      const Endpoint from = senders[i].endpoint();
      std::size_t at = 0;
      do {  // an empty datagram is one too
        handler(train.subspan(at, std::min(step, train.size() - at)), from);
        if (closed) {
          return false;
        }
        at += step;
      } while (at < train.size());
    }
    return received == static_cast<int>(receive_batch);
  }

  Batch send_train(const Endpoint& to, std::span<const ByteView> slices, std::size_t datagrams,
                   std::size_t datagram_bytes) {
    std::array<iovec, max_slices> parts;
    std::transform(slices.begin(), slices.end(), parts.begin(), to_iovec);
    SocketAddress address{to, scope};
    alignas(cmsghdr) std::array<std::byte, CMSG_SPACE(sizeof(std::uint16_t))> control{};
    msghdr message{};
    message.msg_name = address.data();
    message.msg_namelen = address.size();
    message.msg_iov = parts.data();
    message.msg_iovlen = slices.size();
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    cmsghdr* const header = CMSG_FIRSTHDR(&message);
    header->cmsg_level = SOL_UDP;
    header->cmsg_type = UDP_SEGMENT;
    header->cmsg_len = CMSG_LEN(sizeof(std::uint16_t));
    const auto segment = static_cast<std::uint16_t>(datagram_bytes);
    std::memcpy(CMSG_DATA(header), &segment, sizeof segment);
    if (sendmsg(fd, &message, 0) >= 0) {
      return {datagrams, SendStatus::sent};
    }
    if (retry_later(errno)) {
      return {0, SendStatus::would_block};
    }
    // Either the kernel or the device has no segmentation for this, and it is one datagram at a time from now
    // on, or something else is wrong, which sending them singly will show too.
    offload =
        errno != EIO && errno != EINVAL && errno != EMSGSIZE && errno != EOPNOTSUPP && errno != ENOPROTOOPT;
    return {0, SendStatus::failed};
  }

  Batch send_each(const Endpoint& to, std::span<const ByteView> slices,
                  std::span<const std::uint8_t> slice_counts) {
    std::array<iovec, max_slices> parts;
    std::array<mmsghdr, max_datagrams> messages{};
    SocketAddress address{to, scope};
    std::transform(slices.begin(), slices.end(), parts.begin(), to_iovec);
    iovec* next = parts.data();
    for (std::size_t i = 0; i < slice_counts.size(); ++i) {
      msghdr& header = messages[i].msg_hdr;
      header.msg_name = address.data();
      header.msg_namelen = address.size();
      header.msg_iov = next;
      header.msg_iovlen = slice_counts[i];
      next += slice_counts[i];
    }
    const int sent = sendmmsg(fd, messages.data(), static_cast<unsigned>(slice_counts.size()), 0);
    if (sent >= 0) {
      const auto count = static_cast<std::size_t>(sent);
      return {count, count == slice_counts.size() ? SendStatus::sent : SendStatus::would_block};
    }
    return {0, retry_later(errno) ? SendStatus::would_block : SendStatus::failed};
  }

  boost::asio::posix::stream_descriptor descriptor;
  int fd;
  bool v6;
  unsigned scope = 0;
  Endpoint local;
  bool offload = true;
  bool closed = false;
  std::uint64_t overflows = 0;
  Handler handler;
  std::unique_ptr<std::byte[]> room;
};

UdpSocket::UdpSocket(boost::asio::io_context& io, const UdpOptions& options)
    : state_{std::make_shared<State>(io, options)} {}

UdpSocket::~UdpSocket() {
  state_->closed = true;
  boost::system::error_code ignored;
  state_->descriptor.close(ignored);
}

void UdpSocket::receive(Handler handler) {
  // Not zeroed: the system commits the pages as datagrams come.
  state_->room.reset(new std::byte[receive_batch * receive_room]);
  state_->handler = std::move(handler);
  state_->wait_readable();
}

SendStatus UdpSocket::send(const Endpoint& to, std::span<const ByteView> slices) {
  assert(slices.size() <= 64);
  std::array<iovec, 64> parts;
  std::transform(slices.begin(), slices.end(), parts.begin(), to_iovec);
  SocketAddress address{to, state_->scope};
  msghdr message{};
  message.msg_name = address.data();
  message.msg_namelen = address.size();
  message.msg_iov = parts.data();
  message.msg_iovlen = slices.size();
  if (sendmsg(state_->fd, &message, 0) >= 0) {
    return SendStatus::sent;
  }
  return retry_later(errno) ? SendStatus::would_block : SendStatus::failed;
}

UdpSocket::Batch UdpSocket::send_segments(const Endpoint& to, std::span<const ByteView> slices,
                                          std::span<const std::uint8_t> slice_counts,
                                          std::size_t datagram_bytes) {
  assert(slice_counts.size() <= max_datagrams && slices.size() <= max_slices);
  if (state_->offload && slice_counts.size() > 1) {
    const Batch batch = state_->send_train(to, slices, slice_counts.size(), datagram_bytes);
    if (batch.status != SendStatus::failed) {
      return batch;
    }
  }
  return state_->send_each(to, slices, slice_counts);
}

void UdpSocket::wait_writable(std::function<void()> ready) {
  state_->descriptor.async_wait(
      boost::asio::posix::stream_descriptor::wait_write,
      [self = state_, ready = std::move(ready)](const boost::system::error_code& error) {
        if (!error && !self->closed) {
          ready();
        }
      });
}

Endpoint UdpSocket::local() const {
  return state_->local;
}

std::uint64_t UdpSocket::receive_overflows() const {
  return state_->overflows;
}

int UdpSocket::receive_buffer_bytes() const {
  int bytes = 0;
  socklen_t size = sizeof bytes;
  getsockopt(state_->fd, SOL_SOCKET, SO_RCVBUF, &bytes, &size);
  return bytes / 2;  // the kernel reports twice what was asked for: half is for its bookkeeping
}

}  // namespace trestle::someip
