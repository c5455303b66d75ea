#include "sd/net/node.hpp"

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <list>
#include <map>
#include <random>
#include <stdexcept>
#include <utility>

#include "sd/net/discovery_text.hpp"
#include "sd/net/heap_storage.hpp"
#include "someip/core/request_check.hpp"
#include "someip/net/address_text.hpp"
#include "someip/net/reassembly.hpp"

namespace trestle::sd {
namespace {

using someip::Header;
using someip::Message;
using someip::MessageSender;
using someip::MessageType;
using someip::MethodId;
using someip::UdpSocket;

// A message that is not whole by then never will be.
constexpr Duration max_reassembly_age = std::chrono::seconds{5};

TimePoint now() {
  return std::chrono::steady_clock::now();
}

std::uint64_t random_seed() {
  std::random_device device;
  return (std::uint64_t{device()} << 32U) | device();
}

Settings discovery_settings(const NodeConfig& config) {
  Settings settings;
  settings.unicast = {config.address, config.port};
  settings.multicast = {config.multicast, config.port};
  settings.timing = config.timing;
  settings.seed = random_seed();
  return settings;
}

// A UDP port that services are offered at or events arrive at.
struct Port {
  Port(boost::asio::io_context& io, const Endpoint& local)
      : socket{io, {.local = local}}, sender{io, socket} {}
  UdpSocket socket;
  MessageSender sender;
};

// A multicast group that a server sends events to.
struct Group {
  Group(boost::asio::io_context& io, const Endpoint& group, const someip::MulticastInterface& interface)
      : socket{io,
               {.local = group,
                .join = group.address,
                .interface = interface,
                .sharing = someip::PortSharing::shared}} {}
  UdpSocket socket;
};

void add(MessageSender::Counters& sum, const MessageSender::Counters& one) {
  sum.messages += one.messages;
  sum.datagrams += one.datagrams;
  sum.queue_full += one.queue_full;
  sum.refused += one.refused;
  sum.abandoned += one.abandoned;
}

struct Offer {
  OfferHandle handle;
  ServiceSpec spec;
  std::shared_ptr<Port> port;
  std::map<MethodId, someip::SessionCounter> sessions;  // of each event
};

// One who wants events of a subscription.
struct Listener {
  SubscriptionId id{};
  std::vector<MethodId> events;
  Node::EventHandler handler;
  bool active = true;  // false once it has unsubscribed, though it may still be in line to be called
};

struct Subscription {
  SubscriptionHandle handle;
  RequirementHandle requirement;
  SubscribeSpec spec;  // whose events count for nothing: each listener has its own
  std::shared_ptr<Port> port;
  std::vector<std::shared_ptr<Listener>> listeners{};
  std::vector<RemoteService> servers{};  // that offer the service now: only their events are accepted
  bool subscribed = false;
  std::shared_ptr<Group> group{};  // where multicast events arrive, if the server sends any

  [[nodiscard]] bool is_for(const SubscribeSpec& other) const {
    return spec.service == other.service && spec.instance == other.instance && spec.major == other.major &&
           spec.minor == other.minor && spec.eventgroup == other.eventgroup && spec.port == other.port;
  }
};

}  // namespace

struct Node::State : std::enable_shared_from_this<State> {
  State(boost::asio::io_context& context, const NodeConfig& settings, DiscoveryLog logger)
      : io{context},
        config{settings},
        log{std::move(logger)},
        unicast{io,
                {.local = {config.address, config.port},
                 .interface = {{config.address, config.multicast_interface}},
                 .sharing = someip::PortSharing::by_address}},
        multicast{io,
                  {.local = {config.multicast, config.port},
                   .join = config.multicast,
                   .interface = {{config.address, config.multicast_interface}},
                   .sharing = someip::PortSharing::shared}},
        storage{config.limits},
        discovery{discovery_settings(config), storage.view()},
        reassembly{config.max_reassemblies,
                   {.max_message_bytes = config.max_message_bytes,
                    .max_per_sender = config.max_reassemblies,
                    .max_age = max_reassembly_age}},
        timer{io} {}

