#include "sd/net/node.hpp"

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <chrono>
#include <optional>
#include <random>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "sd/net/access_guard.hpp"
#include "sd/net/checks.hpp"
#include "sd/net/clock.hpp"
#include "sd/net/consumer.hpp"
#include "sd/net/discovery_sender.hpp"
#include "sd/net/discovery_text.hpp"
#include "sd/net/heap_storage.hpp"
#include "sd/net/link_watch.hpp"
#include "sd/net/provider.hpp"
#include "sd/net/rare_line.hpp"
#include "sd/net/room_watch.hpp"
#include "sd/net/shielded.hpp"
#include "sd/net/withheld_services.hpp"
#include "someip/net/address_text.hpp"
#include "someip/net/addresses.hpp"
#include "someip/net/neighbours.hpp"

namespace trestle::sd {
namespace {

using someip::Header;
using someip::Message;
using someip::MessageType;

std::uint64_t random_seed() {
  std::random_device device;
  return (std::uint64_t{device()} << 32U) | device();
}

Settings discovery_settings(const NodeConfig& config, const std::span<const ForeignEndpoints>& foreign) {
  Settings settings;
  static_cast<DiscoveryRules&>(settings) = config.discovery;
  if (!foreign.empty()) {
    settings.foreign_endpoints = &foreign;
  }
  if (config.check_subnet && !settings.subnet_prefix_bits) {
    settings.subnet_prefix_bits = someip::subnet_prefix_bits(config.address);
  }
  settings.refuse_loopback = settings.refuse_loopback && config.check_subnet;
  settings.unicast = {config.address, config.port};
  settings.multicast = {config.multicast, config.port};
  settings.timing = config.timing;
  settings.seed = random_seed();
  return settings;
}

/// Whether it holds a Subscribe Eventgroup entry.
bool subscribes(ByteView datagram) {
  const auto message = someip::decode(datagram);
  const auto sd = message ? decode(*message) : tl::unexpected{WireFault{}};
  for (std::size_t i = 0; sd && i < sd->entry_count(); ++i) {
    if (sd->entry(i).kind() == EntryKind::subscribe_eventgroup) {
      return true;
    }
  }
  return false;
}

/// What a datagram subscribes to, for a line of the log: " to eventgroup 0x0002 of 0x1234.0x0001". Discovery
/// does not tell which of several it has refused, so that all of them are named.
std::string subscribed_text(ByteView datagram) {
  constexpr std::size_t most = 4;
  const auto message = someip::decode(datagram);
  const auto sd = message ? decode(*message) : tl::unexpected{WireFault{}};
  std::size_t count = 0;
  std::string text;
  for (std::size_t i = 0; sd && i < sd->entry_count(); ++i) {
    const Entry entry = sd->entry(i);
    if (entry.kind() == EntryKind::subscribe_eventgroup && ++count <= most) {
      text += (count == 1 ? "" : " or ") + ("eventgroup " + hexadecimal(value(entry.eventgroup()))) + " of " +
              to_string(entry.service, entry.instance);
    }
  }
  text += count > most ? " or " + std::to_string(count - most) + " more" : "";
  return text.empty() ? text : " to " + text;
}

someip::UdpOptions sd_socket(const NodeConfig& config, const IpAddress& at, someip::PortSharing sharing) {
  someip::UdpOptions options = udp_options(config, {at, config.port});
  if (at == config.multicast) {
    options.join = at;
    options.source = config.address;
  }
  options.sharing = sharing;
  // A flood of Subscribes, each of which is much work, must not hold up what is sent meanwhile.
  options.batches_in_a_row = 4;
  return options;
}

}  // namespace

struct Node::State : std::enable_shared_from_this<State> {
  State(boost::asio::io_context& context, const NodeConfig& settings, DiscoveryLog logger,
        DiscoveryLog warner)
      : io{context},
        config{settings},
        log{logger ? std::move(logger) : [](const std::string&) {}},
        warn{warner ? std::move(warner) : log},
        unicast{io, sd_socket(config, config.address, someip::PortSharing::by_address)},
        multicast{io, sd_socket(config, config.multicast, someip::PortSharing::shared)},
        storage{config.limits},
        discovery{discovery_settings(config, foreign_endpoints), storage.view()},
        access{config, counters, warn},
        ports{
            io,
            config,
            counters,
            access,
            {.wanted = [this](const Message& segment,
                              const Source& source) { return room_for(segment, source); },
             .message = [this](const Message& message, const Source& source) { on_message(message, source); },
             .tcp_client = [this](const Endpoint& own, const Endpoint& client,
                                  bool connected) { on_tcp_client(own, client, connected); },
             .tcp_needed = [this](const Endpoint& own,
                                  const Endpoint& client) { return discovery.tcp_needed(own, client); },
             .tcp_refused = [this](const Endpoint& client,
                                   const std::string& why) { on_tcp_refused(client, why); },
             .large_lost = [this](const Endpoint& from,
                                  const std::string& what) { on_large_lost(from, what); },
             .queue_full = [this](const Endpoint* to) { on_queue_full(to); },
             .unreachable = [this](const Endpoint& receiver) { on_unreachable(receiver); },
             .answer_of = [this](const IpAddress& host) { return neighbours.answer_of(host); },
             .entry_of = [this](const IpAddress& host) { return neighbours.entry_of(host); },
             .send_buffer_is_small = [this](int granted) { say_that_sending_is_slow(granted); }}},
        provider{io, discovery, ports, config, counters, access, log, warn},
        consumer{io, discovery, ports, config, counters, log, warn, [this] { drain(); }},
        neighbours{config.address, config.multicast_interface},
        sender{{.single =
                    [this](const Endpoint& to, ByteView bytes) {
                      return unicast.send(to, {&bytes, 1});
                    },
                .group = [this](const Endpoint& to, ByteView bytes,
                                bool heard_here) { return send_to_group(to, bytes, heard_here); },
                .known = [this](const IpAddress& host) { return neighbours.known(host); }},
               config.max_waiting_discovery,
               counters},
        retry_timer{io,
                    [this] {
                      sender.on_time(now());
                      say_what_was_not_sent();
                      retry_timer.arm(sender.deadline());
                    }},
        timer{io,
              [this] {
                discovery.on_time(now());
                drain();
              }},
        look_timer{io, [this] { look_at_others(); }},
        room_timer{io, [this] { tell_of_room(); }},
        withheld{config.max_withheld, config.is_way_back_known},
        withheld_timer{io, [this] { look_at_withheld(); }} {
    if (config.gateway_to) {
      discovery.be_gateway_to(*config.gateway_to);
    }
    if (access.has_policies()) {
      discovery.judge_entries({.is_allowed = &State::is_allowed, .context = &access});
    }
    unicast.receive(feed(false));
    multicast.receive(feed(true));
    // Only a socket that reports errors learns of a full neighbour table. Other errors tell discovery nothing
    // new.
    unicast.report_unreachable([](const Endpoint&) {});
    multicast.report_unreachable([](const Endpoint&) {});
    say_what_is_not_granted();
    watch_link();
  }

