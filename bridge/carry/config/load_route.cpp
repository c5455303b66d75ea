#include "bridge/carry/config/elements.hpp"
#include "bridge/carry/config/load_access.hpp"
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
  const bool has_port = multicast.require("port", port_number(), settings.group.port);
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
  return documents::text_that("a topic such as /sensing/points (absolute; letters, digits, '_')",
                              messages::is_topic_name, messages::topic_name_pattern);
}

documents::Format<std::string> type_name() {
  return documents::text_that("a message type such as sensor_msgs/msg/PointCloud2", messages::is_type_name,
                              messages::name_pattern("msg"));
}

documents::Format<Direction> direction() {
  return documents::one_of<Direction>(
      {{"dds_to_someip", Direction::dds_to_someip}, {"someip_to_dds", Direction::someip_to_dds}});
}

documents::Format<std::uint16_t> port_number() {
  return documents::as<std::uint16_t>(documents::whole_number(1, 65535));
}

documents::Format<someip::ServiceId> service_id() {
  return id_of<someip::ServiceId>(0x0001, 0xfffd);
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
      "a multiple of 16 from 16 to 1392 (bytes)",
      [](std::string_view text) -> std::optional<std::size_t> {
        const auto bytes = documents::read_whole(text);
        // [feat_req_someiptp_772]
        return bytes && *bytes >= 16 && *bytes <= segment_bytes_max && *bytes % 16 == 0
                   ? std::optional{static_cast<std::size_t>(*bytes)}
                   : std::nullopt;
      },
      {.kind = documents::Shape::Kind::number, .min = 16, .max = segment_bytes_max}};
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

void load_version(Element& element, bool asked_for, std::uint8_t& major, std::uint32_t& minor) {
  // 0xff is "any major version", which nothing here can have: conversion depends on it.
  element.read("major", documents::as<std::uint8_t>(documents::whole_number(0, 254)), major);
  auto format = documents::as<std::uint32_t>(documents::whole_number(0, sd::any_minor - 1));
  if (asked_for) {
    minor = sd::any_minor;
    format.expected += ", or any";
    format.shape.words = {"any"};
    format.read = [number = std::move(format.read)](std::string_view text) {
      return text == "any" ? std::optional{sd::any_minor} : number(text);
    };
  }
  element.read("minor", format, minor);
  element.note("major");
  element.note("minor");
}

void load_carriage(Element& element, Route& route, documents::Problems& problems) {
  // The port of a service is part of its offer, so it is required; that of a client is not.
  if (route.direction == Direction::dds_to_someip && element.has("direction")) {
    element.require("port", port_number(), route.port);
  } else {
    element.read_good("port", port_number(), route.port);
  }
  // Where the direction has an error, `minor` is judged as either allows: the interfaces may have put it
  // there.
  load_version(element, route.direction == Direction::someip_to_dds || !element.has("direction"), route.major,
               route.minor);
  if (const YAML::Node wire = element.child("wire")) {
    messages::load_wire(wire, route.rules, problems);
  }
  if (const YAML::Node tp = element.child("tp")) {
    load_tp(tp, route.tp, problems);
  }
  if (load_peers(element, route.peers, problems)) {
    element.note("peers");
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

void load_from_bridges(documents::Section& section, bool is_right, const std::string& whom,
                       std::vector<IpAddress>& into, documents::Problems& problems) {
  constexpr std::size_t most = 8;  // discovery announces them with each reader and writer
  std::vector<documents::Mark> marks;
  section.read_list("from_bridges", documents::ip_address(), into, marks);
  if (section.is_missing("from_bridges")) {
    return;
  }
  if (!is_right) {
    problems.error(section.use_mark("from_bridges"), "from_bridges: is for " + whom);
  } else if (into.size() > most) {
    problems.error(section.use_mark("from_bridges"), "from_bridges: has room for 8 addresses");
  }
}

void load_multicast(Element& element, Route& route, documents::Problems& problems) {
  if (const YAML::Node node = element.child("multicast")) {
    load_group(node, route, element.has("direction"), element.use_mark("multicast"), route.multicast,
               problems);
    element.note("multicast");
  }
}

RouteInFile load_route(const YAML::Node& node, documents::Problems& problems) {
  RouteInFile result;
  Route& route = result.route;
  Element element{node, "route", result.good, problems};
  route.mark = element.mark();
  element.require("topic", topic_name(), route.topic);
  element.require("type", type_name(), route.type);
  result.type_mark = element.value_mark("type");
  load_map(element, route.mapping, problems);
  const bool has_direction = element.require("direction", direction(), route.direction);
  const auto known = has_direction ? std::optional{route.direction} : std::nullopt;
  element.require("service", service_id(), route.service);
  element.require("instance", id_of<someip::InstanceId>(), route.instance);
  element.require("eventgroup", id_of<someip::EventgroupId>(), route.eventgroup);
  if (element.require("event", id_of<someip::MethodId>(), route.event)) {
    check_event_id(element, route.event, problems);
  }

  load_carriage(element, route, problems);
  const bool outbound = known == Direction::dds_to_someip;
  route.qos.reliability_as_published = outbound;
  route.qos.durability_as_published = outbound;
  if (const YAML::Node qos = element.child("qos")) {
    load_qos(qos, route.qos, outbound || !has_direction, problems);
  }
  load_transport(element,
                 documents::one_of<Transport>(
                     {{"udp", Transport::udp},
                      {"tcp", Transport::tcp},
                      {"by_reliability", route.qos.reliable ? Transport::tcp : Transport::udp}}),
                 route, problems);
  load_multicast(element, route, problems);
  if (route.multicast && route.multicast->threshold == 1) {
    route.qos.durability_as_published = false;  // a field would also need unicast to subscribers
  }
  if (const YAML::Node e2e = element.child("e2e")) {
    route.e2e = load_e2e(e2e, known, problems);
  }
  load_presence(element, known, route.presence, problems);
  load_from_bridges(element, outbound || !has_direction, "routes with direction: dds_to_someip",
                    route.from_bridges, problems);
  element.finish();
  return result;
}

}  // namespace trestle::carry