  void start() {
    const auto feed = [this](bool via_multicast) {
      return [this, via_multicast](ByteView datagram, const Endpoint& from) {
        const Counters before = discovery.counters();
        discovery.on_datagram(datagram, from, via_multicast, now());
        say_what_has_no_event(before, from);
        drain();
      };
    };
    unicast.receive(feed(false));
    multicast.receive(feed(true));
  }

  // After each call of the machines: does what they want done.
  void drain() {
    if (draining) {
      return;  // called from a handler of the loop below
    }
    draining = true;
    // First what is to be sent: an Ack leaves before the initial events that its SubscriberAdded asks for.
    transmit();
    while (const auto event = discovery.poll_event()) {
      std::visit([this](const auto& what) { on_event(what); }, *event);
    }
    transmit();
    draining = false;
    arm_timer();
  }

  void transmit() {
    std::array<std::byte, someip::max_plain_payload_bytes> room;
    while (const auto datagram = discovery.poll_transmit(room, now())) {
      if (unicast.send(datagram->destination, {&datagram->bytes, 1}) != someip::SendStatus::sent) {
        ++node_counters.discovery_not_sent;
      }
    }
  }

  void say_what_has_no_event(const Counters& before, const Endpoint& from) {
    const Counters& after = discovery.counters();
    if (after.reboots_detected > before.reboots_detected) {
      say(someip::to_string(from.address) + " was started anew");
    }
    if (after.nacks_sent > before.nacks_sent) {
      say("refused a subscription of " + someip::to_string(from.address) +
          ": no such service, version or eventgroup is offered here, or there is no room for it");
    }
  }

  void arm_timer() {
    auto due = discovery.deadline();
    if (const auto other = reassembly.machine().deadline(); other && (!due || *other < *due)) {
      due = other;
    }
    if (due == timer_due) {
      return;
    }
    timer_due = due;
    if (!due) {
      timer.cancel();
      return;
    }
    timer.expires_at(*due);
    timer.async_wait([weak = weak_from_this()](const boost::system::error_code& error) {
      const auto self = weak.lock();
      if (!error && self && !self->stopped) {
        self->timer_due.reset();
        self->discovery.on_time(now());
        self->reassembly.machine().on_time(now());
        self->drain();
      }
    });
  }

  // --- what discovery tells
  // ---------------------------------------------------------------------------------

  void on_event(const SubscriberAdded& event) { log_subscriber(event, "subscribed to"); }
  void on_event(const InitialDataRequested&) {}  // events have no initial values, only fields do
  void on_event(const SubscriberRemoved& event) {
    log_subscriber(event, (std::string{to_string(event.reason)} + ", no longer subscribed to").c_str());
  }

  void on_event(const ServiceAvailable& event) {
    bool is_new = false;
    for (Subscription& subscription : subscriptions) {
      if (subscription.requirement == event.requirement) {
        is_new = true;
        forget(subscription, event.service);
        subscription.servers.push_back(event.service);
      }
    }
    if (is_new) {
      say(describe(event.service));
    }
  }

  void on_event(const ServiceLost& event) {
    for (Subscription& subscription : subscriptions) {
      if (subscription.requirement == event.requirement) {
        forget(subscription, event.service);
      }
    }
    say("service " + to_string(event.service.service, event.service.instance) + " of " +
        someip::to_string(event.service.peer.address) + " is gone: " + to_string(event.reason));
  }