  void watch_link() {
    if (!config.watch_link) {
      return;
    }
    try {
      watch.emplace(io, config.address, config.multicast_interface,
                    [this](bool up, const std::string& words) { shielded(io, [&] { on_link(up, words); }); });
    } catch (const someip::NetError& error) {
      log(error.what() + std::string{"; it is taken to be up"});
      return;
    }
    if (!watch->up()) {
      on_link(false, watch->words() + "; discovery starts when it is up");
    }
  }

  void on_link(bool up, const std::string& words) {
    shielded(io, [&] { log(words); });
    link_seen = up;
    if (up) {
      try {
        unicast.follow_interface();
        multicast.follow_interface();
        ports.follow_interface();
      } catch (const someip::NetError& error) {
        log(error.what());
      }
    }
    follow_link();
  }

  void follow_link() {
    if (link_seen && link_told) {
      discovery.link_up(now());  // [feat_req_someipsd_436] [feat_req_someipsd_440]
    } else {
      discovery.link_down();  // [feat_req_someipsd_437]
      sender.forget();
    }
    drain();
  }

  // The node's other sockets ask for the same size and get the same.
  void say_buffer(const char* which, int granted, int wanted, const char* limit, const char* so) {
    if (granted < wanted) {
      warn("the system grants " + std::string{which} + " buffers of " + std::to_string(granted >> 10) +
           " KB only, not " + std::to_string(wanted >> 10) + ": " + so + "; as root: sysctl -w net.core." +
           limit + "=" + std::to_string(wanted));
    }
  }

