#include <fmt/format.h>

#include <algorithm>

#include "bridge/conform/replay/replay.hpp"
#include "someip/net/address_text.hpp"

/// Offers and subscriptions over time: how they end, who answers, and where services are.
namespace trestle::conform {
namespace {

using sd::EntryKind;
using sd::EntryType;

std::uint32_t service_and_instance(const sd::Entry& entry) {
  return (std::uint32_t{value(entry.service)} << 16U) | value(entry.instance);
}

bool is_same_subscription(const sd::Entry& a, const sd::Entry& b) {
  return service_and_instance(a) == service_and_instance(b) && a.major == b.major &&
         a.eventgroup() == b.eventgroup() && a.counter() == b.counter();
}

/// Nothing: the option at this position is none, or it is not there.
std::optional<sd::EndpointOption> unicast_endpoint(const sd::SdMessage& message, const sd::Entry& entry,
                                                   std::size_t position) {
  const auto option = message.option_of(entry, position);
  const auto endpoint =
      option ? sd::EndpointOption::decode(*option) : tl::unexpected{someip::WireError::bad_value};
  return endpoint && endpoint->role == sd::EndpointRole::unicast ? std::optional{*endpoint} : std::nullopt;
}

}  // namespace

Replay::Options Replay::options_of(const sd::SdMessage& message, const sd::Entry& entry) {
  Options all;
  for (std::size_t position = 0; position < entry.option_count(); ++position) {
    if (const auto option = message.option_of(entry, position)) {
      std::vector<std::byte>& bytes = all.emplace_back(1, static_cast<std::byte>(option->type));
      bytes.insert(bytes.end(), option->body.begin(), option->body.end());
    }
  }
  std::ranges::sort(all);
  return all;
}

void Replay::judge_offer(const At& at, const sd::SdMessage& message, const sd::Entry& entry) {
  const OfferKey key{at.place.flow.from.address, value(entry.service), value(entry.instance), entry.major};
  const Options options = options_of(message, entry);
  if (entry.kind() == EntryKind::offer_service) {
    if (offers_.size() < most_relations) {
      Offered& known = offers_[key];
      known.minor = entry.minor();
      known.options = options;
      ++known.times;
      for (std::size_t position = 0; position < entry.option_count(); ++position) {
        const auto endpoint = unicast_endpoint(message, entry, position);
        known.udp = known.udp || (endpoint && endpoint->transport == Transport::udp);
        known.tcp = known.tcp || (endpoint && endpoint->transport == Transport::tcp);
      }
    }
    judge_places(at, message, entry);
  } else if (const auto known = offers_.find(key); known != offers_.end()) {
    const bool same = known->second.minor == entry.minor() && known->second.options == options;
    check(Rule::sd_stop_offer, at, same, "minor version and options of StopOffer", "those of the offer",
          "others");
    // Its places may be another instance's now.
    std::erase_if(places_, [&](const auto& one) {
      return std::get<0>(one.first) == at.place.flow.from.address && one.second == value(entry.instance) &&
             std::get<1>(one.first) == value(entry.service);
    });
  }
}

void Replay::judge_places(const At& at, const sd::SdMessage& message, const sd::Entry& entry) {
  for (std::size_t position = 0; position < entry.option_count(); ++position) {
    const auto endpoint = unicast_endpoint(message, entry, position);
    if (!endpoint || places_.size() >= most_relations) {
      continue;
    }
    note_served(value(entry.service), entry.major, endpoint->transport, endpoint->endpoint);
    const auto place = places_
                           .try_emplace({at.place.flow.from.address, value(entry.service), entry.major,
                                         endpoint->transport, endpoint->endpoint},
                                        value(entry.instance))
                           .first;
    check(Rule::sd_instance_endpoints, at, place->second == value(entry.instance),
          "instance at " + someip::to_string(endpoint->endpoint), fmt::format("{:#06x}", place->second),
          fmt::format("{:#06x}, too", value(entry.instance)));
  }
}

void Replay::judge_transports(const At& at, const sd::SdMessage& message, const sd::Entry& entry) {
  const auto offered =
      offers_.find({at.place.flow.to.address, value(entry.service), value(entry.instance), entry.major});
  if (offered == offers_.end()) {
    return;
  }
  const auto& [udp, tcp] = std::pair{offered->second.udp, offered->second.tcp};
  if (!udp && !tcp) {
    return;  // which is another rule
  }
  for (std::size_t position = 0; position < entry.option_count(); ++position) {
    if (const auto endpoint = unicast_endpoint(message, entry, position)) {
      const bool over_tcp = endpoint->transport == Transport::tcp;
      if (over_tcp || endpoint->transport == Transport::udp) {
        check(Rule::sd_subscribe_transport, at, over_tcp ? tcp : udp, "protocol of the subscription",
              udp && tcp ? "UDP or TCP"
              : udp      ? "UDP, over which the service is offered"
                         : "TCP, over which the service is offered",
              over_tcp ? "TCP" : "UDP");
      }
    }
  }
}

void Replay::judge_subscriber(const At& at, const sd::SdMessage& message, const sd::Entry& entry) {
  const auto& [from, to] = at.place.flow;
  for (std::size_t position = 0; position < entry.option_count(); ++position) {
    const auto endpoint = unicast_endpoint(message, entry, position);
    if (endpoint && endpoint->transport == Transport::udp && endpoint->endpoint.address == from.address &&
        endpoint->endpoint.port != 0 && subscriber_ports_.size() < most_relations) {
      Ports& ports = subscriber_ports_[{from.address, to.address, service_and_instance(entry),
                                        value(entry.eventgroup()), entry.counter()}];
      check(Rule::sd_one_subscriber, at, !ports.takes_turns(endpoint->endpoint.port),
            fmt::format("ports that subscribe to eventgroup {:#06x}", value(entry.eventgroup())),
            "1 at a time", "2 or more");
      return;
    }
  }
}

void Replay::judge_subscription(const At& at, const sd::SdMessage& message, const sd::Entry& entry) {
  const auto& [from, to] = at.place.flow;
  const EntryKind kind = entry.kind();
  const std::uint32_t ids = service_and_instance(entry);
  const SubscriptionKey own{from.address, to.address, ids, value(entry.eventgroup()), entry.counter()};
  if (kind == EntryKind::subscribe_eventgroup) {
    if (subscriptions_.size() < most_relations && !to.address.is_multicast()) {
      const auto [known, is_new] =
          subscriptions_.try_emplace(own, Subscription{.frame = at.place.frame,
                                                       .time = at.place.time,
                                                       .flow = at.place.flow,
                                                       .text = message_text(at.message)});
      known->second.ttl_s = entry.ttl_s;
      known->second.options = options_of(message, entry);
      if (is_new) {
        // A client answers each offer with a Subscribe: where it did not answer the one before, it had none.
        const auto offered =
            offers_.find({to.address, value(entry.service), value(entry.instance), entry.major});
        known->second.is_first = offered != offers_.end() && offered->second.times > 1;
      }
      subscribers_.emplace(from.address, to.address);
    }
  } else if (kind == EntryKind::stop_subscribe_eventgroup) {
    if (const auto known = subscriptions_.find(own); known != subscriptions_.end()) {
      check(Rule::sd_stop_subscribe, at, known->second.options == options_of(message, entry),
            "options of StopSubscribe", "those of the subscription", "others");
    }
  } else if (subscribers_.contains({to.address, from.address})) {
    const auto known =
        subscriptions_.find({to.address, from.address, ids, value(entry.eventgroup()), entry.counter()});
    check(Rule::sd_ack_asked, at, known != subscriptions_.end(), "subscription before it",
          "one with the same ids", "none");
    if (known != subscriptions_.end()) {
      known->second.answered = true;
      if (kind == EntryKind::subscribe_eventgroup_ack) {
        check(Rule::sd_ack_ttl, at, entry.ttl_s == known->second.ttl_s, "TTL",
              std::to_string(known->second.ttl_s), std::to_string(entry.ttl_s));
      }
    }
  }
}

void Replay::judge_pairs(const At& at, const sd::SdMessage& message) {
  std::vector<sd::Entry> stops;
  std::optional<sd::Entry> before;
  for (std::size_t index = 0; index < message.entry_count(); ++index) {
    const sd::Entry entry = message.entry(index);
    if (entry.kind() == EntryKind::stop_subscribe_eventgroup) {
      stops.push_back(entry);
    } else if (entry.kind() == EntryKind::subscribe_eventgroup &&
               std::ranges::any_of(stops,
                                   [&](const sd::Entry& one) { return is_same_subscription(one, entry); })) {
      check(Rule::sd_stop_then_subscribe, at,
            before && before->kind() == EntryKind::stop_subscribe_eventgroup &&
                is_same_subscription(*before, entry),
            "entry before the Subscribe", "the StopSubscribe of the same eventgroup", "another one");
    }
    before = entry;
  }
}

void Replay::judge_event(const At& at) {
  const auto& [from, to] = at.place.flow;
  const std::uint32_t service = std::uint32_t{value(at.message.header.service)} << 16U;
  bool any = false;
  bool acknowledged = false;
  for (auto one = subscriptions_.lower_bound({to.address, from.address, service, 0, 0});
       one != subscriptions_.end() && std::get<0>(one->first) == to.address &&
       std::get<1>(one->first) == from.address && (std::get<2>(one->first) & 0xffff'0000U) == service;
       ++one) {
    any = true;
    // What began before the capture did has been answered there.
    acknowledged = acknowledged || one->second.answered || !one->second.is_first;
  }
  if (any) {
    check(Rule::sd_event_after_ack, at, acknowledged, "event", "after the acknowledgement", "before it");
  }
}

}  // namespace trestle::conform
