#include "bridge/picture/causes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "sd/wire/entry.hpp"

namespace trestle::carry {
namespace {

constexpr std::size_t most_named = 4;
// Nothing carried for so long, though messages come, is a fault.
constexpr std::int64_t soon_ns = 2'000'000'000;

/// What a cause is told of: the details if it is true, else nothing.
using Found = std::optional<std::string>;

std::string version(std::uint32_t major, std::uint32_t minor) {
  return fmt::format("{}.{}", major, minor == sd::any_minor ? "any" : std::to_string(minor));
}

std::string count_of(std::uint64_t number, std::string_view what) {
  return fmt::format("{} {}{}", number, what, number == 1 ? "" : "s");
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

std::string service_text(const RoutePicture& route, std::uint16_t instance) {
  return route.service_name.empty() ? fmt::format("0x{:04x}.0x{:04x}", route.service, instance)
                                    : fmt::format("{}.0x{:04x}", route.service_name, instance);
}
std::string service_of(const RoutePicture& route) {
  return service_text(route, route.instance);
}
std::string with_name(std::uint16_t id, const std::string& name) {
  return name.empty() ? fmt::format("0x{:04x}", id) : fmt::format("0x{:04x} ({})", id, name);
}
std::string eventgroup_of(const RoutePicture& route) {
  return "eventgroup " + with_name(route.eventgroup, route.eventgroup_name);
}

bool is(const RoutePicture& route, std::string_view kind) {
  return route.kind == kind;
}
bool uses_service(const RoutePicture& route) {
  return is(route, "event_to_topic") || is(route, "service_to_method");
}
// Where nothing can come from, so that what is true of its other end does not matter yet.
bool is_silent(const RoutePicture& route) {
  return route.received == 0;
}

bool fits(const RoutePicture& route, const OfferPicture& offer) {
  return offer.instance == route.instance && offer.major == route.major &&
         (route.minor == sd::any_minor || route.minor == offer.minor);
}
// Somebody offers what the route wants.
bool is_offered(const RoutePicture& route) {
  return route.someip.subscribed ||
         std::ranges::any_of(route.someip.offers, [&](const OfferPicture& one) { return fits(route, one); });
}

std::string hosts_heard(const Picture& around) {
  const std::uint32_t heard = around.someip.heard;
  return heard == 0   ? "no other SOME/IP host was heard"
         : heard == 1 ? "1 SOME/IP host was heard"
                      : fmt::format("{} SOME/IP hosts were heard", heard);
}
std::string participants(const Picture& around) {
  return fmt::format("{} in DDS domain {}", count_of(around.dds.heard, "participant"), around.dds.domain);
}

// --- From SOME/IP -----------------------------------------------------------------------------------------

Found other_interface(const RoutePicture& route, const Picture& around) {
  return uses_service(route) && !around.someip.other_interface.empty() ? Found{around.someip.other_interface}
                                                                       : Found{};
}
Found outside_subnet(const RoutePicture& route, const Picture& around) {
  const SomeipPicture& someip = around.someip;
  return uses_service(route) && someip.discovery_received == 0 && someip.outside_subnet > 0 ? Found{""}
                                                                                            : Found{};
}
Found no_packet(const RoutePicture& route, const Picture& around) {
  return uses_service(route) && around.someip.discovery_received == 0 && around.someip.heard == 0 &&
                 !is_offered(route)
             ? Found{service_of(route)}
             : Found{};
}
Found not_offered(const RoutePicture& route, const Picture& /*around*/) {
  return uses_service(route) && !is_offered(route) && route.someip.offers.empty() ? Found{service_of(route)}
                                                                                  : Found{};
}
Found offered_otherwise(const RoutePicture& route, const Picture& /*around*/) {
  if (!uses_service(route) || is_offered(route)) {
    return {};
  }
  return fmt::format("{} version {} is not offered, but {}", service_of(route),
                     version(route.major, route.minor),
                     list(route.someip.offers, [&](const OfferPicture& one) {
                       return fmt::format("{} version {} by {}", service_text(route, one.instance),
                                          version(one.major, one.minor), one.host);
                     }));
}

// It is to be subscribed to, and is not.
bool lacks_subscription(const RoutePicture& route) {
  return is(route, "event_to_topic") && route.someip.wanted && !route.someip.subscribed;
}
Found refused(const RoutePicture& route, const Picture& /*around*/) {
  return lacks_subscription(route) && route.someip.refused
             ? Found{fmt::format("{} is offered, but the server refuses {}", service_of(route),
                                 eventgroup_of(route))}
             : Found{};
}
Found over_tcp_only(const RoutePicture& route, const Picture& /*around*/) {
  return lacks_subscription(route) && route.someip.over_tcp_only
             ? Found{fmt::format("{} is offered, but not over TCP; `transport: tcp` is wanted for {}",
                                 service_of(route), eventgroup_of(route))}
             : Found{};
}
Found not_acknowledged(const RoutePicture& route, const Picture& /*around*/) {
  return lacks_subscription(route)
             ? Found{fmt::format("{} is offered, but the server has not answered the subscription to {}",
                                 service_of(route), eventgroup_of(route))}
             : Found{};
}
Found other_events(const RoutePicture& route, const Picture& /*around*/) {
  if (!is(route, "event_to_topic") || !is_silent(route) || !route.someip.wanted ||
      route.someip.other_events == 0) {
    return {};
  }
  return list(route.someip.other_ids, [](std::uint16_t id) { return fmt::format("0x{:04x}", id); });
}
Found no_event(const RoutePicture& route, const Picture& /*around*/) {
  return is(route, "event_to_topic") && is_silent(route) && route.someip.wanted
             ? Found{fmt::format("{} of {} is subscribed to, but no event has come", eventgroup_of(route),
                                 service_of(route))}
             : Found{};
}
Found not_callable(const RoutePicture& route, const Picture& /*around*/) {
  return is(route, "service_to_method") && !route.dds.open
             ? Found{fmt::format("{} is offered, but {}", service_of(route),
                                 route.transport.empty() ? "by a bridge that calls this very ROS service"
                                                         : "not over " + route.transport +
                                                               ", or by a bridge that calls this very ROS "
                                                               "service")}
             : Found{};
}

// --- From DDS ---------------------------------------------------------------------------------------------

bool reads(const RoutePicture& route) {
  return is(route, "topic_to_event") && route.dds.matched == 0;
}
bool lacks_ros_server(const RoutePicture& route) {
  return is(route, "method_to_service") && !route.dds.open;
}
bool lacks_topics(const RoutePicture& route) {
  return is(route, "pattern") && route.direction == "dds_to_someip" && route.pattern.routes == 0;
}

Found no_participant(const RoutePicture& route, const Picture& around) {
  const bool needs = (reads(route) && route.dds.writers.empty()) || lacks_ros_server(route) ||
                     (lacks_topics(route) && route.pattern.topics == 0 && !route.pattern.brought);
  return needs && around.dds.heard == 0 ? Found{""} : Found{};
}
Found no_publisher(const RoutePicture& route, const Picture& /*around*/) {
  return reads(route) && route.dds.writers.empty() ? Found{""} : Found{};
}
bool has_writer(const RoutePicture& route, bool refused_ones) {
  return std::ranges::any_of(route.dds.writers, [&](const WriterPicture& one) {
    return one.type == route.type && one.refused == refused_ones;
  });
}
Found other_type(const RoutePicture& route, const Picture& /*around*/) {
  if (!reads(route) || has_writer(route, false) || has_writer(route, true)) {
    return {};
  }
  return fmt::format("it is published with type {}; the route has {}",
                     list(route.dds.writers, [](const WriterPicture& one) { return one.type; }), route.type);
}
Found refused_type(const RoutePicture& route, const Picture& /*around*/) {
  return reads(route) && !has_writer(route, false) ? Found{""} : Found{};
}

// What a writer does not offer and the route asks for, with the key that mends it; empty: all is well.
std::string lacking(const QosPicture& offered, const QosPicture& asked) {
  if (asked.reliable && !offered.reliable) {
    return "is best effort, this route asks for reliable: write `qos: {reliability: best_effort}`";
  }
  if (asked.transient_local && !offered.transient_local) {
    return "is volatile, this route asks for transient_local: write `qos: {durability: volatile}`";
  }
  if (asked.deadline_s > 0 && (offered.deadline_s == 0 || offered.deadline_s > asked.deadline_s)) {
    return fmt::format(
        "promises {}, this route asks for one within {} s: change `qos: {{deadline: ...}}`",
        offered.deadline_s == 0 ? "no deadline" : fmt::format("a sample within {} s", offered.deadline_s),
        asked.deadline_s);
  }
  if (asked.manual_liveliness && !offered.manual_liveliness) {
    return "has automatic liveliness, this route asks for manual: write `qos: {liveliness: automatic}`";
  }
  if (asked.liveliness_s > 0 && (offered.liveliness_s == 0 || offered.liveliness_s > asked.liveliness_s)) {
    return fmt::format("promises {}, this route asks for one within {} s: change the lease of its liveliness",
                       offered.liveliness_s == 0
                           ? "no sign of life"
                           : fmt::format("a sign of life within {} s", offered.liveliness_s),
                       asked.liveliness_s);
  }
  return {};
}
Found other_qos(const RoutePicture& route, const Picture& /*around*/) {
  if (!reads(route)) {
    return {};
  }
  for (const WriterPicture& one : route.dds.writers) {
    if (one.type != route.type || one.refused) {
      continue;
    }
    if (const std::string lack = lacking(one.qos, route.dds.qos); !lack.empty()) {
      return fmt::format("publisher {} {}", one.node.empty() ? "of " + one.topic : one.node, lack);
    }
  }
  return "a publisher is there, but its quality of service does not go with the route's `qos`";
}
Found no_sample(const RoutePicture& route, const Picture& /*around*/) {
  return is(route, "topic_to_event") && is_silent(route) ? Found{""} : Found{};
}
Found no_ros_server(const RoutePicture& route, const Picture& /*around*/) {
  return lacks_ros_server(route) ? Found{""} : Found{};
}

// --- Of a pattern -----------------------------------------------------------------------------------------

Found not_locked(const RoutePicture& route, const Picture& /*around*/) {
  return is(route, "pattern") && !route.pattern.locked
             ? Found{route.pattern.lock_file +
                     " has no topic that matches: copy it from the bridge at the other end, and start this "
                     "one again"}
             : Found{};
}
Found no_route(const RoutePicture& route, const Picture& /*around*/) {
  return lacks_topics(route) && route.pattern.topics > 0 ? Found{""} : Found{};
}
Found only_bridges(const RoutePicture& route, const Picture& /*around*/) {
  return lacks_topics(route) && route.pattern.brought ? Found{""} : Found{};
}
Found no_match(const RoutePicture& route, const Picture& /*around*/) {
  return lacks_topics(route) ? Found{""} : Found{};
}

// --- Messages come, and are not carried -------------------------------------------------------------------

// Messages come now, and none was carried since.
bool carries_none(const RoutePicture& route) {
  return route.received > route.carried && route.last_ns > 0 &&
         route.last_ns - route.last_carried_ns > soon_ns;
}
// A late reader of a latched topic has what was written before it came.
bool lacks_reader(const RoutePicture& route) {
  return is(route, "event_to_topic") && carries_none(route) && route.dds.matched == 0 &&
         !route.dds.qos.transient_local;
}
Found reader_qos(const RoutePicture& route, const Picture& /*around*/) {
  return lacks_reader(route) && route.dds.incompatible_qos > 0 ? Found{""} : Found{};
}
Found no_reader(const RoutePicture& route, const Picture& /*around*/) {
  return lacks_reader(route) ? Found{""} : Found{};
}
Found not_published(const RoutePicture& route, const Picture& /*around*/) {
  return is(route, "topic_to_event") && carries_none(route) && !route.someip.offered
             ? Found{fmt::format("{} is not offered: other topics of it have no publisher yet, and "
                                 "`offer: while_published` is wanted",
                                 service_of(route))}
             : Found{};
}
Found no_subscriber(const RoutePicture& route, const Picture& /*around*/) {
  return is(route, "topic_to_event") && carries_none(route) && route.someip.subscribers == 0 ? Found{""}
                                                                                             : Found{};
}
// The counter that most of the messages are in that came and were not carried.
const CounterPicture* largest_loss(const RoutePicture& route) {
  // These count what did not come to the route at all.
  constexpr std::array others{"dds_own",
                              "dds_from_bridge",
                              "dds_incompatible_qos",
                              "dds_liveliness_lost",
                              "refused",
                              "dds_deadlines_missed",
                              "other_transport",
                              "other_version",
                              "unexpected",
                              "dds_lost",
                              "dds_rejected"};
  const CounterPicture* largest = nullptr;
  for (const CounterPicture& one : route.counters) {
    if (one.kind == "loss" && one.count > (largest == nullptr ? 0 : largest->count) &&
        std::ranges::find(others, one.name) == others.end()) {
      largest = &one;
    }
  }
  return largest;
}
Found dropped(const RoutePicture& route, const Picture& /*around*/) {
  const CounterPicture* const loss = largest_loss(route);
  return carries_none(route) && loss != nullptr ? Found{loss->name} : Found{};
}

// ----------------------------------------------------------------------------------------------------------

struct Row {
  CauseRow row;
  Found (*is_true)(const RoutePicture& route, const Picture& around);
  const char* several;  ///< in words, of several routes; null: as of one
};

constexpr std::array rows{
    Row{{Cause::other_interface, "other_interface", "the address is that of another network interface"},
        other_interface,
        nullptr},
    Row{{Cause::outside_subnet, "outside_subnet", "SOME/IP hosts are heard, but outside of our subnet"},
        outside_subnet,
        nullptr},
    Row{{Cause::no_packet, "no_packet", "no SOME/IP packet has come in since the start"}, no_packet, nullptr},
    Row{{Cause::not_offered, "not_offered", "nobody offers the service"}, not_offered, nullptr},
    Row{{Cause::offered_otherwise, "offered_otherwise", "it is offered as another instance or version"},
        offered_otherwise,
        "their services are offered as other instances or in other versions"},
    Row{{Cause::refused, "refused", "the server refuses the subscription"},
        refused,
        "their services are offered, but the servers refuse the subscriptions"},
    Row{{Cause::over_tcp_only, "over_tcp_only", "it is not offered over TCP, as the route wants"},
        over_tcp_only,
        "their services are offered, but not over TCP"},
    Row{{Cause::not_acknowledged, "not_acknowledged", "the server does not answer the subscription"},
        not_acknowledged,
        "their services are offered, but the servers have not answered the subscriptions"},
    Row{{Cause::other_events, "other_events", "only events with other ids come"},
        other_events,
        "events with other ids came"},
    Row{{Cause::no_event, "no_event", "it is subscribed to, and no event has come"},
        no_event,
        "they are subscribed, but no event has come"},
    Row{{Cause::not_callable, "not_callable", "the service is offered, but cannot be called"},
        not_callable,
        "their services are offered, but cannot be called"},
    Row{{Cause::not_locked, "not_locked", "the lock file has no topic for the pattern"},
        not_locked,
        "their lock file has no topics for them"},
    Row{{Cause::no_participant, "no_participant", "nobody else is in the DDS domain"},
        no_participant,
        nullptr},
    Row{{Cause::no_publisher, "no_publisher", "nobody publishes the topic"}, no_publisher, nullptr},
    Row{{Cause::other_type, "other_type", "the topic is published with another type"},
        other_type,
        "they are published with other types"},
    Row{{Cause::refused_type, "refused_type", "the publisher's definition of the type is another"},
        refused_type,
        nullptr},
    Row{{Cause::other_qos, "other_qos", "the publisher's quality of service does not go with the route's"},
        other_qos,
        "publishers are there, but their quality of service does not go with the routes' `qos`"},
    Row{{Cause::no_sample, "no_sample", "the publisher has published nothing"}, no_sample, nullptr},
    Row{{Cause::no_ros_server, "no_ros_server", "no ROS node answers the service"}, no_ros_server, nullptr},
    Row{{Cause::no_route, "no_route", "topics that match the pattern get no route"}, no_route, nullptr},
    Row{{Cause::only_bridges, "only_bridges", "other bridges bring in what matches the pattern"},
        only_bridges,
        nullptr},
    Row{{Cause::no_match, "no_match", "nobody publishes a topic that matches the pattern"},
        no_match,
        nullptr},
    Row{{Cause::reader_qos, "reader_qos", "readers ask for more than the route's writer offers"},
        reader_qos,
        nullptr},
    Row{{Cause::no_reader, "no_reader", "nobody reads the topic"}, no_reader, nullptr},
    Row{{Cause::not_published, "not_published", "the service waits for publishers of its other topics"},
        not_published,
        "their services wait for publishers of their other topics"},
    Row{{Cause::no_subscriber, "no_subscriber", "nobody subscribes to the eventgroup"},
        no_subscriber,
        nullptr},
    Row{{Cause::dropped, "dropped", "messages come and are dropped"}, dropped, nullptr},
};

const Row& row_of(Cause cause) {
  return *std::ranges::find(rows, cause, [](const Row& one) { return one.row.cause; });
}

// What a drop means, where its counter's name does not say it all.
std::string_view meaning_of(std::string_view counter) {
  struct Meaning {
    std::string_view counter;
    std::string_view words;
  };
  static constexpr std::array meanings{
      Meaning{"not_convertible", "their bytes are no message of the route's type under its `wire` rules"},
      Meaning{"too_large", "they are larger than `tp: {max_message: ...}` allows"},
      Meaning{"looped", "they come round in a ring of bridges"},
      Meaning{"returned", "another bridge brings back what this one has carried"},
      Meaning{"expired", "they are older than `qos: {lifespan: ...}` when they come"},
      Meaning{"unavailable", "nobody answers the service"},
      Meaning{"timed_out", "no answer comes within `timeout`"},
  };
  const auto found = std::ranges::find(meanings, counter, &Meaning::counter);
  return found == meanings.end() ? "see its counters" : found->words;
}

}  // namespace

std::span<const CauseRow> cause_rows() noexcept {
  static const auto all = [] {
    std::array<CauseRow, rows.size()> result{};
    std::ranges::transform(rows, result.begin(), &Row::row);
    return result;
  }();
  return all;
}

const char* to_string(Cause cause) noexcept {
  return cause == Cause::none ? "none" : row_of(cause).row.name;
}

Why why(const RoutePicture& route, const Picture& around) {
  if (route.per_second > 0 && !carries_none(route)) {
    return {};
  }
  for (const Row& one : rows) {
    if (Found details = one.is_true(route, around)) {
      return {one.row.cause, std::move(*details)};
    }
  }
  return {};
}

bool has_fitting_writer(const RoutePicture& route) {
  return std::ranges::any_of(route.dds.writers, [&](const WriterPicture& one) {
    return one.type == route.type && !one.refused && lacking(one.qos, route.dds.qos).empty();
  });
}

std::string in_words(const Why& why, const RoutePicture* route, const Picture& around) {
  const bool one = route != nullptr;
  if (why.cause != Cause::none && !one && row_of(why.cause).several != nullptr) {
    return row_of(why.cause).several;
  }
  const auto came = [&](std::string_view what) {
    return one ? count_of(route->received, what) : fmt::format("{}s", what);
  };
  switch (why.cause) {
    case Cause::none:
      return "nothing is amiss";
    case Cause::other_interface:
      return fmt::format("`address` {}: service discovery uses another network than the other hosts",
                         why.details);
    case Cause::outside_subnet:
      return fmt::format(
          "SOME/IP packets come from outside of the subnet of {} alone, and are not heard: is its prefix "
          "length right? `sd: {{check_subnet: false}}` hears them",
          around.someip.address);
    case Cause::no_packet:
      return fmt::format(
          "no SOME/IP packet has come in{} since the start: is multicast routed there, and UDP "
          "{} let through?",
          around.someip.interface.empty() ? " for " + around.someip.address
                                          : " on " + around.someip.interface,
          around.someip.port);
    case Cause::not_offered:
      return fmt::format("nobody offers {} ({})", one ? why.details : "their services", hosts_heard(around));
    case Cause::other_events:
      return fmt::format("{} came with id {}, the route waits for {}",
                         count_of(route->someip.other_events, "event"), why.details,
                         with_name(route->member, route->member_name));
    case Cause::no_participant:
      return fmt::format(
          "nobody else is in DDS domain {} (`dds: {{domain: ...}}`, ROS_DOMAIN_ID; firewall; "
          "`interfaces`)",
          around.dds.domain);
    case Cause::no_publisher:
      return fmt::format("nobody publishes {} ({})", one ? "it" : "them", participants(around));
    case Cause::refused_type:
      return "a publisher is there, but is refused: its definition of the type is another (`types: strict`)";
    case Cause::no_sample:
      return "a publisher is there, but has published nothing since";
    case Cause::no_ros_server:
      return fmt::format("no ROS node answers {} ({})", one ? "it as " + route->type : "them",
                         participants(around));
    case Cause::no_match:
      return fmt::format("nobody publishes a topic that matches ({})", participants(around));
    case Cause::only_bridges:
      return "what matches is brought in by other bridges, and not carried again";
    case Cause::no_route:
      return "topics that match are published, but none gets a route: the warnings before this say why";
    case Cause::reader_qos:
      return fmt::format(
          "{} came, but who wants to read the topic asks for more than the route's `qos` offers",
          came("message"));
    case Cause::no_reader:
      return fmt::format("{} came, but nobody reads the topic", came("message"));
    case Cause::no_subscriber:
      return fmt::format(
          "{} came, but nobody subscribes to {}", came("sample"),
          one ? fmt::format("{} of {} ({})", eventgroup_of(*route), service_of(*route), hosts_heard(around))
              : "their eventgroups");
    case Cause::dropped:
      return fmt::format("{} came, but none {} carried: {} ({})", came("message"),
                         one && route->carried > 0 ? "of the last ones was" : "was", meaning_of(why.details),
                         why.details);
    case Cause::offered_otherwise:
    case Cause::refused:
    case Cause::over_tcp_only:
    case Cause::not_acknowledged:
    case Cause::no_event:
    case Cause::not_callable:
    case Cause::other_type:
    case Cause::other_qos:
    case Cause::not_locked:
    case Cause::not_published:
      return why.details;
  }
  return {};
}

void explain(Picture& picture) {
  for (RoutePicture& route : picture.routes) {
    const Why found = why(route, picture);
    if (found.cause == Cause::none) {
      route.state = route.per_second > 0 ? RouteState::flowing : RouteState::idle;
      route.cause = {};
    } else {
      route.state = found.cause == Cause::dropped || found.cause == Cause::reader_qos ? RouteState::failing
                                                                                      : RouteState::waiting;
      route.cause = {to_string(found.cause), in_words(found, &route, picture)};
    }
  }
}

}  // namespace trestle::carry
