#include "someip/net/tcp_stream.hpp"

#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/post.hpp>
#include <cerrno>
#include <cstring>
#include <deque>
#include <utility>
#include <vector>

#include "someip/net/addresses.hpp"
#include "someip/net/socket_calls.hpp"

namespace trestle::someip {
namespace {

constexpr std::size_t receive_room = 65536;
constexpr int receive_rounds = 16;      // before other handlers get their turn
constexpr std::size_t max_slices = 64;  // of one system call

/// A message on its way out: a Magic Cookie perhaps, the header, the payload.
struct Outgoing {
  std::array<std::byte, 2 * header_bytes> head{};
  std::size_t head_bytes = 0;
  std::vector<ByteView> payload;
  std::shared_ptr<const void> keep_alive;
  std::size_t part = 0;    ///< where the next byte is: 0 is the head, 1 the first slice, ...
  std::size_t offset = 0;  ///< in that part

  [[nodiscard]] bool done() const noexcept { return part > payload.size(); }
  [[nodiscard]] ByteView at(std::size_t index) const noexcept {
    return index == 0 ? ByteView{head}.first(head_bytes) : payload[index - 1];
  }
  /// Puts what is left into `parts`; returns how many it took.
  std::size_t gather(std::span<iovec> parts) const noexcept {
    std::size_t used = 0;
    std::size_t skip = offset;
    for (std::size_t i = part; i <= payload.size() && used < parts.size(); ++i) {
      const ByteView rest = at(i).subspan(std::exchange(skip, 0));
      if (!rest.empty()) {
        parts[used++] = to_iovec(rest);
      }
    }
    return used;
  }
  /// `bytes` more bytes have been sent; returns how many of them were another message's.
  std::size_t sent(std::size_t bytes) noexcept {
    while (!done()) {
      const std::size_t rest = at(part).size() - offset;
      if (bytes < rest) {
        offset += bytes;
        return 0;
      }
      bytes -= rest;
      ++part;
      offset = 0;
    }
    return bytes;
  }
  /// Makes what is left our own.
  void copy_rest() {
    std::size_t first = part == 0 ? 1 : part;
    auto copy = std::make_shared<std::vector<std::byte>>();
    for (std::size_t i = first, skip = part == 0 ? 0 : offset; i <= payload.size(); ++i) {
      const ByteView rest = at(i).subspan(std::exchange(skip, 0));
      copy->insert(copy->end(), rest.begin(), rest.end());
    }
    if (part != 0) {
      offset = 0;
      part = 1;
    }
    payload.assign(1, ByteView{*copy});
    keep_alive = std::move(copy);
  }
};

void set_up(int fd, const TcpOptions& options) {
  set_option(fd, IPPROTO_TCP, TCP_NODELAY, 1);  // [feat_req_someip_325]
  // An idle connection is probed after half of the time, then three times in the other half.
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(options.dead_after).count();
  set_option(fd, SOL_SOCKET, SO_KEEPALIVE, 1);
  set_option(fd, IPPROTO_TCP, TCP_KEEPIDLE, static_cast<int>(std::max<std::int64_t>(1, seconds / 2)));
  set_option(fd, IPPROTO_TCP, TCP_KEEPINTVL, static_cast<int>(std::max<std::int64_t>(1, seconds / 6)));
  set_option(fd, IPPROTO_TCP, TCP_KEEPCNT, 3);
  const auto milliseconds = std::chrono::duration_cast<std::chrono::milliseconds>(options.dead_after).count();
  set_option(fd, IPPROTO_TCP, TCP_USER_TIMEOUT, static_cast<int>(milliseconds));
  if (options.receive_buffer_bytes != 0) {
    set_buffer(fd, SO_RCVBUFFORCE, SO_RCVBUF, options.receive_buffer_bytes);
  }
  if (options.send_buffer_bytes != 0) {
    set_buffer(fd, SO_SNDBUFFORCE, SO_SNDBUF, options.send_buffer_bytes);
  }
}

}  // namespace

struct TcpStream::State : std::enable_shared_from_this<State> {
  State(boost::asio::io_context& io, Descriptor connected, StreamEnd which, const TcpOptions& tcp)
      : descriptor{io, connected.get()},
        fd{connected.release()},
        own{which},
        options{tcp},
        // Not zeroed: the system commits the pages as messages need them.
        buffer{new std::byte[header_bytes + options.max_message_bytes]},
        parser{ByteSpan{buffer.get(), header_bytes + options.max_message_bytes}},
        room{new std::byte[receive_room]} {
    set_up(fd, options);
    SocketAddress address;
    getsockname(fd, address.data(), &address.size());
    local = address.endpoint();
    SocketAddress peer;
    if (getpeername(fd, peer.data(), &peer.size()) == 0) {
      remote = peer.endpoint();
    }
  }

