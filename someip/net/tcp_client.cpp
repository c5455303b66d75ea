#include "someip/net/tcp_client.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cerrno>
#include <cstring>
#include <new>
#include <vector>

#include "someip/net/address_text.hpp"
#include "someip/net/addresses.hpp"
#include "someip/net/copy_pool.hpp"
#include "someip/net/socket_calls.hpp"
#include "someip/wire/counters.hpp"

namespace trestle::someip {
namespace {

/// A message that waits for the connection.
struct Waiting {
  Header header;
  std::vector<ByteView> payload;
  std::shared_ptr<const void> keep_alive;
};

/// A socket that is connected, or about to be; its error otherwise.
tl::expected<Descriptor, int> begin_to_connect(const IpAddress& local, const Endpoint& remote,
                                               const TcpOptions& options) {
  const bool v6 = remote.address.v6;
  Descriptor socket{::socket(v6 ? AF_INET6 : AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)};
  if (socket.get() < 0) {
    return tl::unexpected{errno};
  }
  set_dscp(socket.get(), options.dscp);
  set_unicast_ttl(socket.get(), options.unicast_ttl);
  const unsigned scope = v6 ? interface_of(local) : 0;
  if (const int error = bind_to(socket.get(), {local, 0}, scope); error != 0) {
    return tl::unexpected{error};
  }
  SocketAddress peer{remote, scope};
  if (connect(socket.get(), peer.data(), peer.size()) != 0 && errno != EINPROGRESS) {
    return tl::unexpected{errno};
  }
  return socket;
}

}  // namespace

struct TcpClient::State : std::enable_shared_from_this<State> {
  State(boost::asio::io_context& context, const TcpClientOptions& wanted, Handlers told)
      : io{context}, options{wanted}, handlers{std::move(told)}, connecting{io}, timer{io} {}

  void connect() {
    auto socket = begin_to_connect(options.local, options.remote, options.tcp);
    if (!socket) {
      attempt_failed(socket.error());
      return;
    }
    attempting = true;
    connecting.assign(socket->release());
    connecting.async_wait(boost::asio::posix::stream_descriptor::wait_write,
                          [weak = weak_from_this()](const boost::system::error_code& error) {
                            const auto self = weak.lock();
                            if (!error && self && self->attempting) {
                              self->connect_finished();
                            }
                          });
    after(options.connect_timeout, [](State& self) {
      if (self.attempting) {  // otherwise it ended just before the timeout
        boost::system::error_code ignored;
        self.connecting.close(ignored);
        self.attempt_failed(ETIMEDOUT);
      }
    });
  }

  void connect_finished() {
    timer.cancel();
    Descriptor socket{connecting.release()};
    int error = 0;
    socklen_t size = sizeof error;
    getsockopt(socket.get(), SOL_SOCKET, SO_ERROR, &error, &size);
    if (error != 0) {
      attempt_failed(error);
      return;
    }
    SocketAddress own;
    getsockname(socket.get(), own.data(), &own.size());
    if (own.endpoint() == options.remote) {  // TCP may connect a port to itself if nobody listens there
      attempt_failed(ECONNREFUSED);
      return;
    }
    try {
      stream = std::make_shared<TcpStream>(io, std::move(socket), StreamEnd::client, options.tcp, copies);
    } catch (const std::bad_alloc&) {
      ++counters.streams.no_memory;
      attempt_failed(ENOMEM);
      return;
    }
    const Endpoint local = own.endpoint();
    const auto held = stream;  // which a handler may release
    held->receive(
        [weak = weak_from_this()](const Message& message) {
          if (const auto self = weak.lock()) {  // also keeps it while its handler destroys the client
            self->handlers.message(message);
          }
        },
        [weak = weak_from_this()](const std::string& why) {
          if (const auto self = weak.lock()) {
            self->lost(why);
          }
        },
        [weak = weak_from_this(), local] {
          if (const auto self = weak.lock()) {
            self->ready(local);
          }
        });
    if (!options.tcp.tls) {
      ready(local);
    }
  }

  // Messages can go.
  void ready(const Endpoint& local) {
    attempting = false;
    ++counters.connections;
    since = std::chrono::steady_clock::now();
    waiting_bytes = 0;
    for (Waiting& message : std::exchange(waiting, {})) {
      stream->send(message.header, message.payload, std::move(message.keep_alive));
    }
    if (handlers.connected) {
      handlers.connected(local);
    }
  }

  void attempt_failed(int error) { attempt_failed(std::string{std::strerror(error)}); }
  void attempt_failed(const std::string& why) {
    attempting = false;
    ++counters.failed_attempts;
    again("cannot connect to TCP " + to_string(options.remote) + ": " + why);
  }

