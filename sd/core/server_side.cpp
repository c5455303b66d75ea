// ServiceDiscovery as a server: its offers, and the subscriptions of peers.
#include "sd/core/service_discovery.hpp"

namespace trestle::sd {
namespace {

bool usable(const Eventgroup& eventgroup, const OfferedService& service, const OptionRules& rules) noexcept {
  const std::optional<Endpoint>& multicast = eventgroup.multicast;
  const bool multicast_fits = !multicast || (multicast->port != 0 && multicast->address.v6 == rules.v6() &&
                                             multicast->address.is_multicast());
  // Events are sent only from the offered endpoints  [feat_req_someipsd_797], so those must exist.
  return multicast_fits && someip::names_an_eventgroup(eventgroup.id) && (!eventgroup.udp || service.udp) &&
         (!eventgroup.tcp || service.tcp);
}

// Whether the service can be reached, and only in ways that are allowed for it.
bool has_access(const OfferedService& service) noexcept {
  if (const auto& mac = service.options.mac_groupcast) {
    return service.service == other_protocols &&
           mac->identifier_bytes <= MacGroupcastOption::max_identifier_bytes;
  }
  return service.udp || service.tcp;
}

bool usable(const OfferedService& service, const OptionRules& rules) noexcept {
  return someip::names_a_service(service.service) && someip::names_an_instance(service.instance) &&
         service.major != any_major && has_access(service) && rules.allow_own(service.udp) &&
         rules.allow_own(service.tcp) &&
         (!service.ttl_s || (*service.ttl_s > 0 && *service.ttl_s <= infinite_ttl_s)) &&
         std::ranges::all_of(service.eventgroups,
                             [&](const Eventgroup& group) { return usable(group, service, rules); });
}

bool has_duplicates(std::span<const Eventgroup> eventgroups) noexcept {
  for (std::size_t i = 0; i < eventgroups.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (eventgroups[i].id == eventgroups[j].id) {
        return true;
      }
    }
  }
  return false;
}

// Other protocols need a name, SOME/IP services must not have one.
bool names_fit(const OfferedService& service, std::string_view name) noexcept {
  if (service.service == other_protocols) {
    return !name.empty();
  }
  return std::ranges::none_of(service.configuration,
                              [](const ConfigurationItem& item) { return item.key == otherserv; });
}

bool same_instance(const Entry& entry, const slots::Offer& offer) noexcept {
  return entry.service == offer.service && entry.instance == offer.instance && entry.major == offer.major;
}

}  // namespace

Result<OfferHandle, SdError> ServiceDiscovery::offer(const OfferedService& service, TimePoint now) noexcept {
  if (!usable(service, rules_)) {
    return tl::unexpected{SdError::bad_argument};
  }
  ByteView configuration;
  if (!service.configuration.empty()) {
    const auto option = encode_configuration(service.configuration, configurations_.room());
    if (!option) {
      return tl::unexpected{SdError::bad_argument};
    }
    configuration = option->body;
  }
  std::uint16_t kept = configurations_.take(configuration);
  const std::string_view name = otherserv_of(configuration);
  if (!names_fit(service, name)) {
    return tl::unexpected{SdError::bad_argument};
  }
  const auto is_same = [&](const slots::Offer& other) {
    return other.service == service.service && other.instance == service.instance &&
           other.major == service.major && has_name(other.service, other.configuration, name);
  };
  if (has_duplicates(service.eventgroups) || offers_.find_if(is_same) != nullptr) {
    return tl::unexpected{SdError::duplicate};
  }
  if (eventgroups_.free_slots() < service.eventgroups.size()) {
    return tl::unexpected{SdError::table_full};
  }
  if (kept == ConfigurationPool::unkept) {
    const auto index = keep_configuration(true);
    if (!index) {
      return tl::unexpected{SdError::table_full};
    }
    kept = *index;
  }
  slots::Offer* const slot = offers_.add();
  if (slot == nullptr) {
    return tl::unexpected{SdError::table_full};
  }
  slot->service = service.service;
  slot->instance = service.instance;
  slot->major = service.major;
  slot->minor = service.minor;
  slot->ttl_s = service.ttl_s.value_or(settings_.timing.ttl_s);
  slot->udp = service.udp;
  slot->tcp = service.tcp;
  slot->options = service.options;
  slot->configuration = kept;
  if (link_up_) {
    start(slot->schedule, now);
  }
  for (const Eventgroup& eventgroup : service.eventgroups) {
    slots::OfferedEventgroup* const group = eventgroups_.add();
    group->offer = slot->index;
    group->eventgroup = eventgroup;
  }
  return offers_.handle_of<OfferHandle>(*slot);
}

