// ServiceDiscovery as a client: required services, the offers of peers, and subscriptions to them.
#include "sd/core/service_discovery.hpp"

namespace trestle::sd {

using slots::OwnSubscription;
using State = OwnSubscription::State;

namespace {

bool usable(const std::optional<Endpoint>& endpoint, bool v6) noexcept {
  return !endpoint || (endpoint->port != 0 && endpoint->address.v6 == v6 &&
                       !endpoint->address.is_multicast() && !endpoint->address.is_unspecified());
}

}  // namespace

bool ServiceDiscovery::fits(const slots::Requirement& requirement,
                            const slots::Remote& remote) const noexcept {
  return requirement.service == remote.service &&
         (requirement.instance == someip::any_instance || requirement.instance == remote.instance) &&
         (requirement.major == any_major || requirement.major == remote.major) &&
         (requirement.minor == any_minor || requirement.minor == remote.minor);
}

RemoteService ServiceDiscovery::service_of(const slots::Remote& remote) const noexcept {
  return {remote.service,
          remote.instance,
          remote.major,
          remote.minor,
          remote.udp,
          remote.tcp,
          peers_[remote.peer].endpoint};
}

std::size_t ServiceDiscovery::requirements_of(const slots::Remote& remote) const noexcept {
  return static_cast<std::size_t>(
      std::count_if(requirements_.begin(), requirements_.end(),
                    [&](const slots::Requirement& requirement) { return fits(requirement, remote); }));
}

std::size_t ServiceDiscovery::events_of_loss(const slots::Remote& remote) const noexcept {
  const std::uint16_t index = remotes_.index_of(remote);
  const auto subscribed = std::count_if(
      subscriptions_.begin(), subscriptions_.end(),
      [&](const OwnSubscription& s) { return s.remote == index && s.state == State::subscribed; });
  return requirements_of(remote) + static_cast<std::size_t>(subscribed);
}

// --- Calls of the application -----------------------------------------------------------------------------

Result<RequirementHandle, SdError> ServiceDiscovery::require(const RequiredService& service,
                                                             TimePoint now) noexcept {
  if (!someip::names_a_service(service.service) || service.instance == InstanceId{0}) {
    return tl::unexpected{SdError::bad_argument};
  }
  // Asked before the new slot is there, so that it does not join itself.
  const FindSchedule schedule = link_up_ ? FindSchedule{settings_.timing, first_due(now)} : FindSchedule{};
  slots::Requirement* const slot = requirements_.add();
  if (slot == nullptr) {
    return tl::unexpected{SdError::table_full};
  }
  slot->service = service.service;
  slot->instance = service.instance;
  slot->major = service.major;
  slot->minor = service.minor;
  slot->schedule = schedule;
  const auto handle = requirements_.handle_of<RequirementHandle>(*slot);
  for (const slots::Remote& remote : remotes_) {
    if (fits(*slot, remote)) {
      tell(ServiceAvailable{handle, service_of(remote)});
      settle(*slot);
    }
  }
  return handle;
}

// A Find for one instance is over with its offer [feat_req_someipsd_238]; one for all instances cannot know
// whether it has seen them all [feat_req_someipsd_239].
void ServiceDiscovery::settle(slots::Requirement& requirement) noexcept {
  if (requirement.instance == someip::any_instance) {
    requirement.schedule.found_some();
  } else {
    requirement.schedule.found();
  }
}

void ServiceDiscovery::release(RequirementHandle handle, TimePoint now) noexcept {
  slots::Requirement* const requirement = requirements_.find(handle);
  if (requirement == nullptr) {
    return;
  }
  for (OwnSubscription& subscription : subscriptions_) {
    if (subscription.requirement == handle.index) {
      withdraw(subscription, now);
    }
  }
  requirements_.remove(*requirement);
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
  if (!instance_fits || ttl_s == 0 || ttl_s > infinite_ttl_s || !usable(request.udp, rules_.v6()) ||
      !usable(request.tcp, rules_.v6()) || request.silence_timeout.value_or(Duration{1}) <= Duration{}) {
    return tl::unexpected{SdError::bad_argument};
  }
  // Parallel subscriptions to one eventgroup differ in their counter.  [feat_req_someipsd_322]
  const auto counter_taken = [&](std::uint8_t counter) {
    return std::any_of(subscriptions_.begin(), subscriptions_.end(), [&](const OwnSubscription& other) {
      return other.counter == counter && other.eventgroup == request.eventgroup &&
             other.instance == instance && requirements_[other.requirement].service == requirement->service;
    });
  };
  std::uint8_t counter = 0;
  while (counter < 16 && counter_taken(counter)) {
    ++counter;
  }
  OwnSubscription* const slot = counter < 16 ? subscriptions_.add() : nullptr;
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
  slot->silence_timeout = request.silence_timeout;
  bind(*slot, now);
  return subscriptions_.handle_of<SubscriptionHandle>(*slot);
}

void ServiceDiscovery::unsubscribe(SubscriptionHandle handle, TimePoint now) noexcept {
  if (OwnSubscription* const subscription = subscriptions_.find(handle)) {
    withdraw(*subscription, now);
  }
}

void ServiceDiscovery::reconnected(SubscriptionHandle handle, const Endpoint& tcp, TimePoint now) noexcept {
  OwnSubscription* const subscription = subscriptions_.find(handle);
  if (subscription == nullptr || !subscription->needs_connection) {
    return;
  }
  subscription->tcp = tcp;
  subscription->needs_connection = false;
  bind(*subscription, now);
}

void ServiceDiscovery::event_received(SubscriptionHandle handle, TimePoint now) noexcept {
  OwnSubscription* const subscription = subscriptions_.find(handle);
  if (subscription != nullptr && subscription->silence_timeout && subscription->state == State::subscribed) {
    subscription->silent_at = now + *subscription->silence_timeout;
  }
}

// --- Own subscriptions ------------------------------------------------------------------------------------

// Ties the subscription to the offer it is for, if that is known.
void ServiceDiscovery::bind(OwnSubscription& subscription, TimePoint now) noexcept {
  for (slots::Remote& remote : remotes_) {
    if (remote.instance == subscription.instance && fits(requirements_[subscription.requirement], remote)) {
      subscription.remote = remotes_.index_of(remote);
      // An application that subscribes on ServiceAvailable answers the offer: it waits as long as we would
      // have. [feat_req_someipsd_766]
      request(subscription, std::max(now, remote.answer_due), Cause::application_or_unicast_offer);
      return;
    }
  }
}

slots::PendingEntry ServiceDiscovery::subscribe_entry(const OwnSubscription& subscription, TimePoint due,
                                                      std::uint32_t ttl_s, bool initial_data) const noexcept {
  const slots::Remote& remote = remotes_[subscription.remote];
  slots::PendingEntry pending;
  pending.due = due;
  pending.peer = remote.peer;  // always by unicast  [feat_req_someipsd_818]
  pending.entry = {
      .type = EntryType::subscribe_eventgroup,
      .service = remote.service,
      .instance = remote.instance,
      .major = remote.major,
      .ttl_s = ttl_s,
      .tail = Entry::eventgroup_tail(subscription.eventgroup, subscription.counter, initial_data)};
  if (subscription.udp) {
    pending.options[pending.option_count++] = {EndpointRole::unicast, *subscription.udp, Transport::udp};
  }
  if (subscription.tcp) {
    pending.options[pending.option_count++] = {EndpointRole::unicast, *subscription.tcp, Transport::tcp};
  }
  return pending;
}

namespace {

bool is_for(const slots::PendingEntry& pending, const OwnSubscription& subscription,
            const slots::Remote& remote) noexcept {
  const Entry& entry = pending.entry;
  return pending.peer == remote.peer && entry.type == EntryType::subscribe_eventgroup &&
         entry.service == remote.service && entry.instance == remote.instance &&
         entry.major == remote.major && entry.eventgroup() == subscription.eventgroup &&
         entry.counter() == subscription.counter;
}

}  // namespace

bool ServiceDiscovery::is_requested(const OwnSubscription& subscription) const noexcept {
  for (std::size_t i = 0; i < pending_.size(); ++i) {
    if (pending_[i].entry.ttl_s != 0 && is_for(pending_[i], subscription, remotes_[subscription.remote])) {
      return true;
    }
  }
  return false;
}

void ServiceDiscovery::cancel_requests(const OwnSubscription& subscription) noexcept {
  pending_.remove_if([&](const slots::PendingEntry& pending) {
    return is_for(pending, subscription, remotes_[subscription.remote]);
  });
}

// Queues a Subscribe to the offer the subscription is tied to.
void ServiceDiscovery::request(OwnSubscription& subscription, TimePoint due, Cause cause) noexcept {
  if (is_requested(subscription)) {
    return;
  }
  if (pending_.free_places() < 2) {
    ++counters_.ignored_no_room;
    return;
  }
  // A Subscribe that went unanswered may be lost, or its answer, or the initial events after it. Only
  // Subscribes that answer multicast offers are watched for that.  [feat_req_someipsd_844]
  // [feat_req_someipsd_1169] [feat_req_someipsd_1176]
  const bool unanswered = cause == Cause::multicast_offer && subscription.ack_overdue;
  const bool server_is_asked =
      settings_.explicit_initial_data && peers_[remotes_[subscription.remote].peer].explicit_initial_data;
  const bool stops_first = unanswered && !server_is_asked;
  if (stops_first) {
    slots::PendingEntry stop = subscribe_entry(subscription, due, 0, false);
    stop.with_next = true;  // [feat_req_someipsd_1178]
    send(stop);
  }
  // After a silence too, which may come from lost initial events: the reasons that _1193 names are not all.
  // [feat_req_someipsd_1191] [feat_req_someipsd_1192] [feat_req_someipsd_1193] [feat_req_someipsd_691]
  // But not behind a StopSubscribe, which is the other way to ask for them [feat_req_someipsd_844]: a server
  // that has never heard of the flag may have refused the whole message for a reserved bit.
  const bool initial_data =
      settings_.explicit_initial_data && !stops_first &&
      (subscription.state != State::subscribed || unanswered || cause == Cause::silence);
  send(subscribe_entry(subscription, due, subscription.ttl_s, initial_data));
  if (cause != Cause::silence) {
    subscription.ack_overdue = cause == Cause::multicast_offer;
  }
  if (subscription.state == State::idle) {
    subscription.state = State::requested;
  }
}

// Ends a subscription by the application's wish.
void ServiceDiscovery::withdraw(OwnSubscription& subscription, TimePoint now) noexcept {
  if (subscription.remote != OwnSubscription::no_remote) {
    cancel_requests(subscription);
    if (link_up_ && subscription.state != State::idle && subscription.state != State::refused) {
      send(subscribe_entry(subscription, now, 0, false));  // [feat_req_someipsd_1177]
    }
  }
  subscriptions_.remove(subscription);
}

// The offer is gone, and with it the subscription; the application's wish stays.
void ServiceDiscovery::unbind(OwnSubscription& subscription, LossReason reason) noexcept {
  cancel_requests(subscription);
  if (subscription.state == State::subscribed) {
    tell(SubscriptionLost{subscriptions_.handle_of<SubscriptionHandle>(subscription), reason});
  }
  subscription.remote = OwnSubscription::no_remote;
  subscription.state = State::idle;
  // A reboot may be a false alarm, after which the server still has the subscription and would take the next
  // Subscribe for a renewal: as after a missing Ack, a StopSubscribe before it brings the initial events.
  subscription.ack_overdue = reason == LossReason::rebooted;
  subscription.multicast.reset();
  subscription.expiry.reset();
  subscription.silent_at.reset();
  subscription.needs_connection = subscription.tcp.has_value();
}

// [feat_req_someipsd_431] [feat_req_someipsd_812]
void ServiceDiscovery::renew_subscriptions(slots::Remote& remote, const Arrival& arrival) noexcept {
  const std::uint16_t index = remotes_.index_of(remote);
  for (OwnSubscription& subscription : subscriptions_) {
    const bool unbound = subscription.remote == OwnSubscription::no_remote;
    if (unbound && !subscription.needs_connection && subscription.instance == remote.instance &&
        fits(requirements_[subscription.requirement], remote)) {
      subscription.remote = index;
    }
    const bool lasts = subscription.state == State::subscribed && subscription.ttl_s == infinite_ttl_s &&
                       !settings_.renew_infinite_subscriptions;
    if (subscription.remote == index && !lasts) {
      request(subscription, arrival.answer_due,
              arrival.via_multicast ? Cause::multicast_offer : Cause::application_or_unicast_offer);
    }
  }
}

void ServiceDiscovery::on_ack(const Entry& entry, const Arrival& arrival) noexcept {
  if (arrival.via_multicast) {
    ++counters_.ignored_wrong_transport;  // [feat_req_someipsd_818]
    return;
  }
  const auto is_meant = [&](const OwnSubscription& subscription) {
    if (subscription.remote == OwnSubscription::no_remote) {
      return false;
    }
    const slots::Remote& remote = remotes_[subscription.remote];
    return remote.peer == arrival.peer && remote.service == entry.service &&
           remote.instance == entry.instance && remote.major == entry.major &&
           subscription.eventgroup == entry.eventgroup() && subscription.counter == entry.counter();
  };
  const auto meant = std::find_if(subscriptions_.begin(), subscriptions_.end(), is_meant);
  if (meant == subscriptions_.end()) {
    ++counters_.ignored_unexpected_ack;
    return;
  }
  if (events_.free_places() == 0) {
    ++counters_.ignored_no_room;
    return;
  }
  OwnSubscription& subscription = *meant;
  const auto handle = subscriptions_.handle_of<SubscriptionHandle>(subscription);
  if (entry.ttl_s == 0) {
    subscription.ack_overdue = false;
    subscription.expiry.reset();
    subscription.silent_at.reset();
    subscription.multicast.reset();
    if (std::exchange(subscription.state, State::refused) != State::refused) {
      tell(SubscriptionRefused{handle});
    }
    return;
  }
  const auto options = read_options(arrival.message, entry, rules_);
  if (!options) {
    ++counters_.ignored_bad_options;
    return;
  }
  subscription.ack_overdue = false;
  subscription.expiry = subscription.ttl_s == infinite_ttl_s
                            ? std::nullopt
                            : std::optional{arrival.now + std::chrono::seconds{subscription.ttl_s}};
  const bool was_subscribed = std::exchange(subscription.state, State::subscribed) == State::subscribed;
  if (!was_subscribed) {
    event_received(handle, arrival.now);
  }
  if (!was_subscribed || subscription.multicast != options->multicast) {
    subscription.multicast = options->multicast;
    tell(Subscribed{handle, subscription.multicast});
  }
}

// --- Offers of peers --------------------------------------------------------------------------------------

slots::Remote* ServiceDiscovery::remote_of(const Entry& entry) const noexcept {
  for (slots::Remote& remote : remotes_) {
    if (remote.service == entry.service && remote.instance == entry.instance && remote.major == entry.major) {
      return &remote;
    }
  }
  return nullptr;
}

void ServiceDiscovery::on_offer(const Entry& entry, const Arrival& arrival) noexcept {
  const auto options = read_options(arrival.message, entry, rules_);
  // An offer without endpoint tells nobody how to reach the service.  [feat_req_someipsd_681]
  if (!options || (!options->udp && !options->tcp) || entry.instance == someip::any_instance) {
    ++counters_.ignored_bad_options;
    return;
  }
  slots::Remote offered;
  offered.service = entry.service;
  offered.instance = entry.instance;
  offered.major = entry.major;
  offered.minor = entry.minor();
  offered.peer = arrival.peer;
  offered.udp = options->udp;
  offered.tcp = options->tcp;
  slots::Remote* remote = remote_of(entry);
  if (remote != nullptr && remote->peer != arrival.peer) {
    // Two servers claim the same service. Whom we know stays until its TTL is over: changing over with every
    // offer would help nobody.
    ++counters_.ignored_conflicting_offer;
    return;
  }
  const bool changed = remote != nullptr && (remote->minor != offered.minor || remote->udp != offered.udp ||
                                             remote->tcp != offered.tcp);
  const std::size_t wanting = requirements_of(offered);
  if ((remote == nullptr || changed) &&
      events_.free_places() < wanting + (changed ? events_of_loss(*remote) : 0)) {
    ++counters_.ignored_no_room;
    return;
  }
  if (changed) {
    lose(*remote, LossReason::replaced, arrival.now);
    remote = nullptr;
  }
  const bool is_new = remote == nullptr;
  if (is_new) {
    remote = new_remote(wanting > 0);
    if (remote == nullptr) {
      ++counters_.ignored_no_room;
      return;
    }
    offered.in_use = true;
    offered.generation = remote->generation;
    *remote = offered;
  }
  remote->expiry = entry.ttl_s == infinite_ttl_s
                       ? std::nullopt
                       : std::optional{arrival.now + std::chrono::seconds{entry.ttl_s}};
  remote->answer_due = arrival.answer_due;
  if (is_new) {
    announce(*remote);
  }
  renew_subscriptions(*remote, arrival);
}

// Services that nobody requires are remembered too, as long as there is room: a later requirement then need
// not look for them.  [feat_req_someipsd_17]
slots::Remote* ServiceDiscovery::new_remote(bool required) noexcept {
  if (slots::Remote* const slot = remotes_.add()) {
    return slot;
  }
  if (!required) {
    return nullptr;
  }
  for (slots::Remote& remote : remotes_) {
    if (requirements_of(remote) == 0) {
      remotes_.remove(remote);
      return remotes_.add();
    }
  }
  return nullptr;
}

void ServiceDiscovery::announce(const slots::Remote& remote) noexcept {
  for (slots::Requirement& requirement : requirements_) {
    if (fits(requirement, remote)) {
      settle(requirement);
      tell(ServiceAvailable{requirements_.handle_of<RequirementHandle>(requirement), service_of(remote)});
    }
  }
}

void ServiceDiscovery::on_stop_offer(const Entry& entry, const Arrival& arrival) noexcept {
  slots::Remote* const remote = remote_of(entry);
  if (remote == nullptr || remote->peer != arrival.peer) {
    return;
  }
  if (events_.free_places() < events_of_loss(*remote)) {
    ++counters_.ignored_no_room;
    return;
  }
  lose(*remote, LossReason::stopped, arrival.now);  // [feat_req_someipsd_831]
}

void ServiceDiscovery::lose(slots::Remote& remote, LossReason reason, TimePoint now) noexcept {
  const std::uint16_t index = remotes_.index_of(remote);
  for (OwnSubscription& subscription : subscriptions_) {
    if (subscription.remote == index) {
      unbind(subscription, reason);
    }
  }
  const slots::Remote lost = remote;
  remotes_.remove(remote);
  for (slots::Requirement& requirement : requirements_) {
    if (!fits(requirement, lost)) {
      continue;
    }
    tell(ServiceLost{requirements_.handle_of<RequirementHandle>(requirement), service_of(lost), reason});
    // After a StopOffer wait for the next offer without asking.  [feat_req_someipsd_834]
    const bool ask = link_up_ && (reason == LossReason::expired || reason == LossReason::rebooted);
    const bool others = std::any_of(remotes_.begin(), remotes_.end(),
                                    [&](const slots::Remote& other) { return fits(requirement, other); });
    if (ask && !others) {
      requirement.schedule = FindSchedule{settings_.timing, first_due(now)};
    }
  }
}

// Advances finds and ends offers and subscriptions whose time is over. What finds no room stays due.
void ServiceDiscovery::seek(TimePoint now) noexcept {
  for (slots::Remote& remote : remotes_) {
    if (remote.expiry && *remote.expiry <= now && events_.free_places() >= events_of_loss(remote)) {
      lose(remote, LossReason::expired, now);
    }
  }
  for (OwnSubscription& subscription : subscriptions_) {
    if (subscription.expiry && *subscription.expiry <= now && events_.free_places() > 0) {
      subscription.expiry.reset();
      subscription.silent_at.reset();
      subscription.state = State::idle;
      tell(SubscriptionLost{subscriptions_.handle_of<SubscriptionHandle>(subscription), LossReason::expired});
    }
  }
  for (OwnSubscription& subscription : subscriptions_) {
    if (subscription.silent_at && *subscription.silent_at <= now) {
      ++counters_.silences;
      subscription.silent_at = now + *subscription.silence_timeout;
      request(subscription, now, Cause::silence);  // [feat_req_someipsd_439]
    }
  }
  for (slots::Requirement& requirement : requirements_) {
    if (pending_.free_places() == 0 || !requirement.schedule.on_time(now)) {
      continue;
    }
    slots::PendingEntry pending;  // no endpoints in a Find  [feat_req_someipsd_877]
    pending.due = now;
    pending.entry = {.type = EntryType::find_service,
                     .service = requirement.service,
                     .instance = requirement.instance,
                     .major = requirement.major,
                     .ttl_s = settings_.timing.ttl_s,
                     .tail = any_minor};  // fits() compares  [feat_req_someipcompat_1197]
    send(pending);
  }
}

}  // namespace trestle::sd