  // --- receiving ---

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

  // False when nothing more waits, or the connection is over.
  bool receive_once() {
    // The rest of a large message goes straight to its place.
    const ByteSpan direct = parser.missing();
    std::array<iovec, 2> places{iovec{direct.data(), direct.size()}, iovec{room.get(), receive_room}};
    const ssize_t received = direct.empty() ? readv(fd, &places[1], 1) : readv(fd, places.data(), 2);
    if (received <= 0) {
      if (received == 0) {
        close(parser.in_message() ? "the peer closed the connection within a message"
                                  : "the peer closed the connection");
      } else if (!retry_later(errno)) {
        close(std::strerror(errno));
      }
      return false;
    }
    const auto bytes = static_cast<std::size_t>(received);
    const std::size_t taken = parser.filled(bytes);
    if (!deliver()) {
      return false;
    }
    parser.feed({room.get(), bytes - taken});
    if (!deliver()) {
      return false;
    }
    if (parser.lost() && !options.magic_cookies && parser.counters().cookies == 0) {
      close(parser.counters().too_large != 0
                ? "a message larger than is allowed, or something that is no SOME/IP, came"
                : "something that is no SOME/IP came: a length below 8");
      return false;
    }
    return bytes == direct.size() + receive_room;
  }

  bool deliver() {
    while (const auto message = parser.next()) {
      on_message(*message);
      if (closed) {
        return false;
      }
    }
    return true;
  }

  // --- sending ---

  // Sends what waits, several messages at a time, until the system takes no more.  [feat_req_someip_702]
  void pump() {
    while (!queue.empty()) {
      std::array<iovec, max_slices> parts;
      std::size_t used = 0;
      for (auto one = queue.begin(); one != queue.end() && used < parts.size(); ++one) {
        used += one->gather(std::span{parts}.subspan(used));
      }
      msghdr message{};
      message.msg_iov = parts.data();
      message.msg_iovlen = used;
      const ssize_t sent = sendmsg(fd, &message, MSG_NOSIGNAL);
      if (sent < 0) {
        if (retry_later(errno)) {
          wait_writable();
        } else {
          close_later(std::strerror(errno));
        }
        return;
      }
      auto bytes = static_cast<std::size_t>(sent);
      queued_bytes -= bytes;
      while (!queue.empty()) {
        bytes = queue.front().sent(bytes);
        if (!queue.front().done()) {
          break;
        }
        ++messages_sent;
        queue.pop_front();
      }
    }
  }

  void wait_writable() {
    if (waiting) {
      return;
    }
    waiting = true;
    descriptor.async_wait(boost::asio::posix::stream_descriptor::wait_write,
                          [self = shared_from_this()](const boost::system::error_code& error) {
                            self->waiting = false;
                            if (!error && !self->closed) {
                              self->pump();
                            }
                          });
  }

  // --- the end ---

  void close(const std::string& why) {
    if (closed) {
      return;
    }
    const auto self = shared_from_this();
    release();
    if (on_closed) {
      on_closed(why);
    }
  }

