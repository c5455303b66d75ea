#include "bridge/traffic/network_view.hpp"

#include <array>
#include <tuple>

namespace trestle::traffic {
namespace {

using Kind = Sighting::Kind;

constexpr std::uint32_t usual_ttl_s = 3;

/// The endpoints among the options of an entry, the first of each kind.
template <typename Seen>
void read_endpoints(const sd::SdMessage& message, const sd::Entry& entry, Seen& seen,
                    std::optional<Endpoint>* multicast = nullptr) {
  for (std::size_t at = 0; at < entry.option_count(); ++at) {
    const auto option = message.option_of(entry, at);
    const auto endpoint = option ? sd::EndpointOption::decode(*option) : tl::unexpected{option.error()};
    if (endpoint && endpoint->role == sd::EndpointRole::unicast) {
      auto& place = endpoint->transport == Transport::tcp ? seen.tcp : seen.udp;
      place = place ? place : endpoint->endpoint;
    } else if (endpoint && endpoint->role == sd::EndpointRole::multicast && multicast != nullptr) {
      *multicast = *multicast ? *multicast : endpoint->endpoint;
    }
  }
}

void lose(SeenService& service, Kind why, TimePoint now, std::vector<Sighting>& sightings) {
  if (!service.gone) {
    service.gone = now;
    sightings.push_back({why, service, {}});
  }
}

void lose(SeenSubscription& subscription, Kind why, TimePoint now, std::vector<Sighting>& sightings) {
  if (!subscription.gone) {
    subscription.gone = now;
    sightings.push_back({why, {}, subscription});
  }
}

/// The sender's SD endpoint, if the message names it; the sender may have used another address.
/// [feat_req_someipsd_1151]
Endpoint peer_of(const sd::SdMessage& message, const Endpoint& from) {
  const auto first = message.option(0);
  const auto endpoint = first ? sd::EndpointOption::decode(*first) : tl::unexpected{sd::WireError::bad_value};
  return endpoint && endpoint->role == sd::EndpointRole::sd ? endpoint->endpoint : from;
}

}  // namespace

const char* to_string(Kind kind) noexcept {
  constexpr std::array names{"offered",    "changed",    "stopped",      "expired", "rebooted",
                             "looked_for", "subscribed", "acknowledged", "refused", "unsubscribed"};
  return names[static_cast<std::size_t>(kind)];
}

const char* to_string(SeenSubscription::State state) noexcept {
  constexpr std::array names{"asked", "acknowledged", "refused"};
  return names[static_cast<std::size_t>(state)];
}

double SeenService::rate() const {
  const std::chrono::duration<double> time = last_seen - first_seen;
  return offers < 2 || time.count() <= 0 ? 0 : static_cast<double>(offers - 1) / time.count();
}

TimePoint SeenService::expires() const {
  return last_seen + std::chrono::seconds{ttl_s};
}

void NetworkView::on_datagram(ByteView datagram, const Endpoint& from, const Endpoint& to, TimePoint now,
                              std::vector<Sighting>& sightings) {
  someip::MessageCursor cursor{datagram};
  while (const auto message = cursor.next()) {
    on_message(*message, from, to, now, sightings);
  }
  if (cursor.error()) {
    ++counters_.malformed;
  }
}

void NetworkView::on_message(const someip::Message& message, const Endpoint& from, const Endpoint& to,
                             TimePoint now, std::vector<Sighting>& sightings) {
  const auto decoded = sd::decode(message);
  if (!decoded) {
    ++counters_.malformed;
    return;
  }
  ++counters_.messages;
  const Endpoint peer = peer_of(*decoded, from);
  on_session(peer, to, message.header.session, decoded->reboot(), now, sightings);
  for (std::size_t at = 0; at < decoded->entry_count(); ++at) {
    on_entry(*decoded, decoded->entry(at), peer, to, now, sightings);
  }
}

void NetworkView::on_session(const Endpoint& peer, const Endpoint& to, someip::SessionId session, bool reboot,
                             TimePoint now, std::vector<Sighting>& sightings) {
  const std::pair key{peer, to};
  if (sessions_.size() >= limit_ && !sessions_.contains(key)) {
    return;
  }
  constexpr auto channel = sd::RebootDetector::Channel::unicast;  // there is one detector for each receiver
  if (sessions_[key].shows_reboot(channel, session, reboot)) {
    // All its session counters began anew; this must not be taken for further reboots.
    std::erase_if(sessions_, [&](const auto& one) { return one.first.first == peer; });
    for (auto& [service_key, service] : services_) {
      if (service.peer == peer) {
        lose(service, Kind::rebooted, now, sightings);
      }
    }
    for (auto& [subscription_key, subscription] : subscriptions_) {
      if (subscription.subscriber == peer || subscription.server == peer) {
        lose(subscription, Kind::rebooted, now, sightings);
      }
    }
  }
  sessions_[key].observe(channel, session, reboot);
}

void NetworkView::on_entry(const sd::SdMessage& message, const sd::Entry& entry, const Endpoint& peer,
                           const Endpoint& to, TimePoint now, std::vector<Sighting>& sightings) {
  SeenService service{.service = entry.service,
                      .instance = entry.instance,
                      .major = entry.major,
                      .minor = entry.minor(),
                      .peer = peer,
                      .ttl_s = entry.ttl_s,
                      .first_seen = now,
                      .last_seen = now,
                      .offers = 1};
  SeenSubscription subscription{.service = entry.service,
                                .instance = entry.instance,
                                .major = entry.major,
                                .eventgroup = entry.eventgroup(),
                                .subscriber = peer,
                                .server = to,
                                .ttl_s = entry.ttl_s,
                                .first_seen = now,
                                .last_seen = now};
  const auto key = [&](const Endpoint& subscriber, const Endpoint& server) {
    return SubscriptionKey{entry.service, entry.instance, entry.major,    entry.eventgroup(),
                           subscriber,    server,         entry.counter()};
  };
  if (to.address.is_multicast()) {
    service.last_to_all = now;
  }
  switch (entry.kind()) {
    case sd::EntryKind::offer_service:
      read_endpoints(message, entry, service);
      on_offer(service, now, sightings);
      break;
    case sd::EntryKind::stop_offer_service:
      on_stop_offer(service, now, sightings);
      break;
    case sd::EntryKind::find_service:
      sightings.push_back({Kind::looked_for, service, {}});
      break;
    case sd::EntryKind::subscribe_eventgroup:
      read_endpoints(message, entry, subscription);
      on_subscribe(key(peer, to), subscription, sightings);
      break;
    case sd::EntryKind::stop_subscribe_eventgroup:
      if (const auto known = subscriptions_.find(key(peer, to)); known != subscriptions_.end()) {
        lose(known->second, Kind::unsubscribed, now, sightings);
      }
      break;
    case sd::EntryKind::subscribe_eventgroup_ack:
    case sd::EntryKind::subscribe_eventgroup_nack:
      subscription.subscriber = to;
      subscription.server = peer;
      subscription.state = entry.kind() == sd::EntryKind::subscribe_eventgroup_ack
                               ? SeenSubscription::State::acknowledged
                               : SeenSubscription::State::refused;
      read_endpoints(message, entry, subscription, &subscription.multicast);
      on_answer(key(to, peer), subscription, sightings);
      break;
    case sd::EntryKind::unknown:
      break;
  }
}

void NetworkView::on_offer(const SeenService& offer, TimePoint now, std::vector<Sighting>& sightings) {
  const Key key{offer.service, offer.instance, offer.major, offer.peer};
  const auto known = services_.find(key);
  if (known == services_.end()) {
    if (services_.size() >= limit_) {
      ++counters_.not_kept;
      return;
    }
    services_.emplace(key, offer);
    sightings.push_back({Kind::offered, offer, {}});
    return;
  }
  SeenService& service = known->second;
  if (service.gone) {
    service = offer;
    sightings.push_back({Kind::offered, offer, {}});
    return;
  }
  const auto what = [](const SeenService& one) { return std::tie(one.minor, one.udp, one.tcp); };
  const bool changed = what(service) != what(offer);
  service.minor = offer.minor;
  service.udp = offer.udp;
  service.tcp = offer.tcp;
  service.ttl_s = offer.ttl_s;
  service.last_seen = now;
  ++service.offers;
  if (offer.last_to_all) {
    service.cycle = service.last_to_all ? std::optional{now - *service.last_to_all} : std::nullopt;
    service.last_to_all = now;
  }
  if (changed) {
    sightings.push_back({Kind::changed, service, {}});
  }
}

void NetworkView::on_stop_offer(const SeenService& offer, TimePoint now, std::vector<Sighting>& sightings) {
  const auto known = services_.find({offer.service, offer.instance, offer.major, offer.peer});
  if (known != services_.end()) {
    lose(known->second, Kind::stopped, now, sightings);
  }
  // Subscriptions to it end as well; nothing needs to be sent for that.  [feat_req_someipsd_830]
  for (auto& [key, subscription] : subscriptions_) {
    const bool of_it = subscription.server == offer.peer && subscription.service == offer.service &&
                       subscription.instance == offer.instance && subscription.major == offer.major;
    if (of_it && !subscription.gone) {
      subscription.gone = now;
    }
  }
}

SeenSubscription* NetworkView::subscription_of(const SubscriptionKey& key) {
  if (const auto known = subscriptions_.find(key); known != subscriptions_.end()) {
    return &known->second;
  }
  if (subscriptions_.size() >= limit_) {
    ++counters_.not_kept;
    return nullptr;
  }
  return &subscriptions_[key];
}

void NetworkView::on_subscribe(const SubscriptionKey& key, const SeenSubscription& wish,
                               std::vector<Sighting>& sightings) {
  const bool known = subscriptions_.contains(key);
  SeenSubscription* const seen = subscription_of(key);
  if (seen == nullptr) {
    return;
  }
  if (!known || seen->gone) {
    *seen = wish;
    sightings.push_back({Kind::subscribed, {}, *seen});
    return;
  }
  seen->udp = wish.udp;
  seen->tcp = wish.tcp;
  seen->ttl_s = wish.ttl_s;
  seen->last_seen = wish.last_seen;
}

/// An Ack, or a refusal. The request may have been missed.
void NetworkView::on_answer(const SubscriptionKey& key, const SeenSubscription& answer,
                            std::vector<Sighting>& sightings) {
  using State = SeenSubscription::State;
  const bool known = subscriptions_.contains(key);
  SeenSubscription* const seen = subscription_of(key);
  if (seen == nullptr) {
    return;
  }
  const bool news = !known || seen->state != answer.state;
  if (!known) {
    *seen = answer;
    seen->ttl_s = usual_ttl_s;  // a refusal has no TTL
  }
  seen->state = answer.state;
  seen->multicast = answer.multicast;
  seen->ttl_s = answer.state == State::acknowledged ? answer.ttl_s : seen->ttl_s;
  if (news && !seen->gone) {
    sightings.push_back(
        {answer.state == State::acknowledged ? Kind::acknowledged : Kind::refused, {}, *seen});
  }
}

void NetworkView::on_time(TimePoint now, std::vector<Sighting>& sightings) {
  const auto expired = [&](const auto& one) {
    return !one.gone && one.expires_ever() && now >= one.expires();
  };
  for (auto& [key, service] : services_) {
    if (expired(service)) {
      lose(service, Kind::expired, now, sightings);
    }
  }
  for (auto& [key, subscription] : subscriptions_) {
    if (!expired(subscription)) {
      continue;
    }
    if (subscription.state == SeenSubscription::State::refused) {
      subscription.gone = now;  // not worth a report
    } else {
      lose(subscription, Kind::expired, now, sightings);
    }
  }
}

void NetworkView::forget_gone(TimePoint since) {
  const auto long_gone = [&](const auto& one) { return one.second.gone && *one.second.gone <= since; };
  std::erase_if(services_, long_gone);
  std::erase_if(subscriptions_, long_gone);
}

}  // namespace trestle::traffic
