#include "someip/net/tcp_stream.hpp"

#include <linux/sockios.h>
#include <netinet/tcp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cerrno>
#include <cstring>
#include <limits>
#include <list>
#include <new>
#include <utility>
#include <vector>

#include "someip/net/addresses.hpp"
#include "someip/net/copy_pool.hpp"
#include "someip/net/handler_memory.hpp"
#include "someip/net/receive_memory.hpp"
#include "someip/net/send_budget.hpp"
#include "someip/net/socket_calls.hpp"
#include "someip/net/tls_channel.hpp"
#include "someip/wire/counters.hpp"
#include "someip/wire/slices.hpp"

namespace trestle::someip {
namespace {

constexpr std::size_t stream_room = 65536;
constexpr int stream_rounds = 16;                // before other handlers get their turn
constexpr std::size_t max_slices = 64;           // of one system call
constexpr std::size_t small_bytes = 4096;        // messages up to this size are copied to save a system call
constexpr std::size_t max_unused_messages = 64;  // places of the queue that are kept for reuse
constexpr std::size_t message_id_bytes = 4;      // of a header: Service ID and Method ID
constexpr std::size_t most_head_bytes = 2 * header_bytes;  // a Magic Cookie and the header

/// A message on its way out: a Magic Cookie perhaps, the header, the payload.
struct Outgoing {
  std::array<std::byte, most_head_bytes> head{};
  std::size_t head_start = header_bytes;  ///< 0 with a cookie
  std::size_t payload_bytes = 0;
  std::vector<ByteView> payload{};
  std::vector<std::byte> copy{};  ///< holds what is left, if nobody else keeps it
  std::shared_ptr<const void> keep_alive{};
  std::size_t part = 0;    ///< part with the next byte: 0 is the head, 1 the first slice, ...
  std::size_t offset = 0;  ///< position in that part
  bool answer = false;     ///< counts for TcpOptions::max_unread_answer_bytes

