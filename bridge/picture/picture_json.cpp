#include "bridge/picture/picture_json.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace trestle::carry {

// The names of the members are those of the JSON form.
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(QosPicture, reliable, transient_local, depth, keep_all,
                                                deadline_s, liveliness_s, manual_liveliness)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(WriterPicture, topic, type, node, qos, bridge, refused)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(OfferPicture, service, instance, major, minor, host)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(OwnOfferPicture, service, instance, major, minor, udp_port,
                                                tcp_port, offered)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(HostPicture, address, port, seen_s, offers, subscribed)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(ParticipantPicture, name, guid, addresses)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(CounterPicture, name, count, kind)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(LatencyPicture::Bucket, up_to_ns, count)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(LatencyPicture, count, min_ns, p50_ns, p90_ns, p99_ns,
                                                p999_ns, max_ns, sum_ns, buckets)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(SlowMessagePicture, at_ns, source_ns, waited_ns, convert_ns,
                                                send_ns, bytes, session)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(SomeipEndPicture, offers, wanted, subscribed, refused,
                                                over_tcp_only, other_events, other_ids, offered, subscribers)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(DdsEndPicture, qos, open, matched, incompatible_qos, writers)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(PatternEndPicture, routes, topics, brought, locked, lock_file)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(CausePicture, name, words)
NLOHMANN_JSON_SERIALIZE_ENUM(RouteState, {{RouteState::idle, "idle"},
                                          {RouteState::flowing, "flowing"},
                                          {RouteState::waiting, "waiting"},
                                          {RouteState::failing, "failing"}})
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(RoutePicture, kind, name, direction, type, service, instance,
                                                member, eventgroup, service_name, member_name,
                                                eventgroup_name, service_id_is_chosen, member_id_is_chosen,
                                                eventgroup_id_is_chosen, major, minor, transport, line,
                                                received, carried, bytes, per_second, bytes_per_second,
                                                last_ns, last_carried_ns, counters, conversion, path, slowest,
                                                someip, dds, pattern, in_use, limit, state, cause)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(SomeipPicture, address, interface, other_interface, port,
                                                discovery_received, outside_subnet, reboots, heard, hosts,
                                                offers, own_offers)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(DdsPicture, domain, guid, heard, participants, writers,
                                                not_remembered)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(LimitPicture, name, used, limit)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(CounterGroupPicture, name, counters)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE_WITH_DEFAULT(Picture, program, pid, configuration, at_ns, running_s,
                                                stopping, someip, dds, routes, limits, counters)

std::string to_json(const Picture& picture) {
  nlohmann::json json = picture;
  json["trestle"] = Picture::version;
  // Names of others in DDS may be any bytes.
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

tl::expected<Picture, std::string> picture_from_json(std::string_view text) {
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object() || !json.contains("trestle")) {
    return tl::unexpected{std::string{"this is no picture of a bridge"}};
  }
  if (json["trestle"] != Picture::version) {
    return tl::unexpected{fmt::format("it is of another version ({}) than this program knows ({})",
                                      json["trestle"].dump(), Picture::version)};
  }
  try {
    return json.get<Picture>();
  } catch (const nlohmann::json::exception& error) {
    return tl::unexpected{std::string{error.what()}};
  }
}

const char* to_string(RouteState state) noexcept {
  switch (state) {
    case RouteState::flowing:
      return "flowing";
    case RouteState::idle:
      return "idle";
    case RouteState::waiting:
      return "waiting";
    case RouteState::failing:
      return "failing";
  }
  return "";
}

}  // namespace trestle::carry
