#include "someip/net/udp_socket.hpp"

#include <netinet/udp.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cerrno>
#include <cstring>
#include <utility>

#include "someip/net/addresses.hpp"
#include "someip/net/handler_memory.hpp"
#include "someip/net/socket_calls.hpp"
#include "someip/net/udp_errors.hpp"
#include "someip/net/udp_open.hpp"
#include "someip/net/udp_transmitter.hpp"

namespace trestle::someip {
namespace {

constexpr std::size_t receive_batch = 16;    // datagrams (with GRO: trains of datagrams) per system call
constexpr std::size_t receive_room = 65536;  // bytes of each
constexpr int error_batch = 16;              // errors of sent datagrams that are read instead of a batch
constexpr std::chrono::milliseconds interface_pause{1};  // before a full network interface is tried again

// What the kernel reports together with a datagram.
struct Ancillary {
  /// The size of the datagrams in a train that it joined (UDP_GRO); 0 when it is a single one.
  std::size_t segment_bytes = 0;
  /// Datagrams lost so far because the receive buffer was full (SO_RXQ_OVFL); it counts with 32 bits.
  std::optional<std::uint32_t> overflows = std::nullopt;
};
constexpr std::size_t ancillary_room = CMSG_SPACE(sizeof(int)) + CMSG_SPACE(sizeof(std::uint32_t));

// Where the system puts what it has received.
struct Inbox {
  std::array<mmsghdr, receive_batch> messages{};
  std::array<iovec, receive_batch> places{};
  std::array<SocketAddress, receive_batch> senders{};
  std::array<std::array<std::byte, ancillary_room>, receive_batch> controls{};
  // Not zeroed: the system commits the pages as datagrams come.
  std::unique_ptr<std::byte[]> room{new std::byte[receive_batch * receive_room]};

  Inbox() {
    for (std::size_t i = 0; i < receive_batch; ++i) {
      places[i] = {room.get() + i * receive_room, receive_room};
      msghdr& header = messages[i].msg_hdr;
      header.msg_name = senders[i].data();
      header.msg_iov = &places[i];
      header.msg_iovlen = 1;
      header.msg_control = controls[i].data();
      reset(i);
    }
  }
  // Sets the sizes of the room again: the system has overwritten them with what it used.
  void reset(std::size_t i) noexcept {
    messages[i].msg_hdr.msg_namelen = sizeof(sockaddr_storage);
    messages[i].msg_hdr.msg_controllen = ancillary_room;
  }
};

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
  State(boost::asio::io_context& io, const UdpOptions& wanted)
      : options{wanted},
        descriptor{io, open_udp(options)},
        pause{io},
        fd{descriptor.native_handle()},
        interface {
    udp_interface(options)
  }, transmitter{fd, options.local.address.v6 ? interface : 0} {
    SocketAddress own;
    getsockname(fd, own.data(), &own.size());
    local = own.endpoint();
    if (options.source) {
      transmitter.send_from(*options.source);
    }
  }

  void wait_readable() {
    descriptor.async_wait(
        boost::asio::posix::stream_descriptor::wait_read,
        read_memory.hold([self = shared_from_this()](const boost::system::error_code& error) {
          if (!error && !self->closed) {
            self->drain();
          }
        }));
  }

  void wait_writable() {
    auto done = write_memory.hold([self = shared_from_this()](const boost::system::error_code& error) {
      self->waiting = false;
      if (const auto ready = std::exchange(self->writable, nullptr); ready && !error && !self->closed) {
        ready();
      }
    });
    if (transmitter.interface_full()) {
      pause.expires_after(interface_pause);
      pause.async_wait(std::move(done));
    } else {
      descriptor.async_wait(boost::asio::posix::stream_descriptor::wait_write, std::move(done));
    }
  }

  void drain() {
    if (transmitter.take_told_error()) {
      read_errors();
    }
    for (int round = 0; round < options.batches_in_a_row && !closed; ++round) {
      if (!receive_once(round == 0)) {
        break;
      }
    }
    if (!closed) {
      wait_readable();
    }
  }

  // Reports some of the errors that the system has, which make the socket readable. False if there were none.
  bool read_errors() {
    bool some = false;
    for (int i = 0; i < error_batch && !closed; ++i) {
      const auto error = next_udp_error(fd, local.address);
      if (!error) {
        break;
      }
      some = true;
      if (error->kind == UdpError::Kind::unreachable) {
        unreachable(error->receiver);
      } else if (error->kind == UdpError::Kind::hearsay) {
        ++hearsay;
      }
    }
    return some;
  }

  // Receives one batch; false when there was less than a batch, so that nothing more waits.
  bool receive_once(bool first) {
    const int received = receive_batch_of(inbox->messages);
    if (received <= 0) {
      // The call returned an error instead of datagrams, or a stored error alone made the socket readable.
      return unreachable && (first || !retry_later(errno)) && read_errors();
    }
    struct Receiving {  // also when a handler throws
      bool& flag;
      explicit Receiving(bool& of) : flag{of} { flag = true; }
      ~Receiving() { flag = false; }
    };
    std::optional<Receiving> now{receiving};
    for (std::size_t i = 0; i < static_cast<std::size_t>(received) && !closed; ++i) {
      const ByteView bytes{inbox->room.get() + i * receive_room, inbox->messages[i].msg_len};
      const Ancillary ancillary = ancillary_of(inbox->messages[i].msg_hdr);
      if (ancillary.overflows) {
        overflows += *ancillary.overflows - static_cast<std::uint32_t>(overflows);
      }
      inbox->reset(i);
      handler({.peer = inbox->senders[i].endpoint(),
               .bytes = bytes,
               .datagram_bytes = ancillary.segment_bytes == 0 ? bytes.size() : ancillary.segment_bytes});
    }
    now.reset();
    if (!closed && received_all) {
      received_all();
    }
    // Whether the batch was full; when datagrams are received one by one, more may always wait.
    return !closed && (received == static_cast<int>(receive_batch) || !has_recvmmsg);
  }