  void on_event(const Subscribed& event) {
    if (Subscription* const subscription = find(event.subscription)) {
      subscription->subscribed = true;
      say("subscribed to " + name_of(*subscription) +
          (event.multicast ? ", whose multicast events come at " + someip::to_string(*event.multicast) : ""));
      join(*subscription, event.multicast);
    }
  }
  void on_event(const SubscriptionRefused& event) {
    if (const Subscription* const subscription = find(event.subscription)) {
      say("subscription to " + name_of(*subscription) +
          " refused by the server; trying again with its next offer");
    }
  }
  void on_event(const SubscriptionLost& event) {
    if (Subscription* const subscription = find(event.subscription)) {
      subscription->subscribed = false;
      subscription->group.reset();
      say("subscription to " + name_of(*subscription) + " lost: " + to_string(event.reason));
    }
  }

  // Receives the multicast events of a subscription.  [feat_req_someipsd_791]
  void join(Subscription& subscription, const std::optional<Endpoint>& where) {
    subscription.group.reset();
    if (!where) {
      return;
    }
    std::weak_ptr<Group>& known = groups[*where];
    subscription.group = known.lock();
    if (subscription.group) {
      return;
    }
    try {
      const someip::MulticastInterface interface { config.address, config.multicast_interface };
      subscription.group = share(std::make_unique<Group>(io, *where, interface));
    } catch (const someip::NetError& error) {
      say("multicast events of " + name_of(subscription) + " will be missed: " + error.what());
      return;
    }
    known = subscription.group;
    subscription.group->socket.receive([this, weak = known](ByteView datagram, const Endpoint& from) {
      if (const auto alive = weak.lock()) {  // also keeps it during the call
        on_datagram(nullptr, datagram, from);
      }
    });
  }

  // A socket and what goes with it, whose counters outlive it.
  template <typename Owner>
  std::shared_ptr<Owner> share(std::unique_ptr<Owner> owner) {
    return {owner.release(), [this](Owner* last) {
              const std::unique_ptr<Owner> end{last};
              node_counters.overflowed += end->socket.receive_overflows();
              if constexpr (std::is_same_v<Owner, Port>) {
                end->sender.close();
                add(sent_by_gone_ports, end->sender.counters());
              }
            }};
  }

  static void forget(Subscription& subscription, const RemoteService& service) {
    std::erase_if(subscription.servers, [&](const RemoteService& known) {
      return known.service == service.service && known.instance == service.instance &&
             known.major == service.major;
    });
  }

  template <typename SubscriberEvent>
  void log_subscriber(const SubscriberEvent& event, const char* what) {
    const auto offer = std::ranges::find(offers, event.offer, &Offer::handle);
    if (offer != offers.end()) {
      const auto& at = event.subscriber.udp ? *event.subscriber.udp : event.subscriber.peer;
      say(someip::to_string(at) + " " + what + " eventgroup " + hexadecimal(value(event.eventgroup)) +
          " of " + to_string(offer->spec.service, offer->spec.instance));
    }
  }

  static std::string name_of(const Subscription& subscription) {
    return "eventgroup " + hexadecimal(value(subscription.spec.eventgroup)) + " of " +
           to_string(subscription.spec.service, subscription.spec.instance);
  }

  void say(const std::string& line) {
    if (log) {
      log(line);
    }
  }

  Subscription* find(SubscriptionHandle handle) {
    const auto found = std::ranges::find(subscriptions, handle, &Subscription::handle);
    return found == subscriptions.end() ? nullptr : &*found;
  }

  Subscription* find(SubscriptionId id) {
    const auto found = std::ranges::find_if(subscriptions, [&](const Subscription& subscription) {
      return std::ranges::any_of(subscription.listeners, [&](const auto& one) { return one->id == id; });
    });
    return found == subscriptions.end() ? nullptr : &*found;
  }

  // --- messages
  // ---------------------------------------------------------------------------------------------

