#include "bridge/carry/runtime/silence_reasons.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "dds_adapter/ros_names.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::carry {
namespace {

constexpr std::size_t most_named = 4;

std::string version(std::uint8_t major, std::uint32_t minor) {
  return fmt::format("{}.{}", major, minor == any_minor ? "any" : std::to_string(minor));
}

// "a, b, c and 5 more"
template <typename Things, typename Name>
std::string list(const Things& things, Name name) {
  std::vector<std::string> names;
  for (const auto& one : things) {
    if (std::string text = name(one); std::ranges::find(names, text) == names.end()) {
      names.push_back(std::move(text));
    }
  }
  const std::size_t named = std::min(names.size(), most_named);
  return fmt::format("{}{}",
                     fmt::join(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(named), ", "),
                     names.size() > named ? fmt::format(" and {} more", names.size() - named) : "");
}

std::string service_of(const Route& route) {
  return fmt::format("0x{:04x}.0x{:04x}", value(route.service), value(route.instance));
}

bool fits(const Route& route, const sd::SeenOffer& offer) {
  return offer.instance == route.instance && offer.major == route.major &&
         (route.minor == any_minor || route.minor == offer.minor);
}

}  // namespace

SilenceReason why_silent(const Route& route, const SomeipSilence& known) {
  using Kind = SilenceReason::Kind;
  if (!known.other_interface.empty()) {
    return {Kind::other_interface, known.other_interface};
  }
  const bool is_offered =
      std::ranges::any_of(known.offers, [&](const sd::SeenOffer& one) { return fits(route, one); });
  if (!is_offered && !known.subscribed) {
    if (known.offers.empty()) {
      return {Kind::not_offered, service_of(route)};
    }
    return {Kind::offered_otherwise,
            fmt::format("{} version {} is not offered, but {}", service_of(route),
                        version(route.major, route.minor), list(known.offers, [](const sd::SeenOffer& one) {
                          return fmt::format("0x{:04x}.0x{:04x} version {} by {}", value(one.service),
                                             value(one.instance), version(one.major, one.minor),
                                             someip::to_string(one.host));
                        }))};
  }
  if (!known.subscription) {
    return {};  // until somebody reads
  }
  if (!known.subscribed) {
    return {Kind::not_subscribed,
            fmt::format("{} is offered, but {} eventgroup 0x{:04x}", service_of(route),
                        known.refused         ? "the server refuses"
                        : known.over_tcp_only ? "not over TCP; `transport: tcp` is wanted for"
                                              : "the server has not answered the subscription to",
                        value(route.eventgroup))};
  }
  if (known.others.count > 0) {
    return {Kind::other_events,
            fmt::format("of {} came event {}; the route waits for 0x{:04x}", service_of(route),
                        list(known.others.ids,
                             [](someip::MethodId id) { return fmt::format("0x{:04x}", value(id)); }),
                        value(route.event))};
  }
  return {Kind::no_event, fmt::format("eventgroup 0x{:04x} of {} is subscribed to, but no event has come",
                                      value(route.eventgroup), service_of(route))};
}

SilenceReason why_silent(const Route& route, const DdsSilence& known) {
  using Kind = SilenceReason::Kind;
  if (known.matched > 0) {
    return {Kind::no_sample, {}};
  }
  if (known.participants == 0 && known.writers.empty()) {
    return {Kind::no_participant, {}};
  }
  if (known.writers.empty()) {
    return {Kind::no_publisher, {}};
  }
  const std::string type = dds::ros_type_name(route.type);
  const auto has = [&](bool refused) {
    return std::ranges::any_of(known.writers, [&](const dds::FoundWriter& one) {
      return one.type == type && one.refused == refused;
    });
  };
  if (has(false)) {
    return {Kind::other_qos, {}};
  }
  if (has(true)) {
    return {Kind::refused_type, {}};
  }
  return {Kind::other_type, fmt::format("it is published with type {}; the route has {}",
                                        list(known.writers,
                                             [](const dds::FoundWriter& one) {
                                               return dds::type_of_ros(one.type).value_or(one.type);
                                             }),
                                        route.type)};
}

SilenceReason why_silent(const PatternSilence& known) {
  using Kind = SilenceReason::Kind;
  return {known.routes > 0         ? Kind::none
          : known.topics > 0       ? Kind::no_route
          : known.brought          ? Kind::only_bridges
          : known.participants > 0 ? Kind::no_match
                                   : Kind::no_participant,
          {}};
}

std::string in_words(const SilenceReason& reason, std::size_t routes, std::size_t heard) {
  using Kind = SilenceReason::Kind;
  const bool one = routes == 1;
  switch (reason.kind) {
    case Kind::none:
      return "nothing is amiss";
    case Kind::other_interface:
      return fmt::format("`address` {}: service discovery uses another network than the other hosts",
                         reason.details);
    case Kind::not_offered:
      return fmt::format("nobody offers {} ({} heard)", one ? reason.details : "their services",
                         heard == 0 ? "no other SOME/IP host was"
                                    : fmt::format("{} SOME/IP host{} {}", heard, heard == 1 ? "" : "s",
                                                  heard == 1 ? "was" : "were"));
    case Kind::offered_otherwise:
      return one ? reason.details : "their services are offered as other instances or in other versions";
    case Kind::not_subscribed:
      return one ? reason.details : "their services are offered, but not subscribed to";
    case Kind::other_events:
      return one ? reason.details : "events with other ids came";
    case Kind::no_event:
      return one ? reason.details : "they are subscribed, but no event has come";
    case Kind::no_participant:
      return "nobody else is in the DDS domain (`dds: {domain: ...}`, ROS_DOMAIN_ID; firewall; `interfaces`)";
    case Kind::no_publisher:
      return fmt::format("nobody publishes {} ({} participant{} in the DDS domain)", one ? "it" : "them",
                         heard, heard == 1 ? "" : "s");
    case Kind::other_type:
      return one ? reason.details : "they are published with other types";
    case Kind::refused_type:
      return "a publisher is there, but is refused: its definition of the type is another (`types: strict`)";
    case Kind::other_qos:
      return fmt::format(
          "a publisher is there, but its quality of service does not go with the route's `qos`");
    case Kind::no_sample:
      return "a publisher is there, but has published nothing since";
    case Kind::not_locked:
      return one ? reason.details : "their lock file has no topics for them";
    case Kind::no_match:
      return fmt::format("nobody publishes a topic that matches ({} participant{} in the DDS domain)", heard,
                         heard == 1 ? "" : "s");
    case Kind::only_bridges:
      return "what matches is brought in by other bridges, and not carried again";
    case Kind::no_route:
      return "topics that match are published, but none gets a route: the warnings before this say why";
  }
  return {};
}

}  // namespace trestle::carry