  // Only a node that sends large messages needs a large send buffer.
  void say_that_sending_is_slow(int granted) {
    if (!std::exchange(slow_sending_said, true)) {
      shielded(io, [&] {
        say_buffer("UDP send", granted, config.send_buffer_bytes, "wmem_max", "large messages take longer");
      });
    }
  }

  void say_what_is_not_granted() {
    say_buffer("UDP receive", unicast.receive_buffer_bytes(), config.receive_buffer_bytes, "rmem_max",
               "large events come slower, and other large messages may lose segments");
    if (config.tcp_receive_buffer_bytes != 0 || config.tcp_send_buffer_bytes != 0) {
      const someip::TcpBuffers tcp =
          someip::granted_buffers({.receive_buffer_bytes = config.tcp_receive_buffer_bytes,
                                   .send_buffer_bytes = config.tcp_send_buffer_bytes});
      say_buffer("TCP receive", tcp.receive_bytes, config.tcp_receive_buffer_bytes, "rmem_max",
                 "less data can be in flight to us");
      say_buffer("TCP send", tcp.send_bytes, config.tcp_send_buffer_bytes, "wmem_max",
                 "less data can be in flight from us");
    }
    if (unicast.busy_poll() < config.busy_poll) {
      log("the system does not poll the network device (SO_BUSY_POLL): it needs CAP_NET_ADMIN");
    }
  }

  static bool is_allowed(void* guard, const Entry& entry, const IpAddress& from) noexcept {
    const bool is_offer = entry.kind() == EntryKind::offer_service;
    return static_cast<AccessGuard*>(guard)->allows(
        {.access = is_offer ? Access::offer : Access::subscribe,
         .service = entry.service,
         .instance = entry.instance,
         .member = is_offer ? std::uint16_t{0} : someip::value(entry.eventgroup())},
        from);
  }

  someip::UdpSocket::Handler feed(bool via_multicast) {
    return [this, via_multicast](ByteView datagram, const Endpoint& from) {
      // Our own, come back, discovery counts.
      if (from != Endpoint{config.address, config.port} && !access.hears(from.address)) {
        return;
      }
      if (subscribes(datagram)) {
        ports.accept_waiting();  // it may name a connection that the system has made, but not yet told of
      }
      const SdCounters before = discovery.counters();
      discovery.on_datagram(datagram, from, via_multicast, now());
      if (discovery.counters().reboots_detected > before.reboots_detected) {
        ports.forget_large(from.address);  // the rest of what it had begun never comes
      }
      say_what_has_no_event(before, from, datagram);
      drain();
    };
  }

  void say_what_has_no_event(const SdCounters& before, const Endpoint& from, ByteView datagram) {
    const SdCounters& after = discovery.counters();
    if (after.reboots_detected > before.reboots_detected) {
      log(someip::to_string(from.address) + " has restarted");
    }
    access.say_what_was_refused();
    say_what_is_foreign(before, after, from);
    say_who_offers_the_same(before, after, from);
    constexpr auto told_above = static_cast<std::size_t>(NackReason::not_allowed);
    for (std::size_t i = 0; i < told_above; ++i) {
      const std::uint64_t more = after.nacks_by_reason[i] - before.nacks_by_reason[i];
      if (const std::uint64_t times = refusals[i].to_tell(more, std::chrono::seconds{1})) {
        log("refused a subscription of " + someip::to_string(from.address) + subscribed_text(datagram) +
            ": " + to_string(static_cast<NackReason>(i)) + and_others(times));
      }
    }
  }

  // Some peers were refused or ignored because of a limit that is too small.
  void say_which_limits_were_reached() {
    const auto& reached = discovery.counters().limits_reached;
    for (std::size_t i = 0; i < limit_count; ++i) {
      reached_lines[i].note(reached[i] - std::exchange(reached_noted[i], reached[i]));
      if (const std::uint64_t times = reached_lines[i].due()) {
        const std::string name = to_string(static_cast<Limit>(i));
        warn("no room for " + std::to_string(times) + " entries or peers: " + name +
             " is reached; raise it for more (in a bridge: someip: limits: " + name + ")");
      }
    }
  }

