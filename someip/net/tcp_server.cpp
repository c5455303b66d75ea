#include "someip/net/tcp_server.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cerrno>
#include <deque>
#include <map>
#include <new>
#include <optional>
#include <system_error>
#include <vector>

#include "someip/net/addresses.hpp"
#include "someip/net/copy_pool.hpp"
#include "someip/net/socket_calls.hpp"

namespace trestle::someip {
namespace {

constexpr int backlog = 64;
// Who was silent for so long may have to give way.
constexpr auto time_to_speak = std::chrono::milliseconds{1000};
// So may who read nothing for so long of what waits for it. It takes no place from others for a while.
constexpr auto time_to_read = std::chrono::milliseconds{1000};
constexpr auto time_to_wait = std::chrono::seconds{10};
constexpr std::size_t max_not_reading = 256;  // addresses that are remembered
constexpr const char* for_another = "it gave way to another one";
constexpr const char* as_unread = "it did not read what was sent to it, and gave way to another one";
constexpr auto pause_after_error = std::chrono::milliseconds{100};  // until the next attempt to accept

int listen_at(const Endpoint& local, const TcpOptions& options) {
  const bool v6 = local.address.v6;
  Descriptor socket{::socket(v6 ? AF_INET6 : AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)};
  if (socket.get() < 0) {
    fail(Transport::tcp, local, "open a socket", errno);
  }
  if (v6) {
    set_option(socket.get(), IPPROTO_IPV6, IPV6_V6ONLY, 1);
  }
  // Past connections may still linger in TIME_WAIT; a second listener is refused all the same.
  set_option(socket.get(), SOL_SOCKET, SO_REUSEADDR, 1);
  // Connections inherit these options.
  set_dscp(socket.get(), options.dscp);
  set_unicast_ttl(socket.get(), options.unicast_ttl);
  if (const int error = bind_to(socket.get(), local, v6 ? interface_of(local.address) : 0); error != 0) {
    fail(Transport::tcp, local, "bind", error);
  }
  if (listen(socket.get(), backlog) != 0) {
    fail(Transport::tcp, local, "listen", errno);
  }
  return socket.release();
}

}  // namespace

struct TcpServer::State : std::enable_shared_from_this<State> {
  using Clock = std::chrono::steady_clock;

  struct Client {
    std::shared_ptr<TcpStream> stream;
    Clock::time_point since = Clock::now();
    Clock::time_point last = since;  ///< when something was first seen to have changed
    std::uint64_t messages = 0;      ///< that had gone either way by then
    std::size_t unanswered = 0;      ///< requests
    TcpStream::Unread waiting = {};  ///< for the client, when that was seen last
    Clock::time_point read = since;  ///< when it was last seen to take something, or nothing waited

    void look(Clock::time_point now) {
      const TcpStream::Unread seen = stream->unread();
      if (!seen.some || !waiting.some || seen.taken != waiting.taken) {
        read = now;
      }
      waiting = seen;
      const auto counted = stream->counters();
      const auto all = counted.received.messages + counted.received.cookies + counted.messages_sent;
      if (all != messages) {
        messages = all;
        last = now;
      }
    }
    /// Whether nothing has gone over it lately, and nothing is known to come.
    [[nodiscard]] bool silent(Clock::time_point now) const {
      return unanswered == 0 && now - last >= time_to_speak;
    }
    /// Whether it takes nothing of what waits for it.
    [[nodiscard]] bool unread(Clock::time_point now) const { return now - read >= time_to_read; }
  };

  State(boost::asio::io_context& context, const TcpServerOptions& wanted)
      : io{context},
        options{wanted},
        listener{io, listen_at(options.local, options.tcp)},
        retry{io},
        idle_timer{io},
        full_timer{io} {
    SocketAddress own;
    getsockname(listener.native_handle(), own.data(), &own.size());
    local = own.endpoint();
  }

  void wait_for_client() {
    listener.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                        [weak = weak_from_this()](const boost::system::error_code& error) {
                          const auto self = weak.lock();
                          if (!error && self) {
                            self->accept_all();
                          }
                        });
  }

