// Consumer: subscriptions to eventgroups.
#include "sd/net/consumer.hpp"

#include <algorithm>
#include <chrono>
#include <stdexcept>

#include "sd/net/checks.hpp"
#include "sd/net/clock.hpp"
#include "sd/net/discovery_text.hpp"
#include "sd/net/shielded.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::sd {

using someip::Header;
using someip::Message;

namespace {

bool is_same_subscription(const SubscribeSpec& a, const SubscribeSpec& b) {
  return a.service == b.service && a.instance == b.instance && a.major == b.major && a.minor == b.minor &&
         a.eventgroup == b.eventgroup && a.udp == b.udp && a.tcp == b.tcp && a.port == b.port &&
         a.configured == b.configured && a.silence_timeout == b.silence_timeout && a.ttl_s == b.ttl_s &&
         a.otherserv == b.otherserv;
}

std::string name_of(const SubscribeSpec& spec, someip::InstanceId instance) {
  return "eventgroup " + hexadecimal(value(spec.eventgroup)) + " of " + to_string(spec.service, instance);
}

}  // namespace

SubscriptionId Consumer::subscribe(const SubscribeSpec& spec, EventHandler handler, TimePoint now) {
  const std::string name = "subscription to " + name_of(spec, spec.instance);
  if (const std::string mistake = mistake_in(spec, config_); !mistake.empty()) {
    throw std::invalid_argument{name + ": " + mistake};
  }
  if (!handler) {
    throw std::invalid_argument{name + ": handler: missing"};
  }
  E2eChannels e2e = channels_of(spec);
  const auto found = std::ranges::find_if(
      subscriptions_, [&](const auto& one) { return is_same_subscription(one->wanted, spec); });
  std::shared_ptr<SharedSubscription> subscription = found == subscriptions_.end() ? nullptr : *found;
  if (!subscription) {
    subscription = std::make_shared<SharedSubscription>();
    subscription->wanted = spec;
    subscription->spec = {.service = spec.service,
                          .instance = spec.instance,
                          .major = spec.major,
                          .minor = spec.minor,
                          .otherserv = spec.otherserv};
    if (spec.udp) {
      subscription->port = ports_.udp(spec.port);  // open before we subscribe  [feat_req_someipsd_1182]
    }
    subscription->handle = look_for(subscription->spec, now);
    subscriptions_.push_back(subscription);
    add(*subscription, {.subscription = subscription});
    by_service_[spec.service].push_back(subscription.get());
  }
  const SubscriptionId id{next_id_++};
  const auto listener = std::make_shared<Listener>(
      Listener{id, spec.events, std::move(handler), std::move(e2e), spec.max_event_bytes});
  subscription->listeners.push_back(listener);
  for (const someip::MethodId event : spec.events) {
    std::vector<Wish>& wishes = wishes_[key_of(spec.service, event)];
    if (std::ranges::find(wishes, listener, &Wish::listener) == wishes.end()) {  // else it is named twice
      wishes.push_back({subscription, listener});
    }
  }
  return id;
}

void Consumer::unsubscribe(SubscriptionId id, TimePoint now) {
  const auto subscription = find(id);
  if (!subscription) {
    return;
  }
  const auto found = std::ranges::find(subscription->listeners, id, &Listener::id);
  const std::shared_ptr<Listener> listener = *found;
  subscription->listeners.erase(found);
  listener->active = false;
  for (const someip::MethodId event : listener->events) {
    const auto wishes = wishes_.find(key_of(subscription->spec.service, event));
    if (wishes != wishes_.end()) {
      std::erase_if(wishes->second, [&](const Wish& one) { return one.listener == listener; });
      if (wishes->second.empty()) {
        wishes_.erase(wishes);
      }
    }
  }
  if (subscription->listeners.empty()) {
    discovery_.release(subscription->handle, now);
    remove(*subscription);
    std::erase(subscriptions_, subscription);
    const auto of_service = by_service_.find(subscription->spec.service);
    std::erase(of_service->second, subscription.get());
    if (of_service->second.empty()) {
      by_service_.erase(of_service);
    }
  }
}

OtherEvents Consumer::other_events(SubscriptionId id) const {
  const auto subscription = find(id);
  return subscription ? subscription->others : OtherEvents{};
}

bool Consumer::subscribed(SubscriptionId id) const {
  const auto subscription = find(id);
  return subscription && (subscription->wanted.configured
                              ? !subscription->servers.empty()
                              : std::ranges::any_of(subscription->at_servers, &AtServer::subscribed));
}

SubscriptionFaults Consumer::faults(SubscriptionId id) const {
  const auto subscription = find(id);
  if (!subscription) {
    return {};
  }
  SubscriptionFaults faults = subscription->faults;
  faults.other_events = subscription->others.count;
  return faults;
}

