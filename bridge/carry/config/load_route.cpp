#include "bridge/carry/config/load_route.hpp"

#include "bridge/carry/config/load_e2e.hpp"
#include "bridge/carry/config/load_version.hpp"
#include "bridge/documents/format.hpp"
#include "bridge/documents/section.hpp"
#include "bridge/messages/types/names.hpp"
#include "bridge/messages/values/load_wire.hpp"

namespace trestle::carry {
namespace {

void load_tp(const YAML::Node& node, TpSettings& settings, documents::Problems& problems) {
  documents::Section tp{node, "tp", problems};
  load_pacing(tp, settings);
  tp.read("max_message", message_size(), settings.max_message);
  tp.finish();
}

void load_group(const YAML::Node& node, const Route& route, bool direction_is_good, documents::Mark key,
                std::optional<MulticastSettings>& into, documents::Problems& problems) {
  MulticastSettings settings;
  documents::Section multicast{node, "multicast", problems};
  const bool has_address =
      multicast.require("address", documents::multicast_address(), settings.group.address);
  const bool has_port = multicast.require(
      "port", documents::as<std::uint16_t>(documents::whole_number(1, 65535)), settings.group.port);
  multicast.read("threshold", documents::as<std::size_t>(documents::whole_number(1, 65535)),
                 settings.threshold);
  multicast.finish();
  if (route.direction != Direction::dds_to_someip && direction_is_good) {
    problems.error(key, "multicast: the server names the group; a route from SOME/IP cannot set it");
  } else if (route.transport != Transport::udp) {
    problems.error(key, "multicast: needs transport: udp");
  } else if (has_address && has_port) {
    into = settings;
  }
}

}  // namespace

documents::Format<std::string> topic_name() {
  return {"a topic such as /sensing/points (absolute; letters, digits, '_')",
          [](std::string_view text) -> std::optional<std::string> {
            return messages::is_topic_name(text) ? std::optional<std::string>{text} : std::nullopt;
          }};
}

documents::Format<std::string> type_name() {
  return {"a message type such as sensor_msgs/msg/PointCloud2",
          [](std::string_view text) -> std::optional<std::string> {
            return messages::is_type_name(text) ? std::optional<std::string>{text} : std::nullopt;
          }};
}

documents::Format<Transport> udp_or_tcp() {
  return documents::one_of<Transport>({{"udp", Transport::udp}, {"tcp", Transport::tcp}});
}

documents::Format<bool> durability() {
  return documents::one_of<bool>({{"volatile", false}, {"transient_local", true}});
}

void check_event_id(const documents::Section& section, someip::MethodId event,
                    documents::Problems& problems) {
  // Advice of the specification; deployments with lower ids exist.  [feat_req_someip_626]
  if (someip::value(event) < 0x8000) {
    problems.warning(section.value_mark("event"),
                     "event: ids below 0x8000 are meant for methods; is this the one the peer uses?");
  }
}

documents::Format<std::size_t> message_size() {
  return documents::as<std::size_t>(documents::byte_size(1024, std::uint64_t{256} << 20U));
}

void load_pacing(documents::Section& tp, TpSettings& settings) {
  constexpr std::size_t segment_bytes_max = 1392;  // [feat_req_someiptp_773]
  const documents::Format<std::size_t> multiple_of_16{
      "a multiple of 16 from 16 to 1392 (bytes)", [](std::string_view text) -> std::optional<std::size_t> {
        const auto bytes = documents::read_whole(text);
        // [feat_req_someiptp_772]
        return bytes && *bytes >= 16 && *bytes <= segment_bytes_max && *bytes % 16 == 0
                   ? std::optional{static_cast<std::size_t>(*bytes)}
                   : std::nullopt;
      }};
  tp.read("segment_bytes", multiple_of_16, settings.segment_bytes);
  std::size_t burst = 0;
  if (tp.read("burst", documents::as<std::size_t>(documents::whole_number(1, 65535)), burst)) {
    settings.burst = burst;
  }
  tp.read("separation", documents::duration(Duration{0}, std::chrono::seconds{1}), settings.separation);
}

void load_transport(documents::Section& section, const documents::Format<Transport>& format, Route& route,
                    documents::Problems& problems) {
  section.read("transport", format, route.transport);
  if (route.transport == Transport::tcp && route.direction == Direction::someip_to_dds && route.port != 0) {
    problems.error(section.use_mark("port"),
                   "port: the system chooses our port of a TCP connection to a server");
  }
}

void load_carriage(documents::Section& section, RouteInFile& into, documents::Problems& problems) {
  Route& route = into.route;
  // The port of a service is part of its offer, so it is required; that of a client is not.
  const auto port = documents::as<std::uint16_t>(documents::whole_number(1, 65535));
  if (route.direction == Direction::dds_to_someip && into.good.contains("direction")) {
    if (section.require("port", port, route.port)) {
      into.good.emplace("port", section.use_mark("port"));
    }
  } else if (section.read("port", port, route.port)) {
    into.good.emplace("port", section.use_mark("port"));
  }
  load_version(section, route.direction == Direction::someip_to_dds, route.major, route.minor);
  into.good.emplace("major", section.use_mark("major"));
  into.good.emplace("minor", section.use_mark("minor"));
  if (const YAML::Node wire = section.child("wire")) {
    messages::load_wire(wire, route.rules, problems);
  }
  if (const YAML::Node tp = section.child("tp")) {
    load_tp(tp, route.tp, problems);
  }
}

void load_qos(const YAML::Node& node, QosSettings& settings, bool can_follow, documents::Problems& problems) {
  documents::Section qos{node, "qos", problems};
  // No value means: as published.
  const auto read = [&](const char* key, const documents::Format<std::optional<bool>>& format, bool& value,
                        bool& follows) {
    std::optional<bool> given;
    if (!qos.read(key, format, given)) {
      return;
    }
    if (!given && !can_follow) {
      problems.error(qos.value_mark(key),
                     std::string{key} + ": as_published is for direction: dds_to_someip");
    }
    follows = !given;
    value = given.value_or(value);
  };
  read("reliability",
       documents::one_of<std::optional<bool>>(
           {{"as_published", std::nullopt}, {"reliable", true}, {"best_effort", false}}),
       settings.reliable, settings.reliability_as_published);
  read("durability",
       documents::one_of<std::optional<bool>>(
           {{"as_published", std::nullopt}, {"volatile", false}, {"transient_local", true}}),
       settings.transient_local, settings.durability_as_published);
  qos.read("depth", documents::as<std::uint32_t>(documents::whole_number(1, 10'000)), settings.depth);
  qos.read("history", documents::one_of<bool>({{"keep_last", false}, {"keep_all", true}}), settings.keep_all);
  const documents::Format<Duration> time =
      documents::duration(std::chrono::milliseconds{1}, std::chrono::hours{24});
  qos.read("deadline", time, settings.deadline);
  qos.read("lifespan", time, settings.lifespan);
  qos.read("liveliness", documents::one_of<bool>({{"automatic", false}, {"manual_by_topic", true}}),
           settings.manual_liveliness);
  qos.read("liveliness_lease", time, settings.liveliness_lease);
  // Transient local implies reliable, and best effort implies volatile.
  settings.reliability_as_published = settings.reliability_as_published && !settings.transient_local;
  settings.durability_as_published = settings.durability_as_published && settings.reliable;
  if (settings.transient_local && !settings.reliable) {
    problems.error(qos.use_mark("durability"), "durability: transient_local needs reliability: reliable");
  }
  qos.finish();
}

void load_presence(documents::Section& section, std::optional<Direction> known, Presence& into,
                   documents::Problems& problems) {
  const auto read = [&](const char* key, const char* condition, Direction direction, bool& wanted) {
    if (section.read(key, documents::one_of<bool>({{"always", false}, {condition, true}}), wanted) && known &&
        *known != direction) {
      problems.error(section.use_mark(key),
                     std::string{key} + ": is for routes with direction: " + to_string(direction));
    }
  };
  read("offer", "while_published", Direction::dds_to_someip, into.offer_while_published);
  read("write", "while_offered", Direction::someip_to_dds, into.write_while_offered);
  load_subscribe(section, !known || *known == Direction::someip_to_dds,
                 "routes with direction: someip_to_dds", into, problems);
}

void load_subscribe(documents::Section& section, bool is_right, const char* whom, Presence& into,
                    documents::Problems& problems) {
  if (section.read("subscribe", documents::one_of<bool>({{"always", false}, {"while_read", true}}),
                   into.subscribe_while_read) &&
      !is_right) {
    problems.error(section.use_mark("subscribe"), std::string{"subscribe: is for "} + whom);
  }
}

void load_from_bridges(documents::Section& section, bool is_right, const char* whom,
                       std::vector<IpAddress>& into, documents::Problems& problems) {
  constexpr std::size_t most = 8;  // discovery announces them with each reader and writer
  std::vector<documents::Mark> marks;
  section.read_list("from_bridges", documents::ip_address(), into, marks);
  if (section.is_missing("from_bridges")) {
    return;
  }
  if (!is_right) {
    problems.error(section.use_mark("from_bridges"), std::string{"from_bridges: is for "} + whom);
  } else if (into.size() > most) {
    problems.error(section.use_mark("from_bridges"), "from_bridges: has room for 8 addresses");
  }
}

void load_multicast(documents::Section& section, RouteInFile& into, documents::Problems& problems) {
  if (const YAML::Node node = section.child("multicast")) {
    load_group(node, into.route, into.good.contains("direction"), section.use_mark("multicast"),
               into.route.multicast, problems);
    into.good.emplace("multicast", section.use_mark("multicast"));
  }
}

RouteInFile load_route(const YAML::Node& node, documents::Problems& problems) {
  RouteInFile result;
  Route& route = result.route;
  documents::Section section{node, "route", problems};
  route.mark = section.mark();
  const auto require = [&](const char* key, const auto& format, auto& into) {
    if (section.require(key, format, into)) {
      result.good.emplace(key, section.use_mark(key));
    }
  };

  require("topic", topic_name(), route.topic);
  require("type", type_name(), route.type);
  result.type_mark = section.value_mark("type");
  require("direction",
          documents::one_of<Direction>(
              {{"dds_to_someip", Direction::dds_to_someip}, {"someip_to_dds", Direction::someip_to_dds}}),
          route.direction);
  // [feat_req_someip_627]: 0x0000 and 0xffff name no service; 0xfffe is reserved for services that are not
  // SOME/IP.
  require("service", documents::as<someip::ServiceId>(documents::id_number(0x0001, 0xfffd)), route.service);
  // [feat_req_someip_579]
  require("instance", documents::as<someip::InstanceId>(documents::id_number(0x0001, 0xfffe)),
          route.instance);
  require("eventgroup", documents::as<someip::EventgroupId>(documents::id_number(0x0001, 0xfffe)),
          route.eventgroup);
  require("event", documents::as<someip::MethodId>(documents::id_number(0x0001, 0xfffe)), route.event);
  if (result.good.contains("event")) {
    check_event_id(section, route.event, problems);
  }

  load_carriage(section, result, problems);
  const bool outbound = result.good.contains("direction") && route.direction == Direction::dds_to_someip;
  route.qos.reliability_as_published = outbound;
  route.qos.durability_as_published = outbound;
  if (const YAML::Node qos = section.child("qos")) {
    load_qos(qos, route.qos, outbound || !result.good.contains("direction"), problems);
  }
  load_transport(section,
                 documents::one_of<Transport>(
                     {{"udp", Transport::udp},
                      {"tcp", Transport::tcp},
                      {"by_reliability", route.qos.reliable ? Transport::tcp : Transport::udp}}),
                 route, problems);
  load_multicast(section, result, problems);
  if (route.multicast && route.multicast->threshold == 1) {
    route.qos.durability_as_published = false;  // a field would also need unicast to subscribers
  }
  if (const YAML::Node e2e = section.child("e2e")) {
    route.e2e = load_e2e(
        e2e, result.good.contains("direction") ? std::optional{route.direction} : std::nullopt, problems);
  }
  load_presence(section, result.good.contains("direction") ? std::optional{route.direction} : std::nullopt,
                route.presence, problems);
  load_from_bridges(section, outbound || !result.good.contains("direction"),
                    "routes with direction: dds_to_someip", route.from_bridges, problems);
  section.finish();
  return result;
}

}  // namespace trestle::carry