  void say_who_offers_the_same(const SdCounters& before, const SdCounters& after, const Endpoint& from) {
    const std::uint64_t more = after.ignored_conflicting_offer - before.ignored_conflicting_offer;
    if (more == 0) {
      return;
    }
    const auto which = [](const RemoteService& service) {
      return " offers service " + hexadecimal(value(service.service)) + " instance " +
             hexadecimal(value(service.instance)) + ", which ";
    };
    if (const auto taken = discovery.take_takeover()) {
      if (const std::uint64_t times = takeovers.to_tell(1)) {
        const std::string before_it = someip::to_string(taken->from.address);
        const std::string why = taken->is_back ? " came while it was away" : " does not answer";
        warn(someip::to_string(from.address) + which(taken->service) + before_it + " has offered before; " +
             before_it + why + " and is used no more" + and_others(times));
      }
    }
    if (const auto kept = discovery.contested()) {
      if (const std::uint64_t offers = contested.to_tell(more)) {
        const std::string first = someip::to_string(kept->peer.address);
        warn(someip::to_string(from.address) + which(*kept) + first + " offers, too; " + first +
             " is used while it answers; " + std::to_string(offers) + " such offers");
      }
    }
  }

  // Such an endpoint is usually forged, but a host with several addresses may really mean it.
  void say_what_is_foreign(const SdCounters& before, const SdCounters& after, const Endpoint& from) {
    const std::uint64_t more = after.ignored_foreign_endpoints - before.ignored_foreign_endpoints;
    if (const std::uint64_t times = foreign.to_tell(more, std::chrono::seconds{1})) {
      warn("ignored an offer, subscription or SD endpoint of " + someip::to_string(from.address) +
           ": it names another address (foreign_endpoints would allow that)" + and_others(times));
    }
  }

  // After each call of discovery: carries out what discovery wants. An Ack leaves before initial events
  // [feat_req_someipsd_107]; other entries when all events are handled, to share datagrams.
  void drain() {
    if (draining) {
      return;  // called from a handler of the loop below
    }
    draining = true;
    for (bool let_go = false;;) {
      if (const auto event = discovery.poll_event()) {
        if (std::holds_alternative<SubscriberAdded>(*event) ||
            std::holds_alternative<InitialDataRequested>(*event)) {
          transmit();
        }
        shielded(io, [&] { std::visit([this](const auto& what) { on_event(what); }, *event); });
        let_go = false;
      } else if (std::exchange(let_go, true)) {
        break;
      } else {
        consumer.end_unneeded(now());
        transmit();
      }
    }
    look_at_others();
    if (config.gateway_to && (withheld.waits() || withheld_noted != discovery.remote_changes())) {
      withheld_timer.arm(next_withheld_look);
    }
    shielded(io, [this] { say_which_limits_were_reached(); });
    draining = false;
    timer.arm(discovery.deadline());
  }

  // Both go through all services of others: whoever changes its offers all the time must not make us do that
  // each time.
  void look_at_others() {
    if (noted == discovery.remote_changes()) {
      return;
    }
    const TimePoint time = now();
    if (noted && time < next_look) {
      look_timer.arm(next_look);
      return;
    }
    next_look = time + std::chrono::milliseconds{100};
    noted = discovery.remote_changes();
    shielded(io, [this] { provider.note_rivals(); });
    shielded(io, [this] { consumer.note_other_versions(); });
  }

  void look_at_withheld() {
    withheld_noted = discovery.remote_changes();
    next_withheld_look = now() + std::chrono::milliseconds{20};
    std::vector<RemoteService> services;
    discovery.for_each_remote([&](const slots::Remote& remote) {
      if (remote.is_withheld()) {
        services.push_back(discovery.service_of(remote));
      }
    });
    for (const RemoteHandle service : withheld.to_admit(services, now())) {
      discovery.admit(service, now());
    }
    const std::uint64_t more = withheld.count() - std::exchange(counters.withheld, withheld.count());
    if (const std::uint64_t times = withheld_lines.to_tell(more)) {
      shielded(io, [&] {
        log(std::to_string(times) + " services are withheld for up to " +
            std::to_string(config.max_withheld / std::chrono::milliseconds{1}) +
            " ms: another gateway to the network that ours come from offers them");
      });
    }
    drain();
  }