std::shared_ptr<Consumer::SharedSubscription> Consumer::find(SubscriptionId id) const {
  const auto found = std::ranges::find_if(subscriptions_, [&](const auto& subscription) {
    return std::ranges::any_of(subscription->listeners, [&](const auto& one) { return one->id == id; });
  });
  return found == subscriptions_.end() ? nullptr : *found;
}

Consumer::AtServer* Consumer::find(SubscriptionHandle handle, SharedSubscription** owner) const {
  const auto subscription = handle.index < owners_.size() ? owners_[handle.index].lock() : nullptr;
  if (!subscription) {
    return nullptr;
  }
  const auto found = std::ranges::find(subscription->at_servers, handle, &AtServer::handle);
  if (found == subscription->at_servers.end()) {
    return nullptr;
  }
  if (owner != nullptr) {
    *owner = subscription.get();
  }
  return &*found;
}

// Subscribes at this server, as soon as the connection is there if that is needed.
void Consumer::subscribe_at(SharedSubscription& subscription, const RemoteService& server, TimePoint now) {
  auto at_server = std::ranges::find(subscription.at_servers, server.instance, &AtServer::instance);
  if (at_server == subscription.at_servers.end()) {
    at_server = subscription.at_servers.insert(at_server, {.instance = server.instance});
  }
  if (subscription.wanted.configured) {
    return;
  }
  std::optional<Endpoint> tcp;
  if (subscription.wanted.tcp) {
    if (!server.tcp) {
      if (!std::exchange(at_server->not_over_tcp, true)) {
        ++subscription.faults.other_transport;
        warn_("cannot subscribe to " + name_of(subscription.wanted, server.instance) +
              " over TCP: it is not offered over TCP, only at " + endpoints_text(server));
      }
      discovery_.is_of_no_use(server.handle);
      return;
    }
    tcp = connection_to(*server.tcp).client->local();
    if (!tcp) {
      return;  // connected() comes back  [feat_req_someipsd_767]
    }
    at_server->connection = server.tcp;
  }
  if (at_server->handle) {
    if (tcp) {
      discovery_.reconnected(*at_server->handle, *tcp, now);
    }
    return;  // without TCP discovery subscribes again by itself
  }
  const auto handle = discovery_.subscribe(
      subscription.handle,
      {.eventgroup = subscription.wanted.eventgroup,
       .instance = server.instance,
       .udp = subscription.port ? std::optional{subscription.port->socket.local()} : std::nullopt,
       .tcp = tcp,
       .ttl_s = subscription.wanted.ttl_s,
       .silence_timeout = subscription.wanted.silence_timeout,
       .receive_buffer_bytes =
           subscription.port ? static_cast<std::uint32_t>(subscription.port->socket.receive_buffer_bytes())
                             : 0U},
      now);
  if (handle) {
    at_server->handle = *handle;
    owners_.resize(std::max<std::size_t>(owners_.size(), handle->index + 1U));
    owners_[handle->index] = subscription.weak_from_this();
  } else {
    warn_("cannot subscribe to " + name_of(subscription.wanted, server.instance) + ": " +
          refusal_text(handle.error(),
                       "max_subscriptions (" + std::to_string(config_.limits.max_subscriptions) +
                           "), or 16 to one eventgroup (of a bridge: someip: limits: max_subscriptions)"));
  }
}

void Consumer::unsubscribe_at(AtServer& at_server, TimePoint now) {
  if (at_server.handle) {
    discovery_.unsubscribe(*at_server.handle, now);
  }
  at_server = {.instance = at_server.instance};
}

// What was subscribed to over TCP only does not come over UDP: the sender of a datagram is easily forged.
const RemoteService* Consumer::server_at(const SharedSubscription& subscription, const Source& source) {
  const SubscribeSpec& wanted = subscription.wanted;
  if (!(source.transport == Transport::udp ? wanted.udp : wanted.tcp)) {
    return nullptr;
  }
  const auto server = std::ranges::find_if(subscription.servers, [&](const RemoteService& one) {
    return (source.transport == Transport::udp ? one.udp : one.tcp) == source.from;
  });
  return server == subscription.servers.end() ? nullptr : &*server;
}

// Whoever is no server of it cannot make anybody believe that its events have other ids.
void Consumer::note_other_event(const Header& header, const Source& source) {
  const auto found = by_service_.find(header.service);
  if (found == by_service_.end()) {
    return;
  }
  for (SharedSubscription* const subscription : found->second) {
    if (server_at(*subscription, source) == nullptr) {
      continue;
    }
    OtherEvents& others = subscription->others;
    ++others.count;
    if (others.ids.size() < OtherEvents::max_ids &&
        std::ranges::find(others.ids, header.method) == others.ids.end()) {
      others.ids.push_back(header.method);
    }
  }
}