  /// The port with this number, opened if it is not yet; ports are shared. 0: one for all that don't care.
  std::shared_ptr<Port> port(std::uint16_t number) {
    std::weak_ptr<Port>& known = ports[number];
    std::shared_ptr<Port> port = known.lock();
    if (!port) {
      port = share(std::make_unique<Port>(io, Endpoint{config.address, number}));
      known = port;
      port->socket.receive([this, weak = known](ByteView datagram, const Endpoint& from) {
        if (const auto alive = weak.lock()) {  // also keeps it during the call
          on_datagram(alive.get(), datagram, from);
        }
      });
    }
    return port;
  }

  // `port` is nothing for what came by multicast: only events may come that way.
  void on_datagram(Port* port, ByteView datagram, const Endpoint& from) {
    ++node_counters.datagrams;
    someip::MessageCursor cursor{datagram};
    while (const auto message = cursor.next()) {
      if (!someip::is_tp(message->header.type)) {
        on_message(port, *message, from);
        continue;
      }
      const auto whole = reassembly.machine().on_segment(from, *message, now());
      if (whole && *whole) {
        on_message(port, {(*whole)->header, (*whole)->payload}, from);
      }
      arm_timer_for_reassembly();
    }
    if (cursor.error() || datagram.empty()) {
      ++node_counters.malformed;
    }
  }

  void arm_timer_for_reassembly() {
    // Only when the machine's deadline is the nearest; it moves at most once per message, not per segment.
    const auto due = reassembly.machine().deadline();
    if (due && (!timer_due || *due < *timer_due)) {
      arm_timer();
    }
  }

  void on_message(Port* port, const Message& message, const Endpoint& from) {
    if (message.header.type == MessageType::notification) {
      on_notification(message, from);
      return;
    }
    const auto answer = port == nullptr
                            ? std::nullopt
                            : someip::error_answer(message.header, complaint(*port, message.header));
    if (answer) {
      port->sender.send(from, *answer, {});
      ++node_counters.requests_answered;
    } else {
      ++node_counters.unexpected;
    }
  }

  /// Why a request is answered with an error: no service here has methods.
  [[nodiscard]] someip::ReturnCode complaint(const Port& port, const Header& request) const {
    using someip::ReturnCode;
    if (request.protocol != someip::protocol_version) {
      return ReturnCode::wrong_protocol_version;
    }
    const auto offer = std::ranges::find_if(offers, [&](const Offer& one) {
      return one.port.get() == &port && one.spec.service == request.service;
    });
    if (offer == offers.end()) {
      return ReturnCode::unknown_service;
    }
    return offer->spec.major == request.interface_version ? ReturnCode::unknown_method
                                                          : ReturnCode::wrong_interface_version;
  }

  void on_notification(const Message& message, const Endpoint& from) {
    const Header& header = message.header;
    bool wanted = false;
    bool right_sender = false;
    called.clear();
    for (const Subscription& subscription : subscriptions) {
      if (subscription.spec.service != header.service) {
        continue;
      }
      const auto server = std::ranges::find(subscription.servers, std::optional{from}, &RemoteService::udp);
      const bool offers_it = server != subscription.servers.end();
      for (const auto& listener : subscription.listeners) {
        if (std::ranges::find(listener->events, header.method) == listener->events.end()) {
          continue;
        }
        wanted = true;
        right_sender = right_sender || offers_it;
        if (offers_it && header.protocol == someip::protocol_version &&
            header.interface_version == server->major) {
          called.push_back(listener);
        }
      }
    }
    if (called.empty()) {
      ++(!wanted         ? node_counters.unexpected
         : !right_sender ? node_counters.unknown_sender
                         : node_counters.wrong_version);
      return;
    }
    ++node_counters.events;
    for (const auto& listener : called) {  // a handler may unsubscribe itself and others
      if (listener->active) {
        listener->handler(message, from);
      }
    }
  }