  // Posted: a handler is not called from within the call to which it was passed.
  void drain_later() {
    boost::asio::post(io, [weak = weak_from_this()] {
      if (const auto self = weak.lock()) {
        self->drain();
      }
    });
  }

  void transmit() {
    std::array<std::byte, someip::max_plain_payload_bytes> room;
    while (const auto datagram = discovery.poll_transmit(room, now())) {
      ports.flush();  // events first: a client that hears of the end of the service takes no more events
      const int why = sender.send(datagram->destination, datagram->bytes, now());
      const bool sent = why == 0;
      if (datagram->destination.address == config.multicast && sent != multicast_works) {
        multicast_works = sent;
        log(sent ? "discovery reaches its group again"
                 : "discovery cannot send to its group " + someip::to_string(datagram->destination) + ": " +
                       std::generic_category().message(why) + "; nobody can find us");
      }
    }
    say_what_was_not_sent();
    retry_timer.arm(sender.deadline());
  }

  someip::SendStatus send_to_group(const Endpoint& to, ByteView bytes, bool heard_here) {
    if (heard_here) {  // heard twice, it would look like a restart to other stacks on this host
      multicast.loop_multicast(false);
    }
    const auto status = multicast.send(to, {&bytes, 1});
    if (heard_here) {
      multicast.loop_multicast(true);
    }
    return status;
  }

  void say_what_was_not_sent() {
    const std::uint64_t all = counters.discovery_no_room + counters.discovery_outdated;
    const std::uint64_t more = all - std::exchange(not_sent_said, all);
    if (const std::uint64_t times = not_sent.to_tell(more)) {
      shielded(io, [&] {
        warn(
            std::to_string(times) +
            " datagrams of discovery could not be sent in time: the send buffer is full, because hosts do "
            "not answer (send_buffer_bytes; of a bridge: someip: send_buffer), or the table of neighbours is "
            "full (as root: sysctl net." +
            (config.address.v6 ? "ipv6" : "ipv4") + ".neigh.default.gc_thresh3)");
      });
    }
  }

  void on_event(const SubscriberAdded& event) { provider.on_event(event); }
  void on_event(const SubscriberRemoved& event) { provider.on_event(event); }
  void on_event(const InitialDataRequested& event) { provider.on_event(event); }
  void on_event(const ConnectionOutdated& event) {
    ports.disconnect(event.own, event.client, "the client has restarted");
  }
  void on_event(const ServiceAvailable& event) { consumer.on_event(event, now()); }
  void on_event(const ServiceLost& event) { on_subscription(event); }
  void on_event(const Subscribed& event) { on_subscription(event); }
  void on_event(const SubscriptionRefused& event) { on_subscription(event); }
  void on_event(const SubscriptionLost& event) { on_subscription(event); }
  template <typename Event>
  void on_subscription(const Event& event) {
    consumer.on_event(event);
    if (subscriptions_changed) {
      subscriptions_changed();
    }
  }

  std::size_t room_for(const Message& segment, const Source& source) {
    switch (someip::without_tp(segment.header.type)) {
      case MessageType::notification:
      case MessageType::response:
      case MessageType::error:
        return consumer.room_for(segment.header, source);
      default:
        return provider.room_for(segment, source);
    }
  }

  void on_message(const Message& message, const Source& source) {
    shielded(io, [&] { hand_over(message, source); });
  }

  void hand_over(const Message& message, const Source& source) {
    switch (message.header.type) {
      case MessageType::notification:
        consumer.on_notification(message, source);
        break;
      case MessageType::response:
      case MessageType::error:
        consumer.on_answer(message, source);
        break;
      default:
        provider.on_request(message, source);
    }
  }