  [[nodiscard]] bool done() const noexcept { return part > payload.size(); }
  [[nodiscard]] ByteView at(std::size_t index) const noexcept {
    return index == 0 ? ByteView{head}.subspan(head_start) : payload[index - 1];
  }
  [[nodiscard]] std::size_t bytes() const noexcept { return head.size() - head_start + payload_bytes; }
  /// Whether its Message ID is that of this header.
  [[nodiscard]] bool has_id_of(ByteView header) const noexcept {
    return std::ranges::equal(ByteView{head}.subspan(header_bytes, message_id_bytes),
                              header.first(message_id_bytes));
  }
  /// Puts a Magic Cookie before the message, of which nothing has been sent.
  void prepend_cookie(StreamEnd sender) noexcept {
    const auto cookie = magic_cookie(sender);
    std::copy(cookie.begin(), cookie.end(), head.begin());
    head_start = 0;
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
  /// Copies what is left into `memory`, which the message then owns.
  void copy_rest(std::vector<std::byte> memory) {
    copy = std::move(memory);
    const std::size_t first = part == 0 ? 1 : part;
    for (std::size_t i = first, skip = part == 0 ? 0 : offset; i <= payload.size(); ++i) {
      const ByteView rest = at(i).subspan(std::exchange(skip, 0));
      copy.insert(copy.end(), rest.begin(), rest.end());
    }
    if (part != 0) {
      offset = 0;
      part = 1;
    }
    payload.assign(1, ByteView{copy});
  }
};

void set_buffers(int fd, const TcpOptions& options) {
  if (options.receive_buffer_bytes != 0) {
    set_buffer(fd, SO_RCVBUFFORCE, SO_RCVBUF, options.receive_buffer_bytes);
  }
  if (options.send_buffer_bytes != 0) {
    set_buffer(fd, SO_SNDBUFFORCE, SO_SNDBUF, options.send_buffer_bytes);
  }
}

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
  set_buffers(fd, options);
}

}  // namespace

TcpBuffers granted_buffers(const TcpOptions& options) {
  const Descriptor probe{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  if (probe.get() < 0) {
    fail(Transport::tcp, {}, "open a socket", errno);
  }
  set_buffers(probe.get(), options);
  return {buffer_bytes(probe.get(), SO_RCVBUF), buffer_bytes(probe.get(), SO_SNDBUF)};
}

struct TcpStream::State : std::enable_shared_from_this<State> {
  State(boost::asio::io_context& io, Descriptor connected, StreamEnd which, const TcpOptions& tcp,
        std::shared_ptr<CopyPool> pool)
      : descriptor{io, connected.get()},
        message_timer{io},
        fd{connected.release()},  // the descriptor closes it, also if the code below throws
        own{which},
        options{tcp},
        copies{std::move(pool)},
        queued_bytes{tcp.send_budget},
        // A message that lies in one read always fits.
        place{tcp.receive_budget ? tcp.receive_budget : no_bound(),
              std::min(header_bytes + options.max_message_bytes, header_bytes + stream_room),
              [this] { return use_of_memory(); }, [this] { memory_taken(); },
              [this](ByteSpan bytes) { parser.use(bytes); }},
        parser{place.bytes(), header_bytes + options.max_message_bytes},
        room{new std::byte[stream_room]},
        tls{tcp.tls ? tcp.tls->open(fd, which) : nullptr},
        secured{tls == nullptr} {
    set_up(fd, options);
    SocketAddress address;
    getsockname(fd, address.data(), &address.size());
    local = address.endpoint();
  }

  static std::shared_ptr<ReceiveBudget> no_bound() {
    return std::make_shared<ReceiveBudget>(std::numeric_limits<std::size_t>::max() / 2);
  }

  // --- the handshake of TLS ---

  void begin_to_secure() {
    message_timer.expires_after(options.tls->handshake_timeout());
    message_timer.async_wait([weak = weak_from_this()](const boost::system::error_code& error) {
      const auto self = weak.lock();
      if (!error && self && !self->closed && !self->secured) {
        self->fail_to_secure("it took too long");
      }
    });
    secure();
  }

  void secure() {
    using Wait = boost::asio::posix::stream_descriptor;
    switch (tls->handshake()) {
      case TlsChannel::Step::done:
        message_timer.cancel();
        secured = true;
        on_secured();
        if (!closed) {
          pump_if_ready();
          wait_readable();
        }
        break;
      case TlsChannel::Step::to_receive:
        secure_when(Wait::wait_read);
        break;
      case TlsChannel::Step::to_send:
        secure_when(Wait::wait_write);
        break;
      case TlsChannel::Step::failed:
        fail_to_secure(tls->error());
    }
  }

  void secure_when(boost::asio::posix::stream_descriptor::wait_type ready) {
    descriptor.async_wait(
        ready, read_memory.hold([self = shared_from_this()](const boost::system::error_code& error) {
          if (!error && !self->closed) {
            self->secure();
          }
        }));
  }

  void fail_to_secure(const std::string& why) {
    ++counters.handshakes_failed;
    close("the TLS handshake failed: " + why);
  }

  // What the system says of a failed call, or TLS.
  [[nodiscard]] std::string why_failed() const {
    return tls && !tls->error().empty() ? "TLS: " + tls->error() : std::string{std::strerror(errno)};
  }

  [[nodiscard]] ssize_t read_into(std::span<const iovec> places) {
    return tls ? tls->receive(places) : readv(fd, places.data(), static_cast<int>(places.size()));
  }

  [[nodiscard]] ssize_t send_parts(const msghdr& message, int flags) {
    return tls ? tls->send({message.msg_iov, message.msg_iovlen})
               : sendmsg(fd, &message, MSG_NOSIGNAL | flags);
  }

  // --- receiving ---

  // From a client that does not read its answers no more requests are read. Only a server does this: if both
  // ends did, each could wait for the other.
  [[nodiscard]] bool answers_are_unread() const noexcept {
    return own == StreamEnd::server && answer_bytes > options.max_unread_answer_bytes;
  }

  void wait_readable() {
    if (answers_are_unread()) {
      ++counters.held_back;
      holding_back = true;
      return;
    }
    if (tls && tls->has_unread()) {
      boost::asio::post(descriptor.get_executor(), [self = shared_from_this()] {
        if (!self->closed && !self->taken) {
          self->drain();
        }
      });
      return;
    }
    descriptor.async_wait(
        boost::asio::posix::stream_descriptor::wait_read,
        read_memory.hold([self = shared_from_this()](const boost::system::error_code& error) {
          if (!error && !self->closed && !self->taken) {
            self->drain();
          }
        }));
  }

  void drain() {
    for (int round = 0; round < stream_rounds && !answers_are_unread(); ++round) {
      if (!receive_or_end()) {
        break;
      }
    }
    if (!closed && !taken) {
      watch_message();
      wait_readable();
    }
  }

  [[nodiscard]] ReceiveMemory::Use use_of_memory() const {
    return {.may_be_taken = !delivering && !closed && !taken,
            .held_bytes = parser.held(),
            .held_for = message_since && messages_before() == message_number
                            ? std::chrono::steady_clock::now() - *message_since
                            : std::chrono::steady_clock::duration::zero()};
  }

  // Another connection needs the memory.
  void memory_taken() {
    taken = true;
    ++counters.no_memory;
    close_later(no_memory_for_a_message);
  }

  // Twice as much as has been received, so that a peer must fill memory before it gets more.
  bool make_room_for_message() {
    const std::size_t all = parser.held() + parser.waiting();
    if (place.grow(std::min(parser.needed(), std::max(2 * parser.held(), all)))) {
      return true;
    }
    ++counters.no_memory;
    close(no_memory_for_a_message);
    return false;
  }

  // --- a message that takes too long ---

  [[nodiscard]] bool message_under_way() const noexcept { return parser.in_message() || parser.lost(); }
  /// Changes with each message that is complete.
  [[nodiscard]] std::uint64_t messages_before() const noexcept {
    return parser.counters().messages + parser.counters().cookies;
  }

  // The timer is not set anew for each message: it checks how long the present message has taken.
  void watch_message() {
    if (!message_under_way()) {
      return;
    }
    if (!message_since || messages_before() != message_number) {
      message_since = std::chrono::steady_clock::now();
      message_number = messages_before();
    }
    if (!watching && options.message_timeout != Duration::zero()) {
      watching = true;
      wait_for_message();
    }
  }

  void wait_for_message() {
    message_timer.expires_at(*message_since + options.message_timeout);
    message_timer.async_wait([weak = weak_from_this()](const boost::system::error_code& error) {
      const auto self = weak.lock();
      if (error || !self || self->closed) {
        return;
      }
      self->watching = false;
      if (self->holding_back ||  // it is we who do not read
          !self->message_under_way() || self->messages_before() != self->message_number) {
        self->message_since.reset();
        self->watch_message();
      } else if (std::chrono::steady_clock::now() < *self->message_since + self->options.message_timeout) {
        self->watch_message();
      } else {
        ++self->counters.timed_out;
        self->close("a message was begun and not completed in time");
      }
    });
  }

  // When memory runs out, also in a handler, this connection ends and the others stay.
  bool receive_or_end() {
    static const std::string why{no_memory_for_a_message};  // allocated while there is memory
    try {
      return receive_once();
    } catch (const std::bad_alloc&) {
      ++counters.no_memory;
    }
    try {
      close(why);
    } catch (const std::bad_alloc&) {  // the handler has no memory either
      closed = true;
    }
    return false;
  }

  // False when nothing more waits, or the connection is over.
  bool receive_once() {
    // The rest of a large message goes straight to its place.
    const ByteSpan direct = parser.missing();
    std::array<iovec, 2> places{iovec{direct.data(), direct.size()}, iovec{room.get(), stream_room}};
    const ssize_t received = read_into(std::span{places}.subspan(direct.empty() ? 1 : 0));
    if (received <= 0) {
      if (received == 0) {
        close(parser.in_message() ? "the peer closed the connection within a message"
                                  : "the peer closed the connection");
      } else if (!retry_later(errno)) {
        close(why_failed());
      } else if (tls && tls->waits_to_send()) {
        wait_writable();
      }
      return false;
    }
    const auto bytes = static_cast<std::size_t>(received);
    const std::size_t direct_bytes = parser.filled(bytes);
    if (!deliver()) {
      return false;
    }
    parser.feed({room.get(), bytes - direct_bytes});
    if (!deliver()) {
      return false;
    }
    pump_if_ready();
    if (closed) {
      return false;
    }
    if (parser.lost() && !options.magic_cookies && parser.counters().cookies == 0) {
      close(parser.counters().too_large != 0
                ? "received a message larger than allowed, or bytes that are no SOME/IP"
                : "received bytes that are no SOME/IP: a length below 8");
      return false;
    }
    return bytes == direct.size() + stream_room;
  }

  bool deliver() {
    struct Delivering {  // also when a handler throws
      State& state;
      explicit Delivering(State& of) : state{of} { state.delivering = true; }
      ~Delivering() { state.delivering = state.answered = false; }
    };
    for (;;) {
      {
        const Delivering now{*this};
        while (const auto message = parser.next()) {
          on_message(*message);
          if (closed || taken) {
            return false;
          }
        }
      }
      if (parser.waiting() == 0) {
        return true;
      }
      if (!make_room_for_message()) {
        return false;
      }
    }
  }

  // --- sending ---

  // Sends a message; what the system does not take at once is queued. Only called when the queue is empty.
  void send_now(const Outgoing& head, std::span<const ByteView> payload,
                std::shared_ptr<const void>&& keep_alive, std::size_t bytes) {
    std::array<iovec, max_slices> parts;
    parts[0] = to_iovec(head.at(0));
    const std::size_t slices = std::min(payload.size(), parts.size() - 1);
    std::transform(payload.begin(), payload.begin() + static_cast<std::ptrdiff_t>(slices), parts.begin() + 1,
                   to_iovec);
    msghdr message{};
    message.msg_iov = parts.data();
    message.msg_iovlen = slices + 1;
    const ssize_t sent = send_parts(message, 0);
    sent_bytes += sent < 0 ? 0U : static_cast<std::size_t>(sent);
    if (tls && tls->waits_to_send()) {
      wait_writable();
    }
    if (sent < 0 && !retry_later(errno)) {
      close_later(why_failed());
    } else if (sent >= 0 && static_cast<std::size_t>(sent) == bytes) {
      ++counters.messages_sent;
    } else {
      enqueue(head, payload, std::move(keep_alive), bytes, sent < 0 ? 0 : static_cast<std::size_t>(sent));
      pump();
    }
  }

  // Whether a message with so much payload may wait. The places of messages count too, so that messages
  // without payload cannot take unlimited memory.
  [[nodiscard]] bool admits(std::size_t payload_bytes) const noexcept {
    const std::size_t bytes = most_head_bytes + payload_bytes;
    const std::size_t used = queued_bytes.count() + queue.size() * sizeof(Outgoing);
    return bytes <= options.max_queued_bytes - std::min(used, options.max_queued_bytes) &&
           queued_bytes.admits(bytes);
  }

  // `sent` bytes of the message have left already.
  void enqueue(const Outgoing& head, std::span<const ByteView> payload,
               std::shared_ptr<const void>&& keep_alive, std::size_t bytes, std::size_t sent) {
    // For the whole message, even if less is left: so the next message of this size can reuse the memory.
    std::vector<std::byte> memory = keep_alive ? std::vector<std::byte>{} : copies->take(head.payload_bytes);
    if (unused.empty()) {
      unused.emplace_front();
    }
    queue.splice(queue.end(), unused, unused.begin());
    Outgoing& last = queue.back();
    last.head = head.head;
    last.head_start = head.head_start;
    last.payload_bytes = head.payload_bytes;
    last.part = 0;
    last.offset = 0;
    last.answer = head.answer;
    answer_bytes += head.answer ? header_bytes + head.payload_bytes : 0;
    last.payload.assign(payload.begin(), payload.end());
    last.keep_alive = std::move(keep_alive);
    static_cast<void>(last.sent(sent));
    if (!last.keep_alive) {
      last.copy_rest(std::move(memory));  // its slices may not live any longer
    }
    queued_bytes.add(bytes - sent);
  }

  // Removes the first one. Its owner is released last: it may send another message or destroy the stream.
  void dispose_first(std::list<Outgoing>& of) {
    Outgoing& first = of.front();
    answer_bytes -= first.answer ? header_bytes + first.payload_bytes : 0;
    const std::shared_ptr<const void> kept = std::move(first.keep_alive);
    copies->give_back(std::move(first.copy));
    if (unused.size() == max_unused_messages) {
      of.pop_front();
    } else {
      unused.splice(unused.begin(), of, of.begin());
    }
  }

  // Messages in a segment with a cookie count as partly sent.
  Room make_room(const Header& newer, const WaitRule& rule) {
    if (rule.most == 0 || queue.size() < rule.most) {
      return {};
    }
    std::array<std::byte, 2 * header_bytes> id;
    if (queue.size() > max_looked_through || !encode_header(newer, 0, id)) {
      ++counters.overtaken;
      return {false, 1};
    }
    std::size_t like_it = 0;
    std::size_t before = 0;  // bytes of those before it, except the first, which may be partly sent
    auto oldest = queue.end();
    for (auto one = queue.begin(); one != queue.end(); ++one) {
      if (one->part == 0 && one->offset == 0 && before >= segment_left && one->has_id_of(id)) {
        oldest = like_it++ == 0 ? one : oldest;
      }
      before += one == queue.begin() ? 0 : one->bytes();
    }
    if (like_it < rule.most) {
      return {};
    }
    ++counters.overtaken;
    if (rule.keep_oldest) {
      return {false, 1};
    }
    queued_bytes.remove(oldest->bytes());
    std::list<Outgoing> dropped;
    dropped.splice(dropped.end(), queue, oldest);
    dispose_first(dropped);
    return {true, 1};
  }

  void pump_if_ready() {
    if (!waiting && !broken && !closed) {
      pump();
    }
  }

  void pump() {
    if (std::exchange(pumping, true)) {
      return;  // called by the owner of a sent message: the loop below goes on
    }
    const auto self = shared_from_this();
    send_what_waits();
    pumping = false;
  }

  // Sends several messages with one call, until the system takes no more.  [feat_req_someip_702]
  void send_what_waits() {
    if (!secured) {
      return;
    }
    while (!queue.empty() && !broken) {
      std::array<iovec, max_slices> parts;
      msghdr message{};
      message.msg_iov = parts.data();
      const int flags = gather(parts, message.msg_iovlen);
      const ssize_t sent = send_parts(message, flags);
      if (sent < 0) {
        if (retry_later(errno)) {
          wait_writable();
        } else {
          close_later(why_failed());
        }
        return;
      }
      auto bytes = static_cast<std::size_t>(sent);
      sent_bytes += bytes;
      queued_bytes.remove(bytes);
      segment_left -= std::min(segment_left, bytes);
      // All sent messages are removed before their owners are released: an owner may have others dropped.
      std::list<Outgoing> done;
      while (!queue.empty()) {
        bytes = queue.front().sent(bytes);
        if (!queue.front().done()) {
          break;
        }
        ++counters.messages_sent;
        done.splice(done.end(), queue, queue.begin());
      }
      while (!done.empty()) {
        dispose_first(done);
        if (closed) {
          return;
        }
      }
    }
    if (tls && !closed && !broken && !tls->flush()) {
      if (retry_later(errno)) {
        wait_writable();
      } else {
        close_later(why_failed());
      }
    }
    if (holding_back && !closed && !broken && answer_bytes <= options.max_unread_answer_bytes / 2) {
      holding_back = false;
      wait_readable();
    }
  }

  [[nodiscard]] bool by_segment() const noexcept {
    return options.magic_cookies && options.cookie_in_each_segment;
  }

  // Puts what one system call sends into `parts`, of which it uses `used`; returns the flags of the call.
  int gather(std::span<iovec> parts, std::size_t& used) {
    const bool segments = by_segment();
    if (segments && segment_left == 0) {
      begin_segment();
    }
    std::size_t bytes = 0;
    used = 0;
    for (auto one = queue.begin(); one != queue.end() && used < parts.size(); ++one) {
      if (segments && bytes == segment_left) {
        break;  // what follows is for the next segment
      }
      const std::size_t first = used;
      used += one->gather(parts.subspan(used));
      for (const iovec& part : parts.subspan(first, used - first)) {
        bytes += part.iov_len;
      }
    }
    // After MSG_EOR no later bytes go into the same segment; after MSG_MORE the system waits for its rest.
    return !segments ? 0 : bytes == segment_left ? MSG_EOR : MSG_MORE;
  }

  // A cookie and as many whole messages as fit; at least one.  [feat_req_someip_591] [feat_req_someip_592]
  void begin_segment() {
    int most = 0;
    socklen_t size = sizeof most;
    getsockopt(fd, IPPROTO_TCP, TCP_MAXSEG, &most, &size);
    queue.front().prepend_cookie(own);
    queued_bytes.add(header_bytes);
    segment_left = queue.front().bytes();
    for (auto one = std::next(queue.begin()); one != queue.end(); ++one) {
      if (segment_left + one->bytes() > static_cast<std::size_t>(std::max(0, most))) {
        break;
      }
      segment_left += one->bytes();
    }
  }

  void wait_writable() {
    if (waiting) {
      return;
    }
    waiting = true;
    descriptor.async_wait(
        boost::asio::posix::stream_descriptor::wait_write,
        write_memory.hold([self = shared_from_this()](const boost::system::error_code& error) {
          self->waiting = false;
          if (error || self->closed) {
            return;
          }
          self->pump();
          if (self->tls && self->tls->waits_to_send() && !self->closed && !self->taken &&
              !self->holding_back) {
            // Reading has something to send first.
            static_cast<void>(self->receive_or_end());
          }
        }));
  }

  // --- the end ---

  void close(const std::string& why) {
    if (closed) {
      return;
    }
    const auto self = shared_from_this();
    release();
    if (on_closed && !gone) {
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
    pump_if_ready();  // messages that only waited to be sent together still leave
    closed = true;
    message_timer.cancel();
    tls.reset();  // it may still send its end
    boost::system::error_code ignored;
    descriptor.close(ignored);
    queued_bytes.clear();
    const std::list<Outgoing> dropped = std::exchange(queue, {});  // their owners may call us
  }

  HandlerMemory read_memory;
  HandlerMemory write_memory;
  boost::asio::posix::stream_descriptor descriptor;
  boost::asio::steady_timer message_timer;
  /// When the message under way was first seen, and how many were complete then.
  std::optional<std::chrono::steady_clock::time_point> message_since;
  std::uint64_t message_number = 0;
  bool watching = false;  ///< message_timer is armed
  int fd;
  StreamEnd own;
  TcpOptions options;
  std::shared_ptr<CopyPool> copies;
  QueuedBytes queued_bytes;
  ReceiveMemory place;
  StreamParser parser;
  std::unique_ptr<std::byte[]> room;
  std::unique_ptr<TlsChannel> tls;  ///< none: plain TCP
  bool secured;                     ///< messages can go
  std::function<void()> on_secured;
  Endpoint local;
  MessageHandler on_message;
  CloseHandler on_closed;
  std::list<Outgoing> queue;
  std::list<Outgoing> unused;
  std::uint64_t sent_bytes = 0;  ///< to the system
  std::size_t answer_bytes = 0;  ///< bytes of answers in the queue; a partly sent message counts in full
  bool holding_back = false;     ///< nothing is read until some of these have left
  std::size_t segment_left = 0;  ///< bytes left of the present segment, if segments begin with cookies
  CookieSchedule cookies;
  Counters counters;     ///< but for those of the parser
  bool taken = false;    ///< the receive memory: nothing more is received, and the connection is closed soon
  bool pumping = false;  ///< pump() is being called
  bool waiting = false;  ///< for room to send
  bool broken = false;   ///< sending failed: about to be closed
  bool closed = false;
  bool gone = false;        ///< the TcpStream
  bool delivering = false;  ///< handlers are being called with what was received at once
  bool answered = false;    ///< one of them has sent something
};

TcpStreamCounters& TcpStreamCounters::operator+=(const TcpStreamCounters& other) noexcept {
  add_counters(*this, other);
  return *this;
}

TcpStream::TcpStream(boost::asio::io_context& io, Descriptor connected, StreamEnd own,
                     const TcpOptions& options, std::shared_ptr<CopyPool> copies)
    : state_{std::make_shared<State>(io, std::move(connected), own, options, std::move(copies))} {}

TcpStream::~TcpStream() {
  state_->gone = true;
  state_->release();
}

void TcpStream::receive(MessageHandler on_message, CloseHandler on_closed, std::function<void()> on_secured) {
  const std::shared_ptr<State> held = state_;  // a handler may destroy this
  held->on_message = std::move(on_message);
  held->on_closed = std::move(on_closed);
  held->on_secured = std::move(on_secured);
  if (held->tls) {
    held->begin_to_secure();
  } else {
    held->wait_readable();
  }
}

bool TcpStream::is_secured() const noexcept {
  return state_->secured;
}

bool TcpStream::send(const Header& header, std::span<const ByteView> payload,
                     std::shared_ptr<const void> keep_alive) {
  const std::shared_ptr<State> held = state_;  // the owner of another message may destroy this
  State& state = *held;
  if (state.closed || state.broken) {
    return false;
  }
  const std::size_t payload_bytes = size_of(payload);
  Outgoing message;
  message.payload_bytes = payload_bytes;
  if (!state.admits(payload_bytes)) {
    ++state.counters.queue_full;
    if (state.options.queue_is_full) {
      state.options.queue_is_full();
    }
    return false;
  }
  if (!encode_header(header, payload_bytes, ByteSpan{message.head}.subspan(message.head_start))) {
    return false;  // larger than the Length field can say
  }
  const bool by_segment = state.by_segment();
  if (state.options.magic_cookies && !by_segment &&
      state.cookies.before_message(std::chrono::steady_clock::now())) {
    message.prepend_cookie(state.own);
  }
  message.answer = header.type == MessageType::response || header.type == MessageType::error;
  const std::size_t bytes = message.bytes();
  // Answers to messages that came together leave together, except the first answer.
  const bool wait = state.delivering && std::exchange(state.answered, true) && bytes <= small_bytes;
  try {
    if (state.queue.empty() && state.secured && !wait && !by_segment) {
      state.send_now(message, payload, std::move(keep_alive), bytes);
    } else {
      state.enqueue(message, payload, std::move(keep_alive), bytes, 0);
      if (!wait && !state.waiting) {
        state.pump();
      }
    }
  } catch (const std::bad_alloc&) {  // half of it may have left
    ++state.counters.no_memory;
    state.close_later("there is no memory for a message that has to wait");
  }
  return !state.broken && !state.closed;
}

bool TcpStream::is_full_for(std::size_t bytes) const noexcept {
  return !state_->closed && !state_->broken && most_head_bytes + bytes <= state_->options.max_queued_bytes &&
         !state_->admits(bytes);
}

Room TcpStream::make_room(const Header& newer, const WaitRule& rule) {
  const std::shared_ptr<State> held = state_;  // the owner of what is dropped may destroy this
  return held->make_room(newer, rule);
}

void TcpStream::probe() {
  State& state = *state_;
  if (state.closed || state.broken || !state.queue.empty()) {
    return;  // what is being sent finds out as well
  }
  Outgoing message;  // only a cookie
  const auto cookie = magic_cookie(state.own);
  std::copy(cookie.begin(), cookie.end(), message.head.begin() + header_bytes);
  state.send_now(message, {}, nullptr, message.bytes());
}

const Endpoint& TcpStream::local() const noexcept {
  return state_->local;
}
bool TcpStream::idle() const noexcept {
  return state_->queue.empty();
}
TcpStream::Unread TcpStream::unread() const noexcept {
  int left = 0;
  if (ioctl(state_->fd, SIOCOUTQ, &left) != 0) {
    return {};
  }
  return {left > 0 || !state_->queue.empty(), state_->sent_bytes - static_cast<std::uint64_t>(left)};
}
void TcpStream::drop_unread() noexcept {
  const linger at_once{.l_onoff = 1, .l_linger = 0};
  setsockopt(state_->fd, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
}
TcpStream::Counters TcpStream::counters() const noexcept {
  Counters result = state_->counters;
  result.received = state_->parser.counters();
  return result;
}

}  // namespace trestle::someip