void ServiceDiscovery::stop_offer(OfferHandle handle, TimePoint now) noexcept {
  slots::Offer* const offer = offers_.find(handle);
  if (offer == nullptr) {
    return;
  }
  // No Offer or Ack of the service may follow the StopOffer.
  pending_.remove_if([offer](const slots::PendingEntry& pending) {
    const bool ours = pending.entry.type == EntryType::offer_service ||
                      pending.entry.type == EntryType::subscribe_eventgroup_ack;
    // Several offers of other protocols may have the same ids: only their configurations differ.
    return ours && same_instance(pending.entry, *offer) &&
           (offer->service != other_protocols || pending.configuration == offer->configuration);
  });
  if (link_up_) {
    send_offer(*offer, slots::PendingEntry::to_multicast, now, 0);
  }
  for (slots::Subscriber& subscription : subscribers_.all()) {
    if (subscription.offer == handle.index) {
      remove(subscription);
    }
  }
  for (slots::OfferedEventgroup& eventgroup : eventgroups_) {
    if (eventgroup.offer == handle.index) {
      eventgroups_.remove(eventgroup);
    }
  }
  offers_.remove(*offer);
}

Result<void, SdError> ServiceDiscovery::add_subscriber(OfferHandle handle, EventgroupId id,
                                                       const Endpoint& client) noexcept {
  const slots::Offer* const offer = offers_.find(handle);
  if (offer == nullptr) {
    return tl::unexpected{SdError::unknown_handle};
  }
  const Eventgroup* const eventgroup = eventgroup_of(*offer, id);
  if (eventgroup == nullptr || eventgroup->tcp || !rules_.allow_own(client)) {
    return tl::unexpected{SdError::bad_argument};
  }
  const auto is_same = [&](const slots::Subscriber& other) {
    return other.peer == slots::Subscriber::nobody && other.offer == handle.index && other.eventgroup == id &&
           other.configured_at == client;
  };
  if (subscribers_.find_if(is_same) != nullptr) {
    return tl::unexpected{SdError::duplicate};
  }
  slots::Subscriber* const slot =
      subscribers_of(handle.index, id, nullptr) < settings_.max_subscribers_per_eventgroup
          ? subscribers_.add()
          : nullptr;
  if (slot == nullptr) {
    return tl::unexpected{SdError::table_full};
  }
  slot->offer = handle.index;
  slot->eventgroup = id;
  slot->configured_at = client;
  if (eventgroup->udp) {
    slot->udp = client;
  }
  return {};
}

bool ServiceDiscovery::tcp_connected(const Endpoint& own, const Endpoint& client) noexcept {
  slots::TcpConnection* const connection = tcp_connections_.add();
  if (connection == nullptr) {
    note(Limit::tcp_connections);
    return false;
  }
  connection->own = own;
  connection->remote = client;
  return true;
}

void ServiceDiscovery::tcp_closed(const Endpoint& own, const Endpoint& client) noexcept {
  for (slots::TcpConnection& connection : tcp_connections_) {
    if (connection.own == own && connection.remote == client) {
      tcp_connections_.remove(connection);
    }
  }
  for (slots::Subscriber& subscription : subscribers_) {
    if (subscription.tcp == client && offers_[subscription.offer].tcp == own) {
      lose(subscription, LossReason::unreachable);
    }
  }
}

bool ServiceDiscovery::tcp_needed(const Endpoint& own, const Endpoint& client) const noexcept {
  return subscribers_.find_if([&](const slots::Subscriber& subscription) {
    return subscription.tcp == client && offers_[subscription.offer].tcp == own;
  }) != nullptr;
}

bool ServiceDiscovery::is_proven(const IpAddress& client) const noexcept {
  return tcp_connections_.find_if([&](const slots::TcpConnection& connection) {
    return connection.remote.address == client;
  }) != nullptr ||
         subscribers_.find_if([&](const slots::Subscriber& subscription) {
           const bool has_shown_it = !guards || !optimised_for_many ||
                                     subscription.peer == slots::Subscriber::nobody ||
                                     peers_[subscription.peer].proofs >= slots::Peer::is_proven;
           return has_shown_it && subscription.udp && subscription.udp->address == client;
         }) != nullptr;
}