  void accept_all() {
    if (const int error = accept_waiting(); error != 0) {
      accept_later(error);
    } else if (!stopped) {
      wait_for_client();
    }
  }

  // Returns what keeps it from accepting more, or 0.
  int accept_waiting() {
    for (int round = 0; round < backlog && !stopped; ++round) {
      SocketAddress from;
      Descriptor client{
          accept4(listener.native_handle(), from.data(), &from.size(), SOCK_NONBLOCK | SOCK_CLOEXEC)};
      if (client.get() >= 0) {
        accept(std::move(client), from.endpoint());
      } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
        break;
      } else if (errno != ECONNABORTED && errno != EINTR) {
        return errno;
      }
    }
    return 0;
  }

  // The client is still there, so waiting for the socket would return at once.
  void accept_later(int why) {
    ++counters.not_accepted;
    retry.expires_after(pause_after_error);
    retry.async_wait([weak = weak_from_this()](const boost::system::error_code& error) {
      const auto self = weak.lock();
      if (!error && self) {
        self->accept_all();
      }
    });
    try {
      if (handlers.refused) {
        handlers.refused({}, why == EMFILE || why == ENFILE ? "no file descriptor is free (ulimit -n)"
                                                            : std::generic_category().message(why));
      }
    } catch (const std::bad_alloc&) {
      ++counters.streams.no_memory;
    }
  }

  // When memory runs out, also in a handler, this client loses its connection and the others stay.
  void accept(Descriptor client, const Endpoint& from) {
    try {
      accept_one(std::move(client), from);
      return;
    } catch (const std::bad_alloc&) {
      ++counters.streams.no_memory;
    }
    try {
      if (!stopped && clients.contains(from)) {
        closed(from, no_memory_for_a_message);
      }
    } catch (const std::bad_alloc&) {  // the handler has no memory either
      clients.erase(from);
    }
  }

  void accept_one(Descriptor client, const Endpoint& from) {
    if (options.accepts && !options.accepts(from.address)) {
      return;
    }
    if (clients.contains(from)) {  // the end of the old connection was not seen
      closed(from, "the client connected anew");
      if (stopped) {
        return;  // its handler has destroyed the server
      }
    }
    if (!make_room(from)) {
      return;
    }
    const auto stream =
        std::make_shared<TcpStream>(io, std::move(client), StreamEnd::server, options.tcp, copies);
    clients.emplace(from, Client{stream});
    ++counters.accepted;
    watch_idle();
    watch_full();
    stream->receive(
        [weak = weak_from_this(), from](const Message& message) {
          if (const auto self = weak.lock()) {  // also keeps it while its handler destroys the server
            self->handlers.message(message, from);
          }
        },
        [weak = weak_from_this(), from](const std::string& why) {
          if (const auto self = weak.lock()) {
            self->closed(from, why);
          }
        },
        [weak = weak_from_this(), from] {
          if (const auto self = weak.lock()) {
            self->ready(from);
          }
        });
    if (!options.tcp.tls) {
      ready(from);
    }
  }

  void ready(const Endpoint& client) {
    if (handlers.connected) {
      handlers.connected(client);
    }
  }

  [[nodiscard]] std::size_t connections_of(const IpAddress& address) const {
    return static_cast<std::size_t>(
        std::ranges::count_if(clients, [&](const auto& one) { return one.first.address == address; }));
  }

  // Makes room for one more connection of this client, or reports why there is none.
  bool make_room(const Endpoint& from) {
    const std::size_t own = connections_of(from.address);
    if (own >= options.max_connections_per_address) {
      refuse(from, "its address has all that one may have (max_tcp_clients_per_address)");
      return false;
    }
    if (clients.size() < options.max_connections) {
      return true;
    }
    if (has_not_read(from.address)) {
      refuse(from, "all are taken (max_tcp_clients), and it did not read what was sent to it before");
      return false;
    }
    std::vector<TcpPlace> places;
    add_places(places);
    const auto worst = who_gives_way(
        places, own, [this](const TcpPlace& one) { return handlers.in_use && handlers.in_use(one.client); });
    if (!worst) {
      refuse(from, "all are taken (max_tcp_clients)");
      return false;
    }
    give_way(worst->client);
    return !stopped;
  }

  void give_way(const Endpoint& from) {
    Client& client = clients.find(from)->second;
    const auto now = Clock::now();
    const bool unread = client.unread(now);
    ++counters.gave_way;
    if (unread) {
      ++counters.unread;
      client.stream->drop_unread();
      if (not_reading.size() == max_not_reading) {
        not_reading.pop_front();
      }
      not_reading.emplace_back(from.address, now + time_to_wait);
    }
    closed(from, unread ? as_unread : for_another);
  }

  [[nodiscard]] bool has_not_read(const IpAddress& address) {
    while (!not_reading.empty() && not_reading.front().second <= Clock::now()) {
      not_reading.pop_front();
    }
    return std::ranges::find(not_reading, address, [](const auto& one) { return one.first; }) !=
           not_reading.end();
  }

  void refuse(const Endpoint& from, const char* why) {
    ++counters.refused;
    if (handlers.refused) {
      handlers.refused(from, why);
    }
  }

  void add_places(std::vector<TcpPlace>& places) {
    const auto now = Clock::now();
    for (auto& [endpoint, client] : clients) {
      client.look(now);
      places.push_back({.own = local,
                        .client = endpoint,
                        .spoke = client.messages != 0,
                        .silent = client.silent(now),
                        .unread = client.unread(now),
                        .last = client.last});
    }
  }

  // While all places are taken, looks who is silent or does not read. So that is known when somebody comes.
  void watch_full() {
    if (clients.size() < options.max_connections || full_timer_runs) {
      return;
    }
    full_timer.expires_after(time_to_speak / 2);
    full_timer.async_wait([weak = weak_from_this()](const boost::system::error_code& error) {
      const auto self = weak.lock();
      if (error || !self || self->stopped) {
        return;
      }
      self->full_timer_runs = false;
      for (auto& [endpoint, client] : self->clients) {
        client.look(Clock::now());
      }
      try {
        self->watch_full();
      } catch (const std::bad_alloc&) {  // it is found out later who is silent
        ++self->counters.streams.no_memory;
      }
    });
    full_timer_runs = true;
  }

  void watch_idle() {
    if (options.idle_timeout == Duration::zero() || std::exchange(watching, true)) {
      return;
    }
    idle_timer.expires_after(std::max<Duration>(options.idle_timeout / 4, std::chrono::milliseconds{1}));
    idle_timer.async_wait([weak = weak_from_this()](const boost::system::error_code& error) {
      const auto self = weak.lock();
      if (!error && self && !self->stopped) {
        try {
          self->close_idle();
        } catch (const std::bad_alloc&) {  // later, when there may be memory
          ++self->counters.streams.no_memory;
          self->watch_idle();
        }
      }
    });
  }

  void close_idle() {
    watching = false;
    const auto now = Clock::now();
    std::vector<Endpoint> idle;
    for (auto& [endpoint, client] : clients) {
      client.look(now);
      const Duration limit = client.unanswered == 0
                                 ? options.idle_timeout
                                 : std::max(options.idle_timeout, options.unanswered_timeout);
      if (now - client.last >= limit && !(handlers.in_use && handlers.in_use(endpoint))) {
        idle.push_back(endpoint);
      }
    }
    for (const Endpoint& one : idle) {
      if (!stopped && clients.contains(one)) {
        ++counters.idle;
        closed(one, "it was idle");
      }
    }
    if (!stopped && !clients.empty()) {
      watch_idle();
    }
  }

  void closed(const Endpoint& client, const std::string& why) {
    const auto found = clients.find(client);
    const TcpStream::Counters last = found->second.stream->counters();
    counters.streams += last;
    counters.bad_framing += last.received.bad_length + last.received.too_large != 0 ? 1 : 0;
    const bool was_ready = found->second.stream->is_secured();
    clients.erase(found);
    if (!was_ready) {  // nobody has been told of it
      if (handlers.refused) {
        handlers.refused(client, why);
      }
    } else if (handlers.closed) {
      handlers.closed(client, why);
    }
  }

  boost::asio::io_context& io;
  TcpServerOptions options;
  std::shared_ptr<CopyPool> copies = std::make_shared<CopyPool>(options.tcp.max_queued_bytes, io);
  boost::asio::posix::stream_descriptor listener;
  boost::asio::steady_timer retry;
  boost::asio::steady_timer idle_timer;
  bool watching = false;  ///< idle_timer is armed
  boost::asio::steady_timer full_timer;
  bool full_timer_runs = false;
  Endpoint local;
  Handlers handlers;
  std::map<Endpoint, Client> clients;
  std::deque<std::pair<IpAddress, Clock::time_point>> not_reading;  ///< and until when that counts
  Counters counters;
  bool stopped = false;
};