  void on_tcp_client(const Endpoint& own, const Endpoint& client, bool connected) {
    if (connected) {
      if (!discovery.tcp_connected(own, client) &&
          !(ports.make_room(own, client) && discovery.tcp_connected(own, client))) {
        ports.disconnect(own, client, "all places are taken (max_tcp_connections)");
      }
    } else {
      discovery.tcp_closed(own, client);
    }
    drain();
  }

  void on_tcp_refused(const Endpoint& client, const std::string& why) {
    if (tcp_refused.to_tell(1) > 0) {
      const std::string who =
          client.address.is_unspecified() ? "those who ask for it" : someip::to_string(client.address);
      warn("no TCP connection for " + who + ": " + why);
    }
  }

  void on_large_lost(const Endpoint& from, const std::string& what) {
    if (large_lost.to_tell(1) > 0) {
      warn("large messages over UDP were lost, most recently while " + someip::to_string(from.address) +
           " was sending; at one port so far: " + what);
    }
  }

  void on_queue_full(const Endpoint* to) {
    if (queue_full.to_tell(1) > 0) {
      shielded(io, [&] {
        warn("messages are dropped, because too much waits to be sent " +
             (to != nullptr ? "by UDP, now to " + someip::to_string(*to)
                            : std::string{"over a TCP connection"}) +
             ": max_queued_bytes (" + std::to_string(config.max_queued_bytes) + ")");
      });
    }
  }

  void await_room(std::function<bool()> is_full, std::function<void()> told) {
    if (!told) {
      throw std::invalid_argument{"when_room: handler: missing"};
    }
    rooms.add(std::move(is_full), std::move(told), now());
    room_timer.arm(rooms.deadline());
  }

  void tell_of_room() {
    const auto told = rooms.on_time(now());
    room_timer.arm(rooms.deadline());
    for (const auto& tell : told) {
      shielded(io, tell);
    }
  }

  // Its subscriptions end.  [feat_req_someipsd_435]
  void on_unreachable(const Endpoint& receiver) {
    ++counters.unreachable;
    discovery.unreachable(receiver);
    drain();
  }

