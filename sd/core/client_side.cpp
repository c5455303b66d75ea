// ServiceDiscovery as a client: its subscriptions to the services of peers.
#include "sd/core/service_discovery.hpp"

namespace trestle::sd {

using slots::Subscription;
using State = Subscription::State;

// --- Calls of the application -----------------------------------------------------------------------------

void ServiceDiscovery::release(RequirementHandle handle, TimePoint now) noexcept {
  slots::Requirement* const requirement = requirements_.find(handle);
  if (requirement == nullptr) {
    return;
  }
  for (Subscription& subscription : subscriptions_) {
    if (subscription.requirement == handle.index) {
      withdraw(subscription, now);
    }
  }
  requirements_.remove(*requirement);
  for (slots::Remote& remote : remotes_) {
    if (fits(*requirement, remote)) {  // a removed slot still has its old content
      remote.is_wanted = requirements_of(remote) > 0;
    }
  }
}

std::optional<RemoteService> ServiceDiscovery::server_of(SubscriptionHandle handle) const noexcept {
  const Subscription* const subscription = subscriptions_.find(handle);
  return subscription == nullptr || subscription->remote == Subscription::no_remote
             ? std::nullopt
             : std::optional{service_of(remotes_[subscription->remote])};
}

Result<SubscriptionHandle, SdError> ServiceDiscovery::subscribe(RequirementHandle handle,
                                                                const EventgroupRequest& request,
                                                                TimePoint now) noexcept {
  const slots::Requirement* const requirement = requirements_.find(handle);
  if (requirement == nullptr) {
    return tl::unexpected{SdError::unknown_handle};
  }
  const InstanceId instance = request.instance.value_or(requirement->instance);
  const std::uint32_t ttl_s = request.ttl_s.value_or(settings_.timing.ttl_s);
  const bool instance_fits =
      instance != someip::any_instance &&
      (requirement->instance == someip::any_instance || requirement->instance == instance);
  if (!instance_fits || ttl_s == 0 || ttl_s > infinite_ttl_s || !rules_.allow_own(request.udp) ||
      !rules_.allow_own(request.tcp) || request.silence_timeout.value_or(Duration{1}).count() <= 0) {
    return tl::unexpected{SdError::bad_argument};
  }
  // Parallel subscriptions to one eventgroup differ in their counter.  [feat_req_someipsd_322]
  const auto counter_taken = [&](std::uint8_t counter) {
    return subscriptions_.find_if([&](const Subscription& other) {
      return other.counter == counter && other.eventgroup == request.eventgroup &&
             other.instance == instance && requirements_[other.requirement].service == requirement->service;
    }) != nullptr;
  };
  std::uint8_t counter = 0;
  while (counter < 16 && counter_taken(counter)) {
    ++counter;
  }
  Subscription* const slot = counter < 16 ? subscriptions_.add() : nullptr;
  if (slot == nullptr) {
    return tl::unexpected{SdError::table_full};
  }
  slot->requirement = handle.index;
  slot->instance = instance;
  slot->eventgroup = request.eventgroup;
  slot->counter = counter;
  slot->ttl_s = ttl_s;
  slot->udp = request.udp;
  slot->tcp = request.tcp;
  slot->silence_timeout = request.silence_timeout.value_or(Duration{});
  slot->receive_buffer_bytes =
      settings_.tell_receive_buffer && request.udp ? request.receive_buffer_bytes : 0;
  join_remote(*slot, now);
  return subscriptions_.handle_of<SubscriptionHandle>(*slot);
}

void ServiceDiscovery::unsubscribe(SubscriptionHandle handle, TimePoint now) noexcept {
  if (Subscription* const subscription = subscriptions_.find(handle)) {
    withdraw(*subscription, now);
  }
}

void ServiceDiscovery::reconnected(SubscriptionHandle handle, const Endpoint& tcp, TimePoint now) noexcept {
  Subscription* const subscription = subscriptions_.find(handle);
  if (subscription == nullptr || !subscription->needs_connection) {
    return;
  }
  subscription->tcp = tcp;
  subscription->needs_connection = false;
  join_remote(*subscription, now);
}

void ServiceDiscovery::event_received(SubscriptionHandle handle, TimePoint now) noexcept {
  Subscription* const subscription = subscriptions_.find(handle);
  if (subscription != nullptr && subscription->silence_timeout.count() > 0 &&
      subscription->state == State::subscribed) {
    subscription->silent_at = now + subscription->silence_timeout;
  }
}

// --- Own subscriptions ------------------------------------------------------------------------------------

// Ties the subscription to the offer it is for, if that is known.
void ServiceDiscovery::join_remote(Subscription& subscription, TimePoint now) noexcept {
  for (slots::Remote& remote : remotes_) {
    if (remote.instance == subscription.instance && remote.is_wanted &&
        fits(requirements_[subscription.requirement], remote)) {
      attach(subscription, remote);
      // Whoever subscribes on ServiceAvailable answers the offer: delayed as ours.  [feat_req_someipsd_766]
      request(subscription, is_due(remote.answer_due, now) ? now : remote.answer_due,
              Cause::application_or_unicast_offer);
      return;
    }
  }
}

// Queues a Subscribe, or with a TTL of 0 a StopSubscribe, to the server of `remote`.
slots::PendingEntry* ServiceDiscovery::queue_subscribe(const slots::Remote& remote,
                                                       const Subscription& subscription, TimePoint due,
                                                       std::uint32_t ttl_s, bool initial_data) noexcept {
  slots::PendingEntry* const pending = send(remote.peer, due);  // always by unicast  [feat_req_someipsd_818]
  if (pending == nullptr) {
    return nullptr;
  }
  pending->entry = {
      .type = EntryType::subscribe_eventgroup,
      .service = remote.service,
      .instance = remote.instance,
      .major = remote.major,
      .ttl_s = ttl_s,
      .tail = Entry::eventgroup_tail(subscription.eventgroup, subscription.counter, initial_data)};
  pending->subscription = subscription.index;
  pending->add(EndpointRole::unicast, subscription.udp, Transport::udp);
  pending->add(EndpointRole::unicast, subscription.tcp, Transport::tcp);
  pending->configuration = requirements_[subscription.requirement].configuration;
  // Also in a StopSubscribe: it references the same options as the Subscribe  [feat_req_someipsd_1177]. Not
  // sent to stacks without explicit initial data: some of these fail at any configuration option.
  if (peers_[remote.peer].explicit_initial_data) {
    pending->receive_buffer_bytes = subscription.receive_buffer_bytes;
  }
  return pending;
}

slots::PendingEntry* ServiceDiscovery::send_subscribe(const Subscription& subscription, TimePoint due,
                                                      std::uint32_t ttl_s, bool initial_data) noexcept {
  return queue_subscribe(remotes_[subscription.remote], subscription, due, ttl_s, initial_data);
}
slots::PendingEntry* ServiceDiscovery::send_subscribe_to(const slots::Remote& remote,
                                                         const Subscription& subscription, TimePoint due,
                                                         std::uint32_t ttl_s) noexcept {
  return queue_subscribe(remote, subscription, due, ttl_s, false);
}

void ServiceDiscovery::cancel_requests(Subscription& subscription) noexcept {
  if (std::exchange(subscription.is_requested, false)) {
    pending_.remove_if(
        [&](const slots::PendingEntry& pending) { return pending.subscription == subscription.index; });
  }
}

// The subscriptions to one offer are linked in a list, as they are renewed with each offer, every second.
void ServiceDiscovery::attach(Subscription& subscription, slots::Remote& remote) noexcept {
  std::uint16_t* end = &remote.subscribed_by;
  while (*end != slots::Remote::none) {
    end = &subscriptions_[*end].next;
  }
  *end = subscription.index;
  subscription.remote = remote.index;
  subscription.next = slots::Remote::none;
}

void ServiceDiscovery::detach(Subscription& subscription) noexcept {
  std::uint16_t* at = &remotes_[subscription.remote].subscribed_by;
  while (*at != subscription.index) {
    at = &subscriptions_[*at].next;
  }
  *at = subscription.next;
  subscription.remote = Subscription::no_remote;
}

// Queues a Subscribe to the offer the subscription is tied to.
void ServiceDiscovery::request(Subscription& subscription, TimePoint due, Cause cause) noexcept {
  if (subscription.is_requested) {
    return;
  }
  if (pending_.free_places() < 2) {
    refuse(Limit::pending_entries);
    return;
  }
  // If a Subscribe got no answer, initial events may be lost, too. Watched only for those that answer
  // multicast offers.  [feat_req_someipsd_844] [feat_req_someipsd_1169] [feat_req_someipsd_1176]
  const bool unanswered = cause == Cause::multicast_offer && subscription.ack_overdue;
  if (guards && cause < Cause::silence) {
    note_asked(remotes_[subscription.remote], subscription.state != State::subscribed, due);
  }
  const bool server_is_asked =
      settings_.explicit_initial_data && peers_[remotes_[subscription.remote].peer].explicit_initial_data;
  if (unanswered && !server_is_asked) {
    send_subscribe(subscription, due, 0, false)->with_next = true;  // [feat_req_someipsd_1178]
  }
  // The first Subscribe asks for initial events  [feat_req_someipsd_1191]. An additional one does not, as
  // long as the TTL of the previous one runs, answered or not  [feat_req_someipsd_1192]. Nor does one after a
  // StopSubscribe: servers that do not know the flag take that pair as a request for initial events.
  // [feat_req_someipsd_844]
  const bool first = !subscription.asked;
  // There are more reasons to ask again than _1193 names: after a silence events may be lost, and if only the
  // additional Subscribe was acknowledged, the server did not get the request.  [feat_req_someipsd_691]
  const bool again = server_is_asked &&
                     (unanswered || (subscription.state == State::subscribed && subscription.initial_open));
  const bool initial_data = settings_.explicit_initial_data && (first || again || cause == Cause::silence);
  send_subscribe(subscription, due, subscription.ttl_s, initial_data)->first = first;
  subscription.is_requested = true;
  if (cause < Cause::silence) {
    subscription.ack_overdue = cause == Cause::multicast_offer;
  }
  subscription.asked = true;
  if (subscription.state != State::subscribed) {
    subscription.initial_open = !initial_data;
    subscription.expiry = end_of(subscription.ttl_s, due);
  } else if (initial_data) {
    subscription.initial_open = false;
  }
  if (subscription.state == State::idle) {
    subscription.state = State::requested;
  }
}

// Called when the server has answered, or the TTL of the last Subscribe has ended, while the next Subscribe
// is still queued: the queued one becomes an additional one, or the first.
void ServiceDiscovery::amend_request(Subscription& subscription) noexcept {
  const bool first = subscription.state != State::subscribed;
  subscription.asked = !first;
  if (!subscription.is_requested) {
    return;
  }
  if (!first) {
    pending_.remove_if([&](const slots::PendingEntry& pending) {
      return pending.entry.ttl_s == 0 && pending.subscription == subscription.index;
    });
  }
  for (std::size_t i = 0; i < pending_.size(); ++i) {
    slots::PendingEntry& pending = pending_[i];
    if (pending.entry.ttl_s != 0 && pending.subscription == subscription.index) {
      subscription.asked = true;
      pending.first = first || pending.first;  // an answer to an unsent Subscribe means nothing
      pending.entry.tail = Entry::eventgroup_tail(subscription.eventgroup, subscription.counter,
                                                  pending.first && settings_.explicit_initial_data);
    }
  }
}

// Ends a subscription because the application wants that.
void ServiceDiscovery::withdraw(Subscription& subscription, TimePoint now) noexcept {
  if (subscription.remote != Subscription::no_remote) {
    cancel_requests(subscription);
    if (link_up_ && subscription.state != State::idle && subscription.state != State::refused) {
      if (slots::PendingEntry* const stop = send_subscribe(subscription, now, 0, false)) {
        stop->subscription = slots::Remote::none;  // [feat_req_someipsd_1177]
      }
    }
    detach(subscription);
  }
  subscriptions_.remove(subscription);
}

// The offer is gone, and so is the subscription to it; the application still wants to be subscribed.
void ServiceDiscovery::leave_remote(Subscription& subscription, LossReason reason) noexcept {
  cancel_requests(subscription);
  if (subscription.state == State::subscribed) {
    lose(subscription, reason);
  }
  detach(subscription);
  subscription.state = State::idle;
  // A reboot may be a false alarm: the server would take the next Subscribe for a renewal. As after a missing
  // Ack, a StopSubscribe before it makes it send the initial events.
  subscription.ack_overdue = reason == LossReason::rebooted;
  subscription.asked = false;
  subscription.initial_open = false;
  subscription.expiry = never;
  subscription.silent_at = never;
  subscription.needs_connection = subscription.tcp.has_value();
}

// [feat_req_someipsd_431] [feat_req_someipsd_812]
void ServiceDiscovery::renew_subscriptions(slots::Remote& remote, bool is_new,
                                           const Arrival& arrival) noexcept {
  for (Subscription& subscription : subscriptions_) {
    if (!is_new || !remote.is_wanted) {
      break;
    }
    const bool unbound = subscription.remote == Subscription::no_remote;
    if (unbound && !subscription.needs_connection && subscription.instance == remote.instance &&
        fits(requirements_[subscription.requirement], remote)) {
      attach(subscription, remote);
    }
  }
  if (guards && remote.is_wanted && remote.subscribed_by == slots::Remote::none) {
    take_subscriptions(remote, arrival);
  }
  for (std::uint16_t at = remote.subscribed_by; at != slots::Remote::none;) {
    Subscription& subscription = subscriptions_[at];
    at = subscription.next;
    const bool lasts = subscription.state == State::subscribed && subscription.ttl_s == infinite_ttl_s &&
                       !settings_.renew_infinite_subscriptions;
    if (!lasts) {
      request(subscription, arrival.answer_due,
              arrival.via_multicast ? Cause::multicast_offer : Cause::application_or_unicast_offer);
    }
  }
}

// Whether the answer may change the subscription: where none is open, only so often. A server could otherwise
// have us tell the application of an end and a new beginning with each entry.
bool ServiceDiscovery::may_change(const Subscription& subscription, const Arrival& arrival) noexcept {
  return subscription.state == State::requested || may_go_on(arrival.peer, 1, arrival.now);
}

// Where any major version will do, another one of the same instance is a rival, too. A connection is one to
// the server that has the subscription.
void ServiceDiscovery::take_subscriptions(slots::Remote& remote, const Arrival& arrival) noexcept {
  for (Subscription& subscription : subscriptions_) {
    if (subscription.remote == Subscription::no_remote || subscription.instance != remote.instance ||
        subscription.tcp || !fits(requirements_[subscription.requirement], remote)) {
      continue;
    }
    slots::Remote& known = remotes_[subscription.remote];
    if (known.peer != remote.peer && !known.has_answered &&
        (remote.has_answered || gives_way_to(remote, known, arrival))) {
      leave_remote(subscription, LossReason::replaced);
      attach(subscription, remote);
    }
  }
}

void ServiceDiscovery::on_ack(const Entry& entry, const Arrival& arrival) noexcept {
  if (arrival.via_multicast) {
    count(counters_.ignored_wrong_transport);  // [feat_req_someipsd_818]
    return;
  }
  const std::string_view name = name_in(entry, arrival);
  // By the offer: a server may well send Acks that mean nothing, and not each is worth a look at all
  // subscriptions. Nobody subscribes to a host that offers nothing.
  std::uint16_t at = slots::Remote::none;
  const auto is_meant = [&](const slots::Remote& remote) {
    if (remote.peer != arrival.peer || remote.instance != entry.instance || remote.major != entry.major ||
        !(name.empty() || has_name(remote.service, remote.configuration, name))) {
      return false;
    }
    at = remote.subscribed_by;
    while (at != slots::Remote::none && (subscriptions_[at].eventgroup != entry.eventgroup() ||
                                         subscriptions_[at].counter != entry.counter())) {
      at = subscriptions_[at].next;
    }
    return at != slots::Remote::none;
  };
  if (peers_[arrival.peer].remotes == 0 || search_remotes(entry.service, is_meant) == nullptr) {
    if (!guards || !rival_answers(entry, arrival)) {
      count(counters_.ignored_unexpected_ack);
    }
    return;
  }
  if (event_places() == 0) {
    refuse(Limit::pending_events);
    return;
  }
  Subscription& subscription = subscriptions_[at];
  if (!guards || entry.ttl_s != 0) {  // whoever refuses has not shown that it serves
    answered(remotes_[subscription.remote]);
  }
  const auto handle = subscriptions_.handle_of<SubscriptionHandle>(subscription);
  if (entry.ttl_s == 0) {
    const bool was_refused = subscription.state == State::refused;
    if (!was_refused && !may_change(subscription, arrival)) {
      return;
    }
    subscription.state = State::refused;
    subscription.ack_overdue = false;
    subscription.expiry = never;
    subscription.silent_at = never;
    amend_request(subscription);
    if (!was_refused) {
      tell([&] { return SubscriptionRefused{handle}; });
    }
    return;
  }
  const auto options = read_options(arrival.message, entry, rules_);
  if (!options) {
    count(counters_.ignored_bad_options);
    return;
  }
  const bool was_subscribed = subscription.state == State::subscribed;
  const bool is_change = !was_subscribed || !are_same(subscription.multicast, options->multicast);
  if (is_change && !may_change(subscription, arrival)) {
    return;
  }
  subscription.state = State::subscribed;
  subscription.ack_overdue = false;
  subscription.expiry = end_of(subscription.ttl_s, arrival.now);
  if (entry.initial_data_requested()) {  // which an Ack repeats  [feat_req_someipsd_614]
    subscription.initial_open = false;
  }
  amend_request(subscription);
  if (!was_subscribed) {
    event_received(handle, arrival.now);
  }
  if (is_change) {
    subscription.multicast = options->multicast;
    tell([&] { return Subscribed{handle, subscription.multicast}; });
  }
}

// Ends own subscriptions whose TTL is over, and renews those whose events do not come.
void ServiceDiscovery::watch(TimePoint now) noexcept {
  for (Subscription& subscription : subscriptions_) {
    if (is_due(subscription.expiry, now) && (guards || events_.free_places() > 0)) {
      subscription.expiry = never;
      subscription.silent_at = never;
      if (subscription.state == State::subscribed) {
        lose(subscription, LossReason::expired);
      }
      if (subscription.state != State::refused) {
        subscription.state = State::idle;
      }
      amend_request(subscription);
    }
  }
  for (Subscription& subscription : subscriptions_) {
    if (is_due(subscription.silent_at, now)) {
      count(counters_.silences);
      subscription.silent_at = now + subscription.silence_timeout;
      request(subscription, now, Cause::silence);  // [feat_req_someipsd_439]
    }
  }
}

}  // namespace trestle::sd