void ServiceDiscovery::unreachable(const Endpoint& subscriber) noexcept {
  for (slots::Subscriber& subscription : subscribers_) {
    if (subscription.udp == subscriber && subscription.peer != slots::Subscriber::nobody) {
      lose(subscription, LossReason::unreachable);
    }
  }
}

std::uint32_t ServiceDiscovery::receive_buffer_of(const Endpoint& client) const noexcept {
  for (const slots::Subscriber& slot : subscribers_) {
    if (slot.udp == client && slot.receive_buffer_bytes != 0) {
      return slot.receive_buffer_bytes;
    }
  }
  return 0;
}

bool ServiceDiscovery::tcp_ready(const slots::Offer& offer, const Endpoint& client) const noexcept {
  return !settings_.check_tcp_connections || tcp_connections_.find_if([&](const slots::TcpConnection& c) {
    return c.own == offer.tcp && c.remote == client;
  }) != nullptr;
}

Subscriber ServiceDiscovery::subscriber_of(const slots::Subscriber& slot) const noexcept {
  const bool configured = slot.peer == slots::Subscriber::nobody;
  return {configured ? slot.configured_at : peers_[slot.peer].endpoint, slot.udp, slot.tcp,
          slot.receive_buffer_bytes};
}

const slots::Subscriber* ServiceDiscovery::subscription(OfferHandle offer, std::size_t place) const noexcept {
  if (place >= subscribers_.size() || offers_.find(offer) == nullptr) {
    return nullptr;
  }
  const slots::Subscriber& slot = subscribers_[static_cast<std::uint16_t>(place)];
  return slot.slot_state == SlotBase::State::in_use && slot.offer == offer.index ? &slot : nullptr;
}

void ServiceDiscovery::send_offer(const slots::Offer& offer, std::uint16_t to, TimePoint due,
                                  std::uint32_t ttl_s) noexcept {
  slots::PendingEntry* const pending = send(to, due);
  if (pending == nullptr) {
    return;
  }
  pending->entry = {.type = EntryType::offer_service,
                    .service = offer.service,
                    .instance = offer.instance,
                    .major = offer.major,
                    .ttl_s = ttl_s,
                    .tail = offer.minor};
  pending->add(EndpointRole::unicast, offer.udp, Transport::udp);
  pending->add(EndpointRole::unicast, offer.tcp, Transport::tcp);
  if (settings_.multicast_option_in_offers) {
    pending->add(EndpointRole::multicast, multicast_of(offer), Transport::udp);
  }
  OfferOptions::for_each(offer.options, [&](const auto& option) {
    if (option) {
      pending->add(option->encode());
    }
  });
  pending->configuration = offer.configuration;
}

// The multicast endpoint that the service's eventgroups share; nothing for several, which would conflict.
std::optional<Endpoint> ServiceDiscovery::multicast_of(const slots::Offer& offer) const noexcept {
  std::optional<Endpoint> shared;
  for (const slots::OfferedEventgroup& slot : eventgroups_) {
    const std::optional<Endpoint>& multicast = slot.eventgroup.multicast;
    if (slot.offer != offer.index || !multicast) {
      continue;
    }
    if (shared && *shared != *multicast) {
      return std::nullopt;
    }
    shared = multicast;
  }
  return shared;
}

// Advances offers and ends subscriptions whose TTL is over. What has no room stays due.
void ServiceDiscovery::serve(TimePoint now) noexcept {
  for (slots::Subscriber& subscription : subscribers_) {
    if (is_due(subscription.expiry, now) && (guards || events_.free_places() > 0)) {
      lose(subscription, LossReason::expired);  // [feat_req_someipsd_445]
    }
  }
  for (slots::Offer& offer : offers_) {
    if (pending_.free_places() > 0 && offer.schedule.on_time(now)) {
      send_offer(offer, slots::PendingEntry::to_multicast, now, offer.ttl_s);
      offer.last_multicast = now;
    }
  }
}