TcpServer::TcpServer(boost::asio::io_context& io, const TcpServerOptions& options)
    : state_{std::make_shared<State>(io, options)} {}

TcpServer::~TcpServer() {
  state_->stopped = true;
  state_->retry.cancel();
  state_->idle_timer.cancel();
  state_->full_timer.cancel();
  state_->clients.clear();
  boost::system::error_code ignored;
  state_->listener.close(ignored);
}

void TcpServer::start(Handlers handlers) {
  state_->handlers = std::move(handlers);
  state_->wait_for_client();
}

void TcpServer::accept_waiting() {
  const std::shared_ptr<State> state = state_;  // a handler may destroy this
  state->accept_waiting();                      // an error comes again where it is told, in accept_all()
}

bool TcpServer::send(const Endpoint& to, const Header& header, std::span<const ByteView> payload,
                     std::shared_ptr<const void> keep_alive) {
  const auto client = state_->clients.find(to);
  return client != state_->clients.end() &&
         client->second.stream->send(header, payload, std::move(keep_alive));
}

bool TcpServer::is_full_for(const Endpoint& to, std::size_t bytes) const {
  const auto client = state_->clients.find(to);
  return client != state_->clients.end() && client->second.stream->is_full_for(bytes);
}

Room TcpServer::make_room(const Endpoint& to, const Header& newer, const WaitRule& rule) {
  const auto client = state_->clients.find(to);
  return client == state_->clients.end() ? Room{} : client->second.stream->make_room(newer, rule);
}