  // Not at once: the caller of send() does not expect to be called back.
  void close_later(const std::string& why) {
    broken = true;
    boost::asio::post(descriptor.get_executor(), [weak = weak_from_this(), why] {
      if (const auto self = weak.lock()) {
        self->close(why);
      }
    });
  }

  void release() {
    closed = true;
    boost::system::error_code ignored;
    descriptor.close(ignored);
    queue.clear();
  }

  boost::asio::posix::stream_descriptor descriptor;
  int fd;
  StreamEnd own;
  TcpOptions options;
  std::unique_ptr<std::byte[]> buffer;
  StreamParser parser;
  std::unique_ptr<std::byte[]> room;
  Endpoint local;
  Endpoint remote;
  MessageHandler on_message;
  CloseHandler on_closed;
  std::deque<Outgoing> queue;
  std::size_t queued_bytes = 0;
  CookieSchedule cookies;
  std::uint64_t messages_sent = 0;
  std::uint64_t queue_full = 0;
  bool waiting = false;  ///< for room to send
  bool broken = false;   ///< sending failed: about to be closed
  bool closed = false;
};

TcpStream::Counters& TcpStream::Counters::operator+=(const Counters& other) noexcept {
  received += other.received;
  messages_sent += other.messages_sent;
  queue_full += other.queue_full;
  return *this;
}

TcpStream::TcpStream(boost::asio::io_context& io, Descriptor connected, StreamEnd own,
                     const TcpOptions& options)
    : state_{std::make_shared<State>(io, std::move(connected), own, options)} {}

TcpStream::~TcpStream() {
  state_->release();
}

void TcpStream::receive(MessageHandler on_message, CloseHandler on_closed) {
  state_->on_message = std::move(on_message);
  state_->on_closed = std::move(on_closed);
  state_->wait_readable();
}

bool TcpStream::send(const Header& header, std::span<const ByteView> payload,
                     std::shared_ptr<const void> keep_alive) {
  State& state = *state_;
  if (state.closed || state.broken) {
    return false;
  }
  std::size_t payload_bytes = 0;
  for (const ByteView slice : payload) {
    payload_bytes += slice.size();
  }
  Outgoing message;
  ByteSpan head{message.head};
  const std::size_t bytes = head.size() + payload_bytes;
  if (bytes > state.options.max_queued_bytes - std::min(state.queued_bytes, state.options.max_queued_bytes)) {
    ++state.queue_full;
    return false;
  }
  if (state.options.magic_cookies && state.cookies.before_message(std::chrono::steady_clock::now())) {
    const auto cookie = magic_cookie(state.own);
    std::copy(cookie.begin(), cookie.end(), head.begin());
    message.head_bytes = cookie.size();
  }
  if (!encode_header(header, payload_bytes, head.subspan(message.head_bytes))) {
    return false;  // larger than the Length field can say
  }
  message.head_bytes += header_bytes;
  message.payload.assign(payload.begin(), payload.end());
  message.keep_alive = std::move(keep_alive);
  state.queued_bytes += message.head_bytes + payload_bytes;
  state.queue.push_back(std::move(message));
  if (!state.waiting) {
    state.pump();
  }
  // The last one in the queue, if there is any, is this one. Its slices may not live any longer.
  if (!state.queue.empty() && !state.queue.back().keep_alive) {
    state.queue.back().copy_rest();
  }
  return !state.broken;
}

const Endpoint& TcpStream::local() const noexcept {
  return state_->local;
}
const Endpoint& TcpStream::remote() const noexcept {
  return state_->remote;
}
bool TcpStream::idle() const noexcept {
  return state_->queue.empty();
}
TcpStream::Counters TcpStream::counters() const noexcept {
  return {state_->parser.counters(), state_->messages_sent, state_->queue_full};
}

}  // namespace trestle::someip