// Endpoint and multicast options of a Find have no meaning and are not read.  [feat_req_someipsd_878]
void ServiceDiscovery::on_find(const Entry& entry, const Arrival& arrival) noexcept {
  if (entry.ttl_s == 0 ||  // a Find must not have it  [feat_req_someipsd_239]
      !may_go_on(arrival.peer, 1, arrival.now)) {
    return;
  }
  const std::string_view name = name_in(entry, arrival);
  for (slots::Offer& offer : offers_) {
    const bool matches = entry.service == offer.service &&
                         (entry.instance == someip::any_instance || entry.instance == offer.instance) &&
                         (entry.major == any_major || entry.major == offer.major) &&
                         (entry.minor() == any_minor || entry.minor() == offer.minor) &&
                         has_name(offer.service, offer.configuration, name);
    const Phase phase = offer.schedule.phase();
    // In the initial wait phase the first offer is sent soon anyway.
    if (!matches || phase == Phase::down || phase == Phase::initial_wait ||
        (phase == Phase::repetition && !settings_.answer_finds_in_repetition_phase)) {
      continue;
    }
    std::uint16_t to = arrival.peer;  // [feat_req_someipsd_824]
    if (settings_.find_answer == FindAnswer::optimised) {
      const bool old = phase == Phase::main &&
                       is_due(offer.last_multicast + settings_.timing.cyclic_offer_delay / 2, arrival.now);
      if (old || !arrival.message.unicast()) {  // [feat_req_someipsd_90] [feat_req_someipsd_91]
        to = slots::PendingEntry::to_multicast;
      }
    }
    bool waiting = false;
    for (std::size_t i = 0; i < pending_.size() && !waiting; ++i) {
      const slots::PendingEntry& other = pending_[i];
      waiting = other.peer == to && other.entry.type == EntryType::offer_service &&
                same_instance(other.entry, offer) && other.configuration == offer.configuration;
    }
    if (waiting) {
      continue;
    }
    if (!has_room_for_answer(arrival.peer)) {
      refuse(Limit::pending_entries);
      continue;
    }
    // The figure of the server's states restarts the offer's timer here. We do not: a peer that sends Finds
    // often enough could then keep our offers from all others.
    send_offer(offer, to, arrival.answer_due, offer.ttl_s);
  }
}

// Delayed answers may take half of the queue, so that a flood of Finds does not hold back other entries.
// Addresses with few answers may use up to three quarters.
bool ServiceDiscovery::has_room_for_answer(std::uint16_t peer) const noexcept {
  const std::size_t free = pending_.free_places();
  if (!guards || free > pending_.size()) {
    return free > pending_.size();
  }
  std::size_t own = 0;
  for (std::size_t i = 0; i < pending_.size(); ++i) {
    const std::uint16_t to = pending_[i].peer;
    own += to != slots::PendingEntry::to_multicast &&
                   peers_[to].endpoint.address == peers_[peer].endpoint.address
               ? 1
               : 0;
  }
  return own < free / 8 && 3 * free > pending_.size();
}

// The offer that an eventgroup entry is about. Those of other protocols need not repeat the name.
const slots::Offer* ServiceDiscovery::offered(const Entry& entry, const Arrival& arrival) noexcept {
  const std::string_view name = name_in(entry, arrival);
  return offers_.search(
      [&](const slots::Offer& offer) {
        return same_instance(entry, offer) &&
               (name.empty() || has_name(offer.service, offer.configuration, name));
      },
      name.empty() && entry.service == other_protocols);
}

const Eventgroup* ServiceDiscovery::eventgroup_of(const slots::Offer& offer, EventgroupId id) const noexcept {
  const slots::OfferedEventgroup* const found =
      eventgroups_.search([&](const slots::OfferedEventgroup& slot) {
        return slot.offer == offer.index && slot.eventgroup.id == id;
      });
  return found == nullptr ? nullptr : &found->eventgroup;
}

slots::Subscriber* ServiceDiscovery::subscription_of(const slots::Offer& offer, const Entry& entry,
                                                     std::uint16_t peer,
                                                     const EntryOptions& options) const noexcept {
  return subscribers_.search([&](const slots::Subscriber& slot) {
    return slot.offer == offer.index && slot.peer == peer && slot.eventgroup == entry.eventgroup() &&
           slot.counter == entry.counter() && are_same(slot.udp, options.udp) &&
           are_same(slot.tcp, options.tcp);
  });
}

namespace {

// Keeps of the referenced endpoints only those that the eventgroup uses.  [feat_req_someipsd_1141]
TRESTLE_ONCE void keep_needed(EntryOptions& options, const Eventgroup& eventgroup) noexcept {
  if (!eventgroup.udp) {
    options.udp.reset();
  }
  if (!eventgroup.tcp) {
    options.tcp.reset();
  }
  if (!eventgroup.udp && !eventgroup.multicast) {
    options.receive_buffer_bytes = 0;
  }
}

}  // namespace