  /// Calls `visit(endpoint)` once for each endpoint that gets this event, also when it subscribed to several
  /// eventgroups with it.
  template <typename Visit>
  void for_each_receiver(const Offer& offer, MethodId event, Visit visit) const {
    receivers.clear();
    for (const EventgroupSpec& group : offer.spec.eventgroups) {
      if (std::ranges::find(group.events, event) != group.events.end()) {
        discovery.for_each_subscriber(offer.handle, group.id, [&](const Subscriber& subscriber) {
          if (subscriber.udp && std::ranges::find(receivers, *subscriber.udp) == receivers.end()) {
            receivers.push_back(*subscriber.udp);
          }
        });
      }
    }
    std::ranges::for_each(receivers, visit);
  }

  boost::asio::io_context& io;
  NodeConfig config;
  DiscoveryLog log;
  UdpSocket unicast;
  UdpSocket multicast;
  HeapStorage storage;
  ServiceDiscovery discovery;
  someip::Reassembly reassembly;
  boost::asio::steady_timer timer;
  std::optional<TimePoint> timer_due;
  NodeCounters node_counters;
  MessageSender::Counters sent_by_gone_ports;
  std::map<std::uint16_t, std::weak_ptr<Port>> ports;
  std::map<Endpoint, std::weak_ptr<Group>> groups;
  std::list<Offer> offers;
  std::list<Subscription> subscriptions;
  std::uint32_t next_subscription_id = 1;
  std::vector<std::shared_ptr<Listener>> called;  // of one message; kept to reuse its memory
  mutable std::vector<Endpoint> receivers;        // of one event; kept to reuse its memory
  bool draining = false;
  bool stopped = false;
};

namespace {

/// The handle, or what discovery has against it.
template <typename Handle>
Handle accepted(const someip::Result<Handle, SdError>& handle, const std::string& what) {
  if (!handle) {
    throw std::invalid_argument{what + ": refused by service discovery: " + to_string(handle.error())};
  }
  return *handle;
}

}  // namespace

Node::Node(boost::asio::io_context& io, const NodeConfig& config, DiscoveryLog log)
    : state_{std::make_shared<State>(io, config, std::move(log))} {
  state_->start();
}

Node::~Node() {
  state_->stopped = true;
  state_->timer.cancel();
}

OfferHandle Node::offer(const ServiceSpec& spec) {
  State& state = *state_;
  const std::shared_ptr<Port> port = state.port(spec.port);
  std::vector<Eventgroup> groups;
  for (const EventgroupSpec& group : spec.eventgroups) {
    groups.push_back({.id = group.id});
  }
  const OfferHandle handle = accepted(state.discovery.offer({.service = spec.service,
                                                             .instance = spec.instance,
                                                             .major = spec.major,
                                                             .minor = spec.minor,
                                                             .udp = port->socket.local(),
                                                             .eventgroups = groups},
                                                            now()),
                                      "offer of " + to_string(spec.service, spec.instance));
  state.offers.push_back({handle, spec, port, {}});
  state.say("offering " + to_string(spec.service, spec.instance) + " at " +
            someip::to_string(port->socket.local()));
  state.drain();
  return handle;
}

void Node::withdraw(OfferHandle offer) {
  state_->discovery.stop_offer(offer, now());
  state_->drain();
  state_->offers.remove_if([&](const Offer& one) { return one.handle == offer; });
}

std::size_t Node::subscribers(OfferHandle offer, MethodId event) const {
  const auto found = std::ranges::find(state_->offers, offer, &Offer::handle);
  std::size_t count = 0;
  if (found != state_->offers.end()) {
    state_->for_each_receiver(*found, event, [&](const Endpoint&) { ++count; });
  }
  return count;
}

Node::Notified Node::notify(OfferHandle offer, MethodId event, std::span<const ByteView> payload,
                            std::shared_ptr<const void> keep_alive, const someip::TpPacing& pacing) {
  const auto found = std::ranges::find(state_->offers, offer, &Offer::handle);
  if (found == state_->offers.end()) {
    return {};
  }
  const Header header{.service = found->spec.service,
                      .method = event,
                      .session = found->sessions[event].next(),
                      .interface_version = found->spec.major,
                      .type = MessageType::notification};
  Notified result{.session = header.session};
  state_->for_each_receiver(*found, event, [&](const Endpoint& to) {
    const bool taken = found->port->sender.send(to, header, payload, keep_alive, pacing);
    ++(taken ? result.subscribers : result.dropped);
  });
  return result;
}

SubscriptionId Node::subscribe(const SubscribeSpec& spec, EventHandler handler) {
  State& state = *state_;
  auto subscription =
      std::ranges::find_if(state.subscriptions, [&](const Subscription& one) { return one.is_for(spec); });
  if (subscription == state.subscriptions.end()) {
    const std::shared_ptr<Port> port = state.port(spec.port);
    const std::string what = "subscription to " + to_string(spec.service, spec.instance);
    const RequirementHandle requirement = accepted(
        state.discovery.require(
            {.service = spec.service, .instance = spec.instance, .major = spec.major, .minor = spec.minor},
            now()),
        what);
    const auto handle = state.discovery.subscribe(
        requirement, {.eventgroup = spec.eventgroup, .udp = port->socket.local()}, now());
    if (!handle) {
      state.discovery.release(requirement, now());
    }
    subscription = state.subscriptions.insert(
        subscription,
        {.handle = accepted(handle, what), .requirement = requirement, .spec = spec, .port = port});
    state.say("looking for " + to_string(spec.service, spec.instance));
  }
  const SubscriptionId id{state.next_subscription_id++};
  subscription->listeners.push_back(
      std::make_shared<Listener>(Listener{id, spec.events, std::move(handler)}));
  state.drain();
  return id;
}

void Node::unsubscribe(SubscriptionId id) {
  State& state = *state_;
  Subscription* const subscription = state.find(id);
  if (subscription == nullptr) {
    return;
  }
  std::erase_if(subscription->listeners, [&](const auto& one) {
    one->active = one->active && one->id != id;
    return one->id == id;
  });
  if (subscription->listeners.empty()) {
    state.discovery.release(subscription->requirement, now());
    state.drain();
    state.subscriptions.remove_if([&](const Subscription& one) { return &one == subscription; });
  }
}

bool Node::subscribed(SubscriptionId id) const {
  const Subscription* const found = state_->find(id);
  return found != nullptr && found->subscribed;
}

void Node::shutdown() {
  state_->discovery.shutdown(now());
  state_->drain();
  state_->offers.clear();
  state_->subscriptions.clear();
}

NodeCounters Node::counters() const {
  NodeCounters sum = state_->node_counters;
  sum.overflowed += state_->unicast.receive_overflows() + state_->multicast.receive_overflows();
  const auto add_overflows = [&](const auto& sockets) {
    for (const auto& [key, weak] : sockets) {
      if (const auto one = weak.lock()) {
        sum.overflowed += one->socket.receive_overflows();
      }
    }
  };
  add_overflows(state_->ports);
  add_overflows(state_->groups);
  return sum;
}
const Counters& Node::discovery_counters() const noexcept {
  return state_->discovery.counters();
}
const someip::TpCounters& Node::reassembly_counters() const noexcept {
  return std::as_const(state_->reassembly).machine().counters();
}

MessageSender::Counters Node::sender_counters() const {
  MessageSender::Counters sum = state_->sent_by_gone_ports;
  for (const auto& [number, weak] : state_->ports) {
    if (const auto port = weak.lock()) {
      add(sum, port->sender.counters());
    }
  }
  return sum;
}

int Node::receive_buffer_bytes() const {
  int smallest = state_->unicast.receive_buffer_bytes();
  for (const auto& [number, weak] : state_->ports) {
    if (const auto port = weak.lock()) {
      smallest = std::min(smallest, port->socket.receive_buffer_bytes());
    }
  }
  return smallest;
}

}  // namespace trestle::sd