  // How many came, or -1: none, and errno says why.
  int receive_batch_of(std::array<mmsghdr, receive_batch>& messages) {
    if (has_recvmmsg) {
      const int received = recvmmsg(fd, messages.data(), receive_batch, 0, nullptr);
      if (received >= 0 || errno != ENOSYS) {
        return received;
      }
      has_recvmmsg = false;
    }
    const ssize_t bytes = recvmsg(fd, &messages[0].msg_hdr, 0);
    messages[0].msg_len = bytes < 0 ? 0 : static_cast<unsigned>(bytes);
    return bytes < 0 ? -1 : 1;
  }

  UdpOptions options;
  HandlerMemory read_memory;
  HandlerMemory write_memory;
  boost::asio::posix::stream_descriptor descriptor;
  boost::asio::steady_timer pause;  ///< while the network interface is full
  int fd;
  unsigned interface;  ///< for multicast; 0: none
  Endpoint local;
  UdpTransmitter transmitter;
  bool closed = false;
  bool receiving = false;
  bool has_recvmmsg = true;
  bool waiting = false;  ///< for room to send
  std::uint64_t overflows = 0;
  std::uint64_t hearsay = 0;  ///< see unreachable_ignored()
  TrainHandler handler;
  std::function<void(const Endpoint&)> unreachable;
  std::function<void()> received_all;
  std::function<void()> writable;
  std::unique_ptr<Inbox> inbox;
};

UdpSocket::UdpSocket(boost::asio::io_context& io, const UdpOptions& options)
    : state_{std::make_shared<State>(io, options)} {}

UdpSocket::~UdpSocket() {
  state_->closed = true;
  boost::system::error_code ignored;
  state_->descriptor.close(ignored);
  state_->pause.cancel();
}

void UdpSocket::receive(Handler handler) {
  receive_trains([state = state_.get(), handler = std::move(handler)](const Train& train) {
    for (std::size_t i = 0; i < train.size() && !state->closed; ++i) {
      handler(train[i], train.peer);
    }
  });
}

void UdpSocket::receive_trains(TrainHandler handler) {
  state_->inbox = std::make_unique<Inbox>();
  state_->handler = std::move(handler);
  state_->wait_readable();
}

void UdpSocket::report_unreachable(std::function<void(const Endpoint& receiver)> handler) {
  state_->unreachable = std::move(handler);
  state_->transmitter.expect_told_errors();
  keep_udp_errors(state_->fd, state_->local.address.v6);
}

bool UdpSocket::receiving() const noexcept {
  return state_->receiving;
}

void UdpSocket::after_receiving(std::function<void()> done) {
  state_->received_all = std::move(done);
}

SendStatus UdpSocket::send(const Endpoint& to, std::span<const ByteView> slices) {
  return state_->transmitter.send(to, slices);
}

UdpSocket::Batch UdpSocket::send_segments(const Endpoint& to, std::span<const ByteView> slices,
                                          std::span<const std::uint8_t> slice_counts,
                                          std::size_t datagram_bytes) {
  return state_->transmitter.send_segments(to, slices, slice_counts, datagram_bytes);
}

UdpSocket::Batch UdpSocket::send_trains(std::span<const Train> trains) {
  return state_->transmitter.send_trains(trains);
}

void UdpSocket::loop_multicast(bool on) {
  const int kept = errno;
  const bool v6 = state_->options.local.address.v6;
  set_option(state_->fd, v6 ? IPPROTO_IPV6 : IPPROTO_IP, v6 ? IPV6_MULTICAST_LOOP : IP_MULTICAST_LOOP, on);
  errno = kept;
}

void UdpSocket::wait_writable(std::function<void()> ready) {
  state_->writable = std::move(ready);
  if (state_->writable && !std::exchange(state_->waiting, true)) {
    state_->wait_writable();
  }
}

void UdpSocket::follow_interface() {
  state_->interface = someip::follow_interface(state_->fd, state_->options, state_->interface);
}

Endpoint UdpSocket::local() const {
  return state_->local;
}

std::uint64_t UdpSocket::receive_overflows() const {
  return state_->overflows;
}

std::uint64_t UdpSocket::unreachable_ignored() const noexcept {
  return state_->hearsay;
}

int UdpSocket::receive_buffer_bytes() const {
  return buffer_bytes(state_->fd, SO_RCVBUF);
}
int UdpSocket::send_buffer_bytes() const {
  return buffer_bytes(state_->fd, SO_SNDBUF);
}
std::chrono::microseconds UdpSocket::busy_poll() const {
  int microseconds = 0;
  socklen_t size = sizeof microseconds;
  getsockopt(state_->fd, SOL_SOCKET, SO_BUSY_POLL, &microseconds, &size);
  return std::chrono::microseconds{microseconds};
}
const UdpSendCounters& UdpSocket::send_counters() const noexcept {
  return state_->transmitter.counters();
}

}  // namespace trestle::someip