bool Consumer::find_listeners(const Header& header, const Source& source) {
  called_.clear();
  if (header.return_code != someip::ReturnCode::ok) {  // [feat_req_someip_683] [feat_req_someip_367]
    ++counters_.bad_return_code;
    return false;
  }
  const auto wishes = wishes_.find(key_of(header.service, header.method));
  if (wishes == wishes_.end()) {
    ++counters_.unexpected;
    note_other_event(header, source);
    return false;
  }
  bool right_sender = false;
  for (const Wish& wish : wishes->second) {
    const SharedSubscription& subscription = *wish.subscription;
    const RemoteService* const server = server_at(subscription, source);
    if (server == nullptr) {
      continue;
    }
    right_sender = true;
    if (header.protocol == someip::protocol_version && header.interface_version == server->major) {
      called_.push_back(wish.listener);
      note_event(subscription, server->instance, now());
    }
  }
  if (called_.empty()) {
    ++(right_sender ? counters_.wrong_version : counters_.unknown_sender);
    if (!right_sender) {
      note_other_event(header, source);  // of another instance, of which other events are wanted
    }
  }
  return !called_.empty();
}

void Consumer::on_notification(const Message& message, const Source& source) {
  if (!find_listeners(message.header, source)) {
    return;
  }
  ++counters_.events;
  // Taken out: a handler may run the io_context, and the next event then comes here in between.
  std::vector<std::shared_ptr<Listener>> called = std::move(called_);
  for (const auto& listener : called) {  // a handler may unsubscribe itself and others
    if (!listener->active) {
      continue;
    }
    shielded(io_, [&] {
      if (E2eChannel* const channel = listener->e2e.find(message.header.method)) {
        deliver_checked(*listener, *channel, message, source);
      } else {
        listener->handler(message, source.from);
      }
    });
  }
  called.clear();
  called_ = std::move(called);
}

// [feat_req_someipsd_439]
void Consumer::note_event(const SharedSubscription& subscription, const someip::InstanceId& instance,
                          TimePoint now) {
  const auto at_server = std::ranges::find(subscription.at_servers, instance, &AtServer::instance);
  if (subscription.wanted.silence_timeout && at_server != subscription.at_servers.end() &&
      at_server->handle) {
    discovery_.event_received(*at_server->handle, now);
  }
}

// --- What discovery tells of subscriptions ----------------------------------------------------------------

void Consumer::on_event(const Subscribed& event) {
  SharedSubscription* owner = nullptr;
  AtServer* const at_server = find(event.subscription, &owner);
  if (at_server == nullptr) {
    return;
  }
  at_server->subscribed = true;
  const std::string name = name_of(owner->wanted, at_server->instance);
  at_server->group.reset();
  if (!event.multicast) {
    log_("subscribed to " + name);
    return;
  }
  std::string missed;
  try {
    at_server->group = ports_.group(*event.multicast);
  } catch (const someip::NetError& error) {
    missed = error.what();
  }
  // Who reads this may rely on the group being joined.
  log_("subscribed to " + name + ", whose multicast events come at " + someip::to_string(*event.multicast));
  if (!missed.empty()) {
    warn_("multicast events of " + name + " will be missed: " + missed);
  }
}

// The server may have lost the TCP connection that we still believe in: a probe finds out, and the connection
// is then made anew and the eventgroup subscribed to through it.  [feat_req_someipsd_869]
void Consumer::on_event(const SubscriptionRefused& event) {
  SharedSubscription* owner = nullptr;
  if (AtServer* const at_server = find(event.subscription, &owner)) {
    at_server->subscribed = false;
    at_server->group.reset();
    // A Nack gives no reason, but this one can be guessed.  [feat_req_someipsd_102]
    const auto server = std::ranges::find(owner->servers, at_server->instance, &RemoteService::instance);
    const bool known = server != owner->servers.end();
    const char* const missing =
        known && server->udp && !owner->wanted.udp   ? "; it may want a UDP endpoint, too"
        : known && server->tcp && !owner->wanted.tcp ? "; it may want a TCP endpoint, too"
                                                     : "";
    ++owner->faults.refused;
    const char* const over = !owner->wanted.tcp ? "UDP" : owner->wanted.udp ? "UDP and TCP" : "TCP";
    warn_("subscription to " + name_of(owner->wanted, at_server->instance) +
          " refused by the server; trying again with its next offer; wanted over " + over +
          (known ? ", offered at " + endpoints_text(*server) : "") + missing);
    const auto connection =
        at_server->connection ? connections_.find(*at_server->connection) : connections_.end();
    if (connection != connections_.end()) {
      connection->second.client->probe();
    }
  }
}

void Consumer::on_event(const SubscriptionLost& event) {
  SharedSubscription* owner = nullptr;
  if (AtServer* const at_server = find(event.subscription, &owner)) {
    at_server->subscribed = false;
    at_server->group.reset();
    log_("subscription to " + name_of(owner->wanted, at_server->instance) +
         " lost: " + to_string(event.reason));
  }
}

}  // namespace trestle::sd