// Ends of subscriptions, too.
void ServiceDiscovery::on_subscribe(const Entry& entry, const Arrival& arrival) noexcept {
  if (arrival.via_multicast) {
    count(counters_.ignored_wrong_transport);  // [feat_req_someipsd_818]
    return;
  }
  if (!may_go_on(arrival.peer, 1, arrival.now)) {
    return;
  }
  if (entry.kind() == EntryKind::stop_subscribe_eventgroup) {
    return on_stop_subscribe(entry, arrival);
  }
  if (pending_.free_places() == 0 || event_places() == 0) {
    refuse(pending_.free_places() == 0 ? Limit::pending_entries : Limit::pending_events);
    return;
  }
  const slots::Offer* const offer = offered(entry, arrival);
  if (optimised_for_many && !is_allowed(entry, arrival)) {
    acknowledge(offer, entry, arrival, tl::unexpected{NackReason::not_allowed});
    return;
  }
  const Eventgroup* const eventgroup = offer != nullptr ? eventgroup_of(*offer, entry.eventgroup()) : nullptr;
  if (eventgroup != nullptr) {
    const Accepted accepted = accept(*offer, *eventgroup, entry, arrival);
    acknowledge(offer, entry, arrival, accepted);
    // Who finds no room is asked, too: it gets some if it answers.
    const bool is_to_be_asked =
        accepted || (accepted.error() == NackReason::no_room && !is_guest(arrival.peer));
    if (guards && optimised_for_many && is_to_be_asked) {
      probe(*offer, arrival);
    }
  } else if (settings_.answer_unknown_subscriptions) {
    acknowledge(offer, entry, arrival, tl::unexpected{why_unknown(entry)});
  } else {
    count(counters_.ignored_unknown_subscriptions);
  }
}

// For an entry without a matching eventgroup: which of its ids is the first unknown one.
NackReason ServiceDiscovery::why_unknown(const Entry& entry) const noexcept {
  auto reason = NackReason::unknown_service;
  for (const slots::Offer& offer : offers_) {
    if (offer.service != entry.service) {
      continue;
    }
    const auto known = offer.instance != entry.instance ? NackReason::unknown_instance
                       : offer.major != entry.major     ? NackReason::unknown_major
                                                        : NackReason::unknown_eventgroup;
    reason = std::max(reason, known);
  }
  return reason;
}

// What is missing for a subscription to the eventgroup.
std::optional<NackReason> ServiceDiscovery::lack_of(const slots::Offer& offer, const Eventgroup& eventgroup,
                                                    const EntryOptions& needed) const noexcept {
  const bool lacks_udp = eventgroup.udp && !needed.udp;
  const bool lacks_tcp = eventgroup.tcp && !needed.tcp;
  const bool has_one = needed.udp || needed.tcp;
  if ((lacks_udp || lacks_tcp) && !(settings_.accept_partial_endpoints && has_one)) {
    return NackReason::missing_endpoint;  // [feat_req_someipsd_102]
  }
  if (needed.tcp && !tcp_ready(offer, *needed.tcp)) {
    return NackReason::no_tcp_connection;
  }
  return std::nullopt;
}

std::size_t ServiceDiscovery::subscribers_of(std::uint16_t offer, EventgroupId eventgroup,
                                             const IpAddress* from) const noexcept {
  std::size_t count = 0;
  for (const slots::Subscriber& other : subscribers_) {
    const bool is_meant =
        !guards || from == nullptr ||
        (other.peer != slots::Subscriber::nobody && peers_[other.peer].endpoint.address == *from);
    count += is_meant && other.offer == offer && other.eventgroup == eventgroup ? 1 : 0;
  }
  return count;
}

slots::Subscriber* ServiceDiscovery::new_subscription(const slots::Offer& offer, EventgroupId eventgroup,
                                                      const Arrival& arrival) noexcept {
  std::optional<Limit> full;
  if constexpr (guards) {
    full = make_room(offer, eventgroup, arrival);
  } else if (subscribers_of(offer.index, eventgroup, nullptr) >= settings_.max_subscribers_per_eventgroup) {
    full = Limit::subscribers_per_eventgroup;
  }
  slots::Subscriber* const slot = full ? nullptr : subscribers_.add();
  if (slot == nullptr) {
    refuse(full.value_or(Limit::subscribers));
    return nullptr;
  }
  slot->offer = offer.index;
  slot->eventgroup = eventgroup;
  slot->peer = arrival.peer;
  ++peers_[arrival.peer].subscribers;
  return slot;
}

