#include "bridge/config/load_route.hpp"

#include "bridge/config/format.hpp"
#include "bridge/config/load_wire.hpp"
#include "bridge/config/names.hpp"
#include "bridge/config/section.hpp"

namespace trestle::bridge {
namespace {

constexpr std::uint32_t any_minor = 0xffff'ffff;

Format<std::string> topic_name() {
  return {"a topic such as /sensing/points (absolute; letters, digits, '_')",
          [](std::string_view text) -> std::optional<std::string> {
            return is_topic_name(text) ? std::optional<std::string>{text} : std::nullopt;
          }};
}

Format<std::string> type_name() {
  return {"a message type such as sensor_msgs/msg/PointCloud2",
          [](std::string_view text) -> std::optional<std::string> {
            return is_type_name(text) ? std::optional<std::string>{text} : std::nullopt;
          }};
}

void load_tp(const YAML::Node& node, TpSettings& settings, Problems& problems) {
  constexpr std::uint32_t segment_bytes_max = 1392;  // [feat_req_someiptp_773]
  Section tp{node, "tp", problems};
  const Format<std::uint32_t> multiple_of_16{
      "a multiple of 16 from 16 to 1392 (bytes)", [](std::string_view text) -> std::optional<std::uint32_t> {
        const auto bytes = read_whole(text);
        // [feat_req_someiptp_772]
        return bytes && *bytes >= 16 && *bytes <= segment_bytes_max && *bytes % 16 == 0
                   ? std::optional{static_cast<std::uint32_t>(*bytes)}
                   : std::nullopt;
      }};
  tp.read("segment_bytes", multiple_of_16, settings.segment_bytes);
  tp.read("burst", as<std::uint32_t>(whole_number(1, 65535)), settings.burst);
  tp.read("separation", duration(Duration{0}, std::chrono::seconds{1}), settings.separation);
  tp.read("max_message", as<std::size_t>(byte_size(1024, std::uint64_t{256} << 20U)), settings.max_message);
  tp.finish();
}

void load_qos(const YAML::Node& node, QosSettings& settings, Problems& problems) {
  Section qos{node, "qos", problems};
  qos.read("reliability", one_of<bool>({{"reliable", true}, {"best_effort", false}}), settings.reliable);
  qos.read("durability", one_of<bool>({{"volatile", false}, {"transient_local", true}}),
           settings.transient_local);
  qos.read("depth", as<std::uint32_t>(whole_number(1, 10'000)), settings.depth);
  if (settings.transient_local && !settings.reliable) {
    problems.error(qos.use_mark("durability"), "durability: transient_local needs reliability: reliable");
  }
  qos.finish();
}

void load_version(Section& section, Route& route) {
  // 0xff is "any major version", which no route can have: conversion depends on it.
  section.read("major", as<std::uint8_t>(whole_number(0, 254)), route.major);
  auto minor = as<std::uint32_t>(whole_number(0, any_minor - 1));
  if (route.direction == Direction::someip_to_dds) {
    route.minor = any_minor;
    minor.expected += ", or any";
    minor.read = [number = std::move(minor.read)](std::string_view text) {
      return text == "any" ? std::optional{any_minor} : number(text);
    };
  }
  section.read("minor", minor, route.minor);
}

void load_multicast(const YAML::Node& node, const Route& route, Mark key,
                    std::optional<MulticastSettings>& into, Problems& problems) {
  MulticastSettings settings;
  Section multicast{node, "multicast", problems};
  const bool has_address = multicast.require("address", multicast_address(), settings.group.address);
  const bool has_port =
      multicast.require("port", as<std::uint16_t>(whole_number(1, 65535)), settings.group.port);
  multicast.read("threshold", as<std::size_t>(whole_number(1, 65535)), settings.threshold);
  multicast.finish();
  if (route.direction != Direction::dds_to_someip) {
    problems.error(key, "multicast: the server names the group; of a route from SOME/IP it cannot be set");
  } else if (route.transport != Transport::udp) {
    problems.error(key, "multicast: needs transport: udp");
  } else if (has_address && has_port) {
    into = settings;
  }
}

}  // namespace

RouteInFile load_route(const YAML::Node& node, Problems& problems) {
  RouteInFile result;
  Route& route = result.route;
  Section section{node, "route", problems};
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
          one_of<Direction>(
              {{"dds_to_someip", Direction::dds_to_someip}, {"someip_to_dds", Direction::someip_to_dds}}),
          route.direction);
  // [feat_req_someip_627]: 0x0000 and 0xffff name no service; 0xfffe is kept for what is not SOME/IP.
  require("service", as<someip::ServiceId>(id_number(0x0001, 0xfffd)), route.service);
  // [feat_req_someip_579]
  require("instance", as<someip::InstanceId>(id_number(0x0001, 0xfffe)), route.instance);
  require("eventgroup", as<someip::EventgroupId>(id_number(0x0001, 0xfffe)), route.eventgroup);
  require("event", as<someip::MethodId>(id_number(0x0001, 0xfffe)), route.event);
  if (result.good.contains("event") && someip::value(route.event) < 0x8000) {
    // Advice of the specification; deployments with lower ids exist.  [feat_req_someip_626]
    problems.warning(section.value_mark("event"),
                     "event: ids below 0x8000 are meant for methods; is this the one the peer uses?");
  }

  // The port of a service is part of its offer; that of a client is nobody's business.
  const auto port = as<std::uint16_t>(whole_number(1, 65535));
  if (route.direction == Direction::dds_to_someip && result.good.contains("direction")) {
    require("port", port, route.port);
  } else if (section.read("port", port, route.port)) {
    result.good.emplace("port", section.use_mark("port"));
  }
  load_version(section, route);
  result.good.emplace("major", section.use_mark("major"));
  result.good.emplace("minor", section.use_mark("minor"));
  section.read("transport", one_of<Transport>({{"udp", Transport::udp}, {"tcp", Transport::tcp}}),
               route.transport);
  if (route.transport == Transport::tcp && route.direction == Direction::someip_to_dds && route.port != 0) {
    problems.error(section.use_mark("port"),
                   "port: of a TCP connection to a server, the system chooses ours");
  }

  if (const YAML::Node wire = section.child("wire")) {
    load_wire(wire, route.rules, problems);
  }
  if (const YAML::Node multicast = section.child("multicast")) {
    load_multicast(multicast, route, section.use_mark("multicast"), route.multicast, problems);
    result.good.emplace("multicast", section.use_mark("multicast"));
  }
  if (const YAML::Node tp = section.child("tp")) {
    load_tp(tp, route.tp, problems);
  }
  if (const YAML::Node qos = section.child("qos")) {
    load_qos(qos, route.qos, problems);
  }
  section.finish();
  return result;
}

}  // namespace trestle::bridge