void TcpServer::await_answer(const Endpoint& client) {
  if (const auto found = state_->clients.find(client); found != state_->clients.end()) {
    ++found->second.unanswered;
  }
}

void TcpServer::answered(const Endpoint& client) {
  const auto found = state_->clients.find(client);
  if (found != state_->clients.end() && found->second.unanswered > 0) {
    --found->second.unanswered;
  }
}

void TcpServer::disconnect(const Endpoint& client, const std::string& why) {
  const std::shared_ptr<State> state = state_;  // the handler may destroy this
  if (state->clients.contains(client)) {
    state->closed(client, why);
  }
}

void TcpServer::give_way(const Endpoint& client) {
  const std::shared_ptr<State> state = state_;  // the handler may destroy this
  if (state->clients.contains(client)) {
    state->give_way(client);
  }
}

void TcpServer::add_places(std::vector<TcpPlace>& places) {
  state_->add_places(places);
}

const Endpoint& TcpServer::local() const noexcept {
  return state_->local;
}
bool TcpServer::connected(const Endpoint& client) const {
  return state_->clients.contains(client);
}
TcpServer::Counters TcpServer::counters() const {
  Counters sum = state_->counters;
  sum.open = state_->clients.size();
  for (const auto& [endpoint, client] : state_->clients) {
    sum.streams += client.stream->counters();
  }
  return sum;
}

}  // namespace trestle::someip