void ServiceDiscovery::remove(slots::Subscriber& subscription) noexcept {
  if (subscription.peer != slots::Subscriber::nobody) {
    --peers_[subscription.peer].subscribers;
  }
  subscribers_.remove(subscription);
}

// Adds or renews the subscription, unless it has to be refused.  [feat_req_someipsd_1164]
ServiceDiscovery::Accepted ServiceDiscovery::accept(const slots::Offer& offer, const Eventgroup& eventgroup,
                                                    const Entry& entry, const Arrival& arrival) noexcept {
  auto options = read_options(arrival.message, entry, rules_);
  if (!options) {
    count(counters_.ignored_bad_options);
    return tl::unexpected{NackReason::bad_options};
  }
  keep_needed(*options, eventgroup);
  if (guards && is_foreign(*options, arrival)) {
    count(counters_.ignored_foreign_endpoints);
    return tl::unexpected{NackReason::bad_options};
  }
  if (const auto reason = lack_of(offer, eventgroup, *options)) {
    return tl::unexpected{*reason};
  }
  slots::Subscriber* slot = subscription_of(offer, entry, arrival.peer, *options);
  const bool is_new = slot == nullptr;
  if (is_new) {
    slot = new_subscription(offer, entry.eventgroup(), arrival);
    if (slot == nullptr) {
      return tl::unexpected{NackReason::no_room};
    }
    slot->counter = entry.counter();
    slot->udp = options->udp;
    slot->tcp = options->tcp;
  }
  slot->receive_buffer_bytes = options->receive_buffer_bytes;  // which may have changed
  slot->expiry = end_of(entry.ttl_s, arrival.now);
  // A peer that can ask for initial data gets it when it asks, all others with each new subscription.
  // [feat_req_someipsd_1188] [feat_req_someipsd_833]
  const bool asks = settings_.explicit_initial_data && arrival.message.explicit_initial_data();
  const bool initial_data = asks ? entry.initial_data_requested() : is_new;
  const auto handle = offers_.handle_of<OfferHandle>(offer);
  if (is_new) {
    tell([&] { return SubscriberAdded{handle, slot->eventgroup, subscriber_of(*slot), initial_data}; });
  } else if (initial_data) {
    tell([&] { return InitialDataRequested{handle, slot->eventgroup, subscriber_of(*slot)}; });
  }
  return &eventgroup;
}

// Repeats all of the Subscribe, reserved bits too.  [feat_req_someipsd_614] [feat_req_someipsd_619]
void ServiceDiscovery::acknowledge(const slots::Offer* offer, const Entry& entry, const Arrival& arrival,
                                   const Accepted& accepted) noexcept {
  if (!accepted && !may_go_on(arrival.peer, 3, arrival.now)) {
    return;
  }
  if (!accepted && accepted.error() == NackReason::no_room &&
      !may_be_sent(peers_[arrival.peer], arrival.now)) {
    count(counters_.ignored_too_many);
    return;
  }
  slots::PendingEntry* const pending = send(arrival.peer, arrival.answer_due);
  pending->entry = entry;
  pending->entry.type = EntryType::subscribe_eventgroup_ack;
  if (accepted) {
    pending->add(EndpointRole::multicast, (*accepted)->multicast, Transport::udp);
  } else {
    count(counters_.nacks_sent);
    count(counters_.nacks_by_reason[static_cast<std::size_t>(accepted.error())]);
    pending->entry.ttl_s = 0;
  }
  if (offer != nullptr && offer->service == other_protocols) {
    pending->configuration = offer->configuration;
  }
}

// Never answered.  [feat_req_someipsd_1297]
void ServiceDiscovery::on_stop_subscribe(const Entry& entry, const Arrival& arrival) noexcept {
  auto options = read_options(arrival.message, entry, rules_);
  if (!options) {
    count(counters_.ignored_bad_options);
    return;
  }
  const slots::Offer* const offer = offered(entry, arrival);
  const Eventgroup* const eventgroup = offer != nullptr ? eventgroup_of(*offer, entry.eventgroup()) : nullptr;
  if (eventgroup == nullptr) {
    return;
  }
  keep_needed(*options, *eventgroup);
  if (slots::Subscriber* const slot = subscription_of(*offer, entry, arrival.peer, *options)) {
    lose(*slot, LossReason::stopped);
  }
}

}  // namespace trestle::sd