  void lost(const std::string& why) {
    counters.streams += stream->counters();
    stream.reset();
    if (attempting) {
      attempt_failed(why);
      return;
    }
    if (std::chrono::steady_clock::now() - since > options.retry_max) {
      pause = Duration::zero();
    }
    again("connection to TCP " + to_string(options.remote) + " lost: " + why);
  }

  // Tries again after a while.
  void again(const std::string& why) {
    counters.not_connected += waiting.size();
    waiting.clear();
    waiting_bytes = 0;
    pause = pause == Duration::zero() ? options.retry_min : std::min(2 * pause, options.retry_max);
    after(pause, [](State& self) { self.connect(); });
    if (handlers.disconnected) {
      handlers.disconnected(why);
    }
  }

  template <typename Step>
  void after(Duration time, Step step) {
    timer.expires_after(time);
    timer.async_wait([weak = weak_from_this(), step](const boost::system::error_code& error) {
      const auto self = weak.lock();
      if (!error && self && !self->stopped) {
        step(*self);
      }
    });
  }

  bool wait_for_connection(const Header& header, std::span<const ByteView> payload,
                           std::shared_ptr<const void> keep_alive) {
    std::size_t bytes = header_bytes;
    for (const ByteView slice : payload) {
      bytes += slice.size();
    }
    if (bytes > options.tcp.max_queued_bytes - waiting_bytes) {
      ++counters.streams.queue_full;
      return false;
    }
    waiting_bytes += bytes;
    Waiting message{header, {payload.begin(), payload.end()}, std::move(keep_alive)};
    if (!message.keep_alive) {
      auto copy = std::make_shared<std::vector<std::byte>>();
      for (const ByteView slice : payload) {
        copy->insert(copy->end(), slice.begin(), slice.end());
      }
      message.payload.assign(1, ByteView{*copy});
      message.keep_alive = std::move(copy);
    }
    waiting.push_back(std::move(message));
    return true;
  }

  boost::asio::io_context& io;
  TcpClientOptions options;
  std::shared_ptr<CopyPool> copies = std::make_shared<CopyPool>(options.tcp.max_queued_bytes, io);
  Handlers handlers;
  boost::asio::posix::stream_descriptor connecting;
  boost::asio::steady_timer timer;
  std::shared_ptr<TcpStream> stream;
  std::vector<Waiting> waiting;
  std::size_t waiting_bytes = 0;
  Duration pause{0};
  std::chrono::steady_clock::time_point since;
  bool attempting = true;
  bool stopped = false;
  Counters counters;
};

TcpClient::TcpClient(boost::asio::io_context& io, const TcpClientOptions& options, Handlers handlers)
    : state_{std::make_shared<State>(io, options, std::move(handlers))} {
  // Not called directly: the attempt may fail at once, and the caller does not expect a callback yet.
  boost::asio::post(io, [weak = std::weak_ptr{state_}] {
    const auto self = weak.lock();
    if (self && !self->stopped) {
      self->connect();
    }
  });
}

TcpClient::~TcpClient() {
  state_->stopped = true;
  state_->attempting = false;
  state_->timer.cancel();
  state_->stream.reset();
  boost::system::error_code ignored;
  state_->connecting.close(ignored);
}

bool TcpClient::send(const Header& header, std::span<const ByteView> payload,
                     std::shared_ptr<const void> keep_alive) {
  if (state_->stream && !state_->attempting) {
    return state_->stream->send(header, payload, std::move(keep_alive));
  }
  if (state_->attempting) {
    return state_->wait_for_connection(header, payload, std::move(keep_alive));
  }
  ++state_->counters.not_connected;
  return false;
}

bool TcpClient::is_full_for(std::size_t bytes) const noexcept {
  if (state_->stream && !state_->attempting) {
    return state_->stream->is_full_for(bytes);
  }
  const std::size_t all = state_->options.tcp.max_queued_bytes;
  return state_->attempting && header_bytes + bytes <= all &&
         header_bytes + bytes > all - state_->waiting_bytes;
}

void TcpClient::probe() {
  if (const auto stream = state_->stream; stream && !state_->attempting) {
    stream->probe();
  }
}

std::optional<Endpoint> TcpClient::local() const {
  return state_->stream && !state_->attempting ? std::optional{state_->stream->local()} : std::nullopt;
}
TcpClientCounters& TcpClientCounters::operator+=(const TcpClientCounters& other) noexcept {
  add_counters(*this, other);
  return *this;
}

TcpClient::Counters TcpClient::counters() const {
  Counters sum = state_->counters;
  if (state_->stream) {
    sum.streams += state_->stream->counters();
  }
  return sum;
}

}  // namespace trestle::someip