  boost::asio::io_context& io;
  NodeConfig config;
  DiscoveryLog log;
  DiscoveryLog warn;
  NodeCounters counters;
  std::function<void()> subscriptions_changed;
  bool multicast_works = true;  ///< as far as the results of sending tell
  someip::UdpSocket unicast;
  someip::UdpSocket multicast;
  HeapStorage storage;
  std::span<const ForeignEndpoints> foreign_endpoints{config.foreign_endpoints};
  ServiceDiscovery discovery;
  AccessGuard access;
  Ports ports;
  Provider provider;
  Consumer consumer;
  someip::Neighbours neighbours;
  DiscoverySender sender;
  DeadlineTimer retry_timer;
  DeadlineTimer timer;
  DeadlineTimer look_timer;
  RoomWatch rooms;
  DeadlineTimer room_timer;
  TimePoint next_look{};
  WithheldServices withheld;
  DeadlineTimer withheld_timer;
  TimePoint next_withheld_look{};
  std::uint32_t withheld_noted = 0;  ///< the state of the peers' services at the last look at those
  bool draining = false;
  /// The state of the peers' services last compared with our offers and needs; empty after a new one.
  std::optional<std::uint32_t> noted{};
  std::optional<LinkWatch> watch;
  bool link_seen = true;  ///< up, according to the system
  bool link_told = true;  ///< up, according to the application
  std::array<RareLine, static_cast<std::size_t>(NackReason::not_allowed)> refusals{};
  std::array<RareLine, limit_count> reached_lines{};
  std::array<std::uint64_t, limit_count> reached_noted{};
  RareLine foreign{};
  RareLine contested{};
  RareLine takeovers{};
  RareLine not_sent{};
  RareLine tcp_refused{};
  RareLine large_lost{};
  RareLine queue_full{};
  RareLine withheld_lines{};
  bool slow_sending_said = false;
  std::uint64_t not_sent_said = 0;
};

Node::Node(boost::asio::io_context& io, const NodeConfig& config, DiscoveryLog log, DiscoveryLog warn) {
  check(config);
  state_ = std::make_shared<State>(io, config, std::move(log), std::move(warn));
}

Node::~Node() = default;

boost::asio::io_context& Node::io() const noexcept {
  return state_->io;
}

OfferHandle Node::offer(ServiceSpec spec) {
  const OfferHandle handle = state_->provider.offer(std::move(spec), now());
  state_->noted.reset();
  state_->drain();
  return handle;
}

void Node::withdraw(OfferHandle offer) {
  state_->provider.withdraw(offer, now());
  state_->drain();
}

std::shared_ptr<const void> Node::hold_port(std::uint16_t number, Transport transport) {
  if (transport == Transport::udp) {
    return state_->ports.udp(number);
  }
  return state_->ports.tcp(number, [](const TcpPort&) { return true; });
}

std::size_t Node::subscribers(OfferHandle offer, someip::MethodId event) const {
  return state_->provider.subscribers(offer, event);
}

Notified Node::notify(OfferHandle offer, someip::MethodId event, std::span<const ByteView> payload,
                      const std::shared_ptr<const void>& keep_alive, const someip::TpPacing& pacing) {
  return state_->provider.notify(offer, event, {}, payload, keep_alive, pacing);
}

Notified Node::notify_some(OfferHandle offer, someip::MethodId event, const SubscriberFilter& wanted,
                           std::span<const ByteView> payload, const std::shared_ptr<const void>& keep_alive,
                           const someip::TpPacing& pacing) {
  if (state_->provider.is_notifier(offer, event)) {
    throw std::invalid_argument{"the notifier of a field is for all its subscribers"};
  }
  return state_->provider.notify(offer, event, wanted, payload, keep_alive, pacing);
}

void Node::when_room(OfferHandle offer, someip::MethodId event, std::size_t bytes,
                     std::function<void()> told) {
  state_->await_room([state = state_.get(), offer, event,
                      bytes] { return state->provider.is_full_for(offer, event, bytes); },
                     std::move(told));
}

Notified Node::set_field(OfferHandle offer, someip::MethodId field, ByteView value) {
  return set_field(offer, field, std::make_shared<const std::vector<std::byte>>(value.begin(), value.end()));
}

Notified Node::set_field(OfferHandle offer, someip::MethodId field,
                         std::shared_ptr<const std::vector<std::byte>> value) {
  if (!value) {
    throw std::invalid_argument{"a field cannot be set to nothing"};
  }
  return state_->provider.set_field(offer, field, std::move(value));
}

std::shared_ptr<const std::vector<std::byte>> Node::field(OfferHandle offer, someip::MethodId field) const {
  return state_->provider.field(offer, field);
}

void Node::forget_field(OfferHandle offer, someip::MethodId field) {
  state_->provider.forget_field(offer, field);
}

RequirementId Node::require(const RequireSpec& spec, AvailabilityHandler handler) {
  const RequirementId id = state_->consumer.require(spec, std::move(handler), now());
  state_->noted.reset();
  state_->drain_later();
  return id;
}

void Node::release(RequirementId requirement) {
  state_->consumer.release(requirement, now());
  state_->drain();
}

std::vector<RemoteService> Node::available(RequirementId requirement) const {
  return state_->consumer.available(requirement);
}

CallId Node::call(RequirementId requirement, const CallSpec& spec, std::span<const ByteView> payload,
                  ResponseHandler handler, std::shared_ptr<const void> keep_alive) {
  return state_->consumer.call(requirement, spec, payload, std::move(keep_alive), std::move(handler));
}

someip::Result<CallId, CallFault> Node::try_call(RequirementId requirement, const CallSpec& spec,
                                                 std::span<const ByteView> payload, ResponseHandler handler,
                                                 std::shared_ptr<const void> keep_alive) {
  return state_->consumer.try_call(requirement, spec, payload, std::move(keep_alive), handler);
}

bool Node::cancel(CallId call) {
  return state_->consumer.cancel(call);
}

bool Node::send(RequirementId requirement, const CallSpec& spec, std::span<const ByteView> payload,
                std::shared_ptr<const void> keep_alive) {
  return state_->consumer.send(requirement, spec, payload, std::move(keep_alive));
}

void Node::when_room(RequirementId requirement, const CallSpec& spec, std::size_t bytes,
                     std::function<void()> told) {
  state_->await_room([state = state_.get(), requirement, spec,
                      bytes] { return state->consumer.is_full_for(requirement, spec, bytes); },
                     std::move(told));
}

SubscriptionId Node::subscribe(const SubscribeSpec& spec, EventHandler handler) {
  const SubscriptionId id = state_->consumer.subscribe(spec, std::move(handler), now());
  state_->noted.reset();
  state_->drain();
  return id;
}

void Node::unsubscribe(SubscriptionId subscription) {
  state_->consumer.unsubscribe(subscription, now());
  state_->drain();
}

void Node::on_subscriptions(std::function<void()> changed) {
  state_->subscriptions_changed = std::move(changed);
}

bool Node::subscribed(SubscriptionId subscription) const {
  return state_->consumer.subscribed(subscription);
}

SubscriptionFaults Node::subscription_faults(SubscriptionId subscription) const {
  return state_->consumer.faults(subscription);
}

bool Node::is_offered_by_others(someip::ServiceId service) const {
  bool found = false;
  state_->discovery.for_each_remote(
      [&](const slots::Remote& remote) { found = found || remote.service == service; });
  return found;
}

std::vector<SeenOffer> Node::seen_offers() const {
  std::vector<SeenOffer> result;
  state_->discovery.for_each_remote([&](const slots::Remote& remote) {
    result.push_back({remote.service, remote.instance, remote.major, remote.minor,
                      state_->discovery.service_of(remote).peer.address});
  });
  return result;
}

std::size_t Node::seen_hosts() const {
  return state_->discovery.known_peers();
}

std::vector<SeenHost> Node::hosts() const {
  std::vector<SeenHost> result;
  const TimePoint time = now();
  state_->discovery.for_each_peer([&](const slots::Peer& peer) {
    result.push_back({peer.endpoint, time - peer.last_seen, peer.remotes, peer.subscribers});
  });
  return result;
}

OtherEvents Node::other_events(SubscriptionId subscription) const {
  return state_->consumer.other_events(subscription);
}

void Node::link(bool up) {
  state_->link_told = up;
  state_->follow_link();
}

std::vector<ConfigurationText> Node::configuration(const RemoteService& service) const {
  std::vector<ConfigurationText> items;
  ConfigurationCursor cursor = state_->discovery.configuration(service.handle);
  while (const auto item = cursor.next()) {
    items.push_back(
        {std::string{item->key}, item->value ? std::optional{std::string{*item->value}} : std::nullopt});
  }
  return items;
}

void Node::shutdown() {
  state_->watch.reset();
  state_->discovery.shutdown(now());
  state_->transmit();  // at once, also when it comes from a handler that drain() has called
  state_->drain();
  state_->sender.finish(now());
  state_->provider.clear();
  state_->consumer.clear();
}

NodeCounters Node::counters() const {
  NodeCounters sum = state_->counters;
  sum.overflowed =
      state_->unicast.receive_overflows() + state_->multicast.receive_overflows() + state_->ports.overflows();
  sum.unreachable_ignored = state_->ports.unreachable_ignored();
  return sum;
}
std::vector<UsedLimit> Node::used_limits() const {
  std::vector<UsedLimit> result;
  const auto add = [&result](const char* name, std::size_t used, std::size_t limit) {
    result.push_back({name, used, limit});
  };
  state_->storage.for_each_limit(add);
  add("max_calls", state_->consumer.outstanding_calls(), state_->config.max_calls);
  state_->ports.for_each_limit(add);
  return result;
}
std::vector<SlowSubscriber> Node::slow_subscribers() const {
  return state_->provider.slow_subscribers();
}
const SdCounters& Node::discovery_counters() const noexcept {
  return state_->discovery.counters();
}
someip::TpCounters Node::reassembly_counters() const {
  return state_->ports.reassembly_counters();
}
const someip::CallCounters& Node::call_counters() const noexcept {
  return state_->consumer.call_counters();
}
someip::MessageSender::Counters Node::sender_counters() const {
  return state_->ports.sender_counters();
}
someip::TcpServer::Counters Node::tcp_server_counters() const {
  return state_->ports.tcp_counters();
}
someip::TcpClient::Counters Node::tcp_client_counters() const {
  return state_->consumer.tcp_counters();
}

}  // namespace trestle::sd
