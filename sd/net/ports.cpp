#include "sd/net/ports.hpp"

#include <algorithm>
#include <chrono>
#include <stdexcept>

#include "sd/net/clock.hpp"
#include "someip/net/tls_channel.hpp"
#include "someip/wire/counters.hpp"

namespace trestle::someip {

// OpenSSL takes 2 MB of each process that loads it. So the linker is not asked for this here, but by those
// who ask has_tls(), which stands beside it.
[[gnu::weak]] std::shared_ptr<const TlsContext> make_tls_context(const TlsSettings& settings);

}  // namespace trestle::someip

namespace trestle::sd {

using someip::add_counters;

namespace {

// Longer than it takes a client to learn that the service is gone and to close its connection.
constexpr Duration leaving_time = std::chrono::seconds{3};

// A few messages of this size fill any send buffer that is smaller than requested.
constexpr std::size_t large_message = std::size_t{1} << 20U;

std::shared_ptr<const someip::TlsContext> tls_of(const NodeConfig& config) {
  if (!config.tls) {
    return nullptr;
  }
  if (someip::make_tls_context == nullptr) {
    throw std::invalid_argument{"tls: this program has to ask someip::has_tls() before: that links OpenSSL"};
  }
  try {
    return someip::make_tls_context(*config.tls);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument{std::string{"tls: "} + error.what()};
  }
}

/// The port that exists and fits; removes those that are gone.
template <typename Port, typename Fits>
std::shared_ptr<Port> find_port(std::vector<std::weak_ptr<Port>>& ports, Fits fits) {
  std::erase_if(ports, [](const auto& weak) { return weak.expired(); });
  for (const auto& weak : ports) {
    if (auto port = weak.lock(); port && fits(*port)) {
      return port;
    }
  }
  return nullptr;
}

/// Calls `visit` for each that is open.
template <typename Port, typename Visit>
void for_each(const std::vector<std::weak_ptr<Port>>& ports, Visit visit) {
  for (const auto& weak : ports) {
    if (const auto port = weak.lock()) {
      visit(*port);
    }
  }
}

void add(someip::TpCounters& sum, const LargeMessages& one) {
  for (const auto* large : {one.requests.get(), one.expected.get()}) {
    if (large != nullptr) {
      add_counters(sum, large->counters());
    }
  }
}

}  // namespace

someip::UdpOptions udp_options(const NodeConfig& config, const Endpoint& local) {
  return {.local = local,
          .interface = {{config.address, config.multicast_interface}},
          .multicast_ttl = config.multicast_ttl,
          .unicast_ttl = config.unicast_ttl,
          .dscp = config.dscp,
          .receive_buffer_bytes = config.receive_buffer_bytes,
          .send_buffer_bytes = config.send_buffer_bytes,
          .busy_poll = std::chrono::ceil<std::chrono::microseconds>(config.busy_poll)};
}

Ports::Ports(boost::asio::io_context& io, const NodeConfig& config, NodeCounters& counters,
             AccessGuard& access, Handlers handlers)
    : io_{io},
      config_{config},
      counters_{counters},
      access_{access},
      handlers_{std::move(handlers)},
      tls_{tls_of(config)},
      receive_budget_{std::make_shared<someip::ReceiveBudget>(
          std::max(config.max_tcp_receive_bytes, config.max_message_bytes + someip::header_bytes))},
      send_budget_{std::make_shared<someip::SendBudget>(
          std::max(config.max_tcp_queued_bytes, config.max_queued_bytes))},
      // The last chunk of a message counts in full, hence the extra room.
      reassembly_budget_{std::make_shared<someip::ReassemblyBudget>(
          std::max(config.max_udp_receive_bytes, 2 * config.max_message_bytes + (std::size_t{64} << 10U)))},
      reassembly_timer_{io, [this] { on_reassembly_time(); }} {}

std::shared_ptr<UdpPort> Ports::udp(std::uint16_t number, const std::function<bool(const UdpPort&)>& usable) {
  auto port = find_port(udp_, [&](const UdpPort& one) { return one.number == number && usable(one); });
  if (!port) {
    port = share(std::make_unique<UdpPort>(io_, number, udp_options(config_, {config_.address, number}),
                                           config_.max_queued_bytes, config_.collect_for));
    port->sender.tell_full([this](const Endpoint& to) { handlers_.queue_full(&to); });
    udp_.push_back(port);
    port->socket.receive_trains([this, weak = udp_.back()](const someip::Train& train) {
      if (auto alive = weak.lock()) {  // also keeps it during the call
        LargeMessages& large = alive->large;
        on_train(train, {.from = train.peer, .udp = std::move(alive), .tcp = nullptr}, large, weak);
      }
    });
    if (const int granted = port->socket.send_buffer_bytes(); granted < config_.send_buffer_bytes) {
      port->sender.tell_large(std::min(static_cast<std::size_t>(granted) / 2, large_message),
                              [this, granted] { handlers_.send_buffer_is_small(granted); });
    }
    const auto unreachable = [this, weak = udp_.back()](const Endpoint& receiver) {
      if (const auto alive = weak.lock()) {
        handlers_.unreachable(receiver);
      }
    };
    port->socket.report_unreachable(unreachable);
    port->sender.watch_link(
        {.answer_of = handlers_.answer_of, .entry_of = handlers_.entry_of, .unreachable = unreachable});
    if (config_.discovery.tell_receive_buffer) {
      port->sender.ask_for_room(local_room_);
    }
  }
  return port;
}

std::shared_ptr<TcpPort> Ports::tcp(std::uint16_t number, const std::function<bool(const TcpPort&)>& usable) {
  auto port = find_port(tcp_, [&](const TcpPort& one) { return one.number == number && usable(one); });
  if (!port) {
    port = share(std::make_unique<TcpPort>(
        io_, number,
        someip::TcpServerOptions{.local = {config_.address, number},
                                 .max_connections = config_.max_tcp_clients,
                                 .max_connections_per_address = config_.max_tcp_clients_per_address,
                                 .idle_timeout = config_.tcp_idle_timeout,
                                 .unanswered_timeout = config_.tcp_unanswered_timeout,
                                 .accepts = [this](const IpAddress& from) { return access_.accepts(from); },
                                 .tcp = tcp_options()}));
    tcp_.push_back(port);
    const Endpoint own = port->server.local();
    port->server.start(
        {.message =
             [this, weak = tcp_.back()](const someip::Message& message, const Endpoint& from) {
               if (auto alive = weak.lock()) {
                 handlers_.message(message, {from, Transport::tcp, nullptr, std::move(alive)});
               }
             },
         .connected = [this, own](const Endpoint& client) { handlers_.tcp_client(own, client, true); },
         .closed =
             [this, own](const Endpoint& client, const std::string& why) {
               handlers_.tcp_client(own, client, false);
               if (why == someip::no_memory_for_a_message) {
                 handlers_.tcp_refused(client, why);
               }
             },
         .in_use = [this, own](const Endpoint& client) { return handlers_.tcp_needed(own, client); },
         .refused = [this](const Endpoint& client,
                           const std::string& why) { handlers_.tcp_refused(client, why); }});
  }
  return port;
}

std::shared_ptr<GroupPort> Ports::group(const Endpoint& endpoint) {
  auto port = find_port(groups_, [&](const GroupPort& one) { return one.group == endpoint; });
  if (!port) {
    someip::UdpOptions options = udp_options(config_, endpoint);
    options.join = endpoint.address;
    options.sharing = someip::PortSharing::shared;
    port = share(std::make_unique<GroupPort>(io_, endpoint, options));
    groups_.push_back(port);
    port->socket.receive_trains([this, weak = groups_.back()](const someip::Train& train) {
      if (const auto alive = weak.lock()) {
        on_train(train, {.from = train.peer, .udp = nullptr, .tcp = nullptr}, alive->large, weak);
      }
    });
  }
  return port;
}

std::unique_ptr<someip::TcpClient> Ports::connect(const Endpoint& remote,
                                                  someip::TcpClient::Handlers handlers) {
  handlers.message = [this, remote](const someip::Message& message) {
    handlers_.message(message, {remote, Transport::tcp, nullptr, nullptr});
  };
  return std::make_unique<someip::TcpClient>(
      io_,
      someip::TcpClientOptions{.local = config_.address,
                               .remote = remote,
                               .tcp = tcp_options(),
                               .connect_timeout = config_.tcp_connect_timeout,
                               .retry_min = config_.tcp_retry_min,
                               .retry_max = config_.tcp_retry_max},
      std::move(handlers));
}

void Ports::leave(std::shared_ptr<TcpPort> port) {
  if (!port || port->server.counters().open == 0) {
    return;
  }
  const auto place = leaving_.emplace(leaving_.end(), std::piecewise_construct,
                                      std::forward_as_tuple(io_,
                                                            [this, which = port.get()] {
                                                              leaving_.remove_if([which](const auto& one) {
                                                                return one.second.get() == which;
                                                              });
                                                            }),
                                      std::forward_as_tuple(port));
  place->first.arm(now() + leaving_time);
}

void Ports::accept_waiting() {
  for_each(tcp_, [](TcpPort& port) { port.server.accept_waiting(); });
}

void Ports::disconnect(const Endpoint& own, const Endpoint& client, const std::string& why) {
  if (const auto port = find_port(tcp_, [&](const TcpPort& one) { return one.server.local() == own; })) {
    port->server.disconnect(client, why);
  }
}

bool Ports::make_room(const Endpoint& own, const Endpoint& client) {
  std::vector<someip::TcpPlace> places;
  for_each(tcp_, [&](TcpPort& port) { port.server.add_places(places); });
  std::erase_if(places, [&](const auto& one) { return one.own == own && one.client == client; });
  const auto others = static_cast<std::size_t>(
      std::ranges::count_if(places, [&](const auto& one) { return one.client.address == client.address; }));
  const auto worst = someip::who_gives_way(places, others, [this](const someip::TcpPlace& one) {
    return handlers_.tcp_needed(one.own, one.client);
  });
  if (!worst) {
    return false;
  }
  const auto port = find_port(tcp_, [&](const TcpPort& one) { return one.server.local() == worst->own; });
  port->server.give_way(worst->client);
  return true;
}

void Ports::on_train(const someip::Train& train, const Source& source, LargeMessages& large,
                     const std::weak_ptr<const void>& port) {
  if (!access_.hears(train.peer.address)) {
    return;
  }
  const TimePoint time = now();
  // The header of the last segment; the next one most likely belongs to the same message.
  someip::Header wanted;
  someip::Reassembly* known = nullptr;  ///< where that message is reassembled
  std::size_t max_bytes = 0;            ///< of it
  for (std::size_t i = 0; i < train.size(); ++i) {
    if (i > 0 && port.use_count() == 1) {
      return;  // a handler has released it, only we still hold it
    }
    const ByteView datagram = train[i];
    ++counters_.datagrams;
    someip::MessageCursor cursor{datagram};
    while (const auto message = cursor.next()) {
      if (!someip::is_tp(message->header.type)) {
        handlers_.message(*message, source);
        known = nullptr;
        continue;
      }
      if (known == nullptr || message->header != wanted) {
        known = nullptr;
        max_bytes = handlers_.wanted(*message, source);
        if (max_bytes == 0) {
          continue;
        }
        known = &reassembly_of(message->header.type, large);
        wanted = message->header;
      }
      const auto whole = known->on_segment(source.from, *message, time, max_bytes);
      // A timer that is already armed fires before any message that begins now is too old.
      if (!reassembly_timer_.armed()) {
        reassembly_timer_.arm(known->deadline());
      }
      if (whole && *whole) {
        handlers_.message({(*whole)->header, (*whole)->payload}, source);
        known = nullptr;
      }
    }
    if (cursor.error() || datagram.empty()) {
      ++counters_.malformed;
    }
  }
  if (port.use_count() > 1 && (large.requests || large.expected)) {
    tell_losses(large, source.from);
  }
}

void Ports::tell_losses(LargeMessages& large, const Endpoint& from) {
  using enum someip::TpDrop;
  const auto count = [&large](someip::TpDrop reason) {
    return (large.requests ? large.requests->counters()[reason] : 0) +
           (large.expected ? large.expected->counters()[reason] : 0);
  };
  const std::uint64_t no_place = count(no_slot);
  const std::uint64_t no_share = count(too_many_from_sender);
  const std::uint64_t slow = count(gave_way);
  const std::uint64_t too_much = count(no_memory);
  const std::uint64_t lost = no_place + no_share + slow + too_much;
  if (lost == large.lost) {
    return;
  }
  large.lost = lost;
  std::string what;
  const auto add = [&what](std::uint64_t times, const char* words, const char* limit, std::size_t is) {
    if (times != 0) {
      what += (what.empty() ? "" : "; ") + std::to_string(times) + words + limit + " (" + std::to_string(is) +
              ")";
    }
  };
  add(slow, " gave way to others: raise ", "max_reassemblies", config_.max_reassemblies);
  if (slow != 0) {
    what += " or max_reassemblies_per_sender (" + std::to_string(config_.max_reassemblies_per_sender) + ")";
  }
  add(no_place, " segments found no place: raise ", "max_reassemblies", config_.max_reassemblies);
  add(no_share, " segments were more than a sender's share: raise ", "max_reassemblies_per_sender",
      config_.max_reassemblies_per_sender);
  add(too_much, " had no memory: raise ", "max_udp_receive_bytes", config_.max_udp_receive_bytes);
  handlers_.large_lost(from, what);
}

someip::Reassembly& Ports::reassembly_of(someip::MessageType type, LargeMessages& large) {
  const someip::MessageType whole = someip::without_tp(type);
  const bool expected = whole == someip::MessageType::notification ||
                        whole == someip::MessageType::response || whole == someip::MessageType::error;
  auto& reassembly = expected ? large.expected : large.requests;
  if (!reassembly) {
    reassembly = std::make_unique<someip::Reassembly>(
        config_.max_reassemblies,
        someip::TpReassemblyLimits{.max_message_bytes = config_.max_message_bytes,
                                   .max_per_sender = config_.max_reassemblies_per_sender,
                                   .max_age = config_.reassembly_timeout,
                                   .protected_bytes_per_s = config_.reassembly_protected_rate},
        reassembly_budget_);
  }
  return *reassembly;
}

void Ports::forget_large(const IpAddress& sender) {
  const auto visit = [&](const auto& port) {
    for (someip::Reassembly* const one : {port.large.requests.get(), port.large.expected.get()}) {
      if (one != nullptr) {
        one->forget(sender, now());
      }
    }
  };
  for_each(udp_, visit);
  for_each(groups_, visit);
}

void Ports::on_reassembly_time() {
  const TimePoint time = now();
  std::optional<TimePoint> next;
  const auto visit = [&](const auto& port) {
    for (someip::Reassembly* const one : {port.large.requests.get(), port.large.expected.get()}) {
      if (one == nullptr) {
        continue;
      }
      one->on_time(time);
      if (const auto due = one->deadline()) {
        next = next ? earlier(*next, *due) : *due;
      }
    }
  };
  for_each(udp_, visit);
  for_each(groups_, visit);
  reassembly_timer_.arm(next);
}

someip::TcpOptions Ports::tcp_options() const {
  return {.max_message_bytes = config_.max_message_bytes,
          .receive_budget = receive_budget_,
          .max_queued_bytes = config_.max_queued_bytes,
          .send_budget = send_budget_,
          .max_unread_answer_bytes = config_.max_unread_answer_bytes,
          .dead_after = config_.tcp_dead_after,
          .message_timeout = config_.tcp_message_timeout,
          .magic_cookies = config_.magic_cookies,
          .cookie_in_each_segment = config_.cookie_in_each_segment,
          .receive_buffer_bytes = config_.tcp_receive_buffer_bytes,
          .send_buffer_bytes = config_.tcp_send_buffer_bytes,
          .dscp = config_.dscp,
          .unicast_ttl = config_.unicast_ttl,
          .tls = tls_,
          .queue_is_full = [this] { handlers_.queue_full(nullptr); }};
}

void Ports::follow_interface() {
  const auto follow = [](auto& port) { port.socket.follow_interface(); };
  for_each(udp_, follow);
  for_each(groups_, follow);
}

void Ports::flush() {
  for_each(udp_, [](UdpPort& port) { port.sender.flush(); });
}

template <typename Port>
std::shared_ptr<Port> Ports::share(std::unique_ptr<Port> port) {
  return {port.release(), [this](Port* last) {
            const std::unique_ptr<Port> end{last};
            keep_counters(*end);
          }};
}

void Ports::keep_counters(UdpPort& last) {
  last.sender.close();
  add_counters(past_sent_, last.sender.counters());
  add(past_reassembly_, last.large);
  past_overflows_ += last.socket.receive_overflows();
  past_unreachable_ignored_ += last.socket.unreachable_ignored();
}

void Ports::keep_counters(GroupPort& last) {
  add(past_reassembly_, last.large);
  past_overflows_ += last.socket.receive_overflows();
}

void Ports::keep_counters(TcpPort& last) {
  add_counters(past_tcp_, last.server.counters());
  past_tcp_.open = 0;
}

someip::TpCounters Ports::reassembly_counters() const {
  someip::TpCounters sum = past_reassembly_;
  for_each(udp_, [&](const UdpPort& port) { add(sum, port.large); });
  for_each(groups_, [&](const GroupPort& port) { add(sum, port.large); });
  return sum;
}

someip::MessageSender::Counters Ports::sender_counters() const {
  someip::MessageSender::Counters sum = past_sent_;
  for_each(udp_, [&](const UdpPort& port) { add_counters(sum, port.sender.counters()); });
  return sum;
}

someip::TcpServer::Counters Ports::tcp_counters() const {
  someip::TcpServer::Counters sum = past_tcp_;
  for_each(tcp_, [&](const TcpPort& port) { add_counters(sum, port.server.counters()); });
  return sum;
}

std::uint64_t Ports::overflows() const {
  std::uint64_t sum = past_overflows_;
  for_each(udp_, [&](const UdpPort& port) { sum += port.socket.receive_overflows(); });
  for_each(groups_, [&](const GroupPort& port) { sum += port.socket.receive_overflows(); });
  return sum;
}

std::uint64_t Ports::unreachable_ignored() const {
  std::uint64_t sum = past_unreachable_ignored_;
  for_each(udp_, [&](const UdpPort& port) { sum += port.socket.unreachable_ignored(); });
  return sum;
}

}  // namespace trestle::sd
