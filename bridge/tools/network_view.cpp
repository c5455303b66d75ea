#include "bridge/tools/network_view.hpp"

#include <tuple>

namespace trestle::bridge {
namespace {

using Kind = Sighting::Kind;

/// The endpoints among the options of an entry, the first of each transport.
void read_endpoints(const sd::SdMessage& message, const sd::Entry& entry, SeenService& service) {
  for (std::size_t at = 0; at < entry.option_count(); ++at) {
    const auto option = message.option_of(entry, at);
    const auto endpoint = option ? sd::EndpointOption::decode(*option) : tl::unexpected{option.error()};
    if (endpoint && endpoint->role == sd::EndpointRole::unicast) {
      auto& place = endpoint->transport == Transport::tcp ? service.tcp : service.udp;
      place = place ? place : endpoint->endpoint;
    }
  }
}

/// The sender's SD endpoint, if it stands in the message; it may be behind another address.
/// [feat_req_someipsd_1151]
Endpoint peer_of(const sd::SdMessage& message, const Endpoint& from) {
  const auto first = message.option(0);
  const auto endpoint = first ? sd::EndpointOption::decode(*first) : tl::unexpected{sd::WireError::bad_value};
  return endpoint && endpoint->role == sd::EndpointRole::sd ? endpoint->endpoint : from;
}

}  // namespace

const char* to_string(Kind kind) noexcept {
  switch (kind) {
    case Kind::offered:
      return "offered";
    case Kind::changed:
      return "changed";
    case Kind::stopped:
      return "stopped";
    case Kind::expired:
      return "expired";
    case Kind::rebooted:
      return "rebooted";
    case Kind::looked_for:
      return "looked_for";
    case Kind::subscribed:
      return "subscribed";
    case Kind::unsubscribed:
      break;
  }
  return "unsubscribed";
}

double SeenService::rate() const {
  const std::chrono::duration<double> time = last_seen - first_seen;
  return offers < 2 || time.count() <= 0 ? 0 : static_cast<double>(offers - 1) / time.count();
}

TimePoint SeenService::expires() const {
  return last_seen + std::chrono::seconds{ttl_s};
}

void NetworkView::on_datagram(ByteView datagram, const Endpoint& from, bool multicast, TimePoint now,
                              std::vector<Sighting>& sightings) {
  someip::MessageCursor cursor{datagram};
  while (const auto message = cursor.next()) {
    on_message(*message, from, multicast, now, sightings);
  }
  if (cursor.error()) {
    ++counters_.malformed;
  }
}

void NetworkView::on_message(const someip::Message& message, const Endpoint& from, bool multicast,
                             TimePoint now, std::vector<Sighting>& sightings) {
  const auto decoded = sd::decode(message);
  if (!decoded) {
    ++counters_.malformed;
    return;
  }
  ++counters_.messages;
  const Endpoint peer = peer_of(*decoded, from);
  if (peers_.size() < max_services_ || peers_.contains(peer)) {
    using Channel = sd::RebootDetector::Channel;
    sd::RebootDetector& detector = peers_[peer];
    const Channel channel = multicast ? Channel::multicast : Channel::unicast;
    if (detector.shows_reboot(channel, message.header.session, decoded->reboot())) {
      on_reboot(peer, now, sightings);
    }
    detector.observe(channel, message.header.session, decoded->reboot());
  }
  for (std::size_t at = 0; at < decoded->entry_count(); ++at) {
    const sd::Entry entry = decoded->entry(at);
    SeenService service{.service = entry.service,
                        .instance = entry.instance,
                        .major = entry.major,
                        .minor = entry.minor(),
                        .peer = peer,
                        .ttl_s = entry.ttl_s,
                        .first_seen = now,
                        .last_seen = now,
                        .offers = 1};
    read_endpoints(*decoded, entry, service);
    const auto tell = [&](Kind kind) {
      service.minor = 0;  // where an eventgroup stands
      sightings.push_back({kind, service, entry.eventgroup()});
    };
    switch (entry.kind()) {
      case sd::EntryKind::offer_service:
        on_offer(service, now, sightings);
        break;
      case sd::EntryKind::stop_offer_service: {
        const auto known = services_.find({service.service, service.instance, service.major, peer});
        if (known != services_.end()) {
          lose(known->second, Kind::stopped, now, sightings);
        }
        break;
      }
      case sd::EntryKind::find_service:
        sightings.push_back({Kind::looked_for, service, {}});
        break;
      case sd::EntryKind::subscribe_eventgroup:
        tell(Kind::subscribed);
        break;
      case sd::EntryKind::stop_subscribe_eventgroup:
        tell(Kind::unsubscribed);
        break;
      case sd::EntryKind::subscribe_eventgroup_ack:
      case sd::EntryKind::subscribe_eventgroup_nack:
      case sd::EntryKind::unknown:
        break;
    }
  }
}

void NetworkView::on_offer(const SeenService& offer, TimePoint now, std::vector<Sighting>& sightings) {
  const Key key{offer.service, offer.instance, offer.major, offer.peer};
  const auto known = services_.find(key);
  if (known == services_.end()) {
    if (services_.size() >= max_services_) {
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
  if (changed) {
    sightings.push_back({Kind::changed, service, {}});
  }
}

void NetworkView::on_reboot(const Endpoint& peer, TimePoint now, std::vector<Sighting>& sightings) {
  for (auto& [key, service] : services_) {
    if (service.peer == peer) {
      lose(service, Kind::rebooted, now, sightings);
    }
  }
}

void NetworkView::on_time(TimePoint now, std::vector<Sighting>& sightings) {
  for (auto& [key, service] : services_) {
    if (service.expires_ever() && now >= service.expires()) {
      lose(service, Kind::expired, now, sightings);
    }
  }
}

void NetworkView::lose(SeenService& service, Kind why, TimePoint now, std::vector<Sighting>& sightings) {
  if (!service.gone) {
    service.gone = now;
    sightings.push_back({why, service, {}});
  }
}

void NetworkView::forget_gone(TimePoint since) {
  std::erase_if(services_, [&](const auto& one) { return one.second.gone && *one.second.gone <= since; });
}

}  // namespace trestle::bridge
