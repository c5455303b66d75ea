#include <algorithm>
#include <array>

#include "sd/net/checks.hpp"
#include "sd/net/discovery_text.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::sd {

using someip::MethodId;
using someip::MethodKind;

namespace {

constexpr std::uint16_t discovery_port = 30490;

bool is_for_discovery(std::uint16_t port, const NodeConfig& config) {
  return port == discovery_port || port == config.port;
}

std::string no_name(const char* field, std::uint16_t id) {
  return std::string{field} + ": " + hexadecimal(id) + " names none";
}

std::string mistake_in_ttl(const std::optional<std::uint32_t>& ttl_s) {
  return !ttl_s || (*ttl_s >= 1 && *ttl_s <= infinite_ttl_s)
             ? std::string{}
             : "ttl_s: must be from 1 to 16777215, is " + std::to_string(*ttl_s);
}

// --- The description of the service -----------------------------------------------------------------------

// First the items one by one, to say which one is wrong; then all, because together they have to fit too.
std::string mistake_in_configuration(const ServiceSpec& spec, const NodeConfig& config) {
  std::vector<ConfigurationItem> items;
  std::array<std::byte, 0x200> one{};  // more than any item
  for (const ConfigurationText& item : spec.configuration) {
    items.push_back({item.key, item.value});
    if (!encode_configuration({&items.back(), 1}, one)) {
      return "configuration[" + std::to_string(items.size() - 1) +
             "]: a key is printable ASCII without '=', an item at most 255 bytes";
    }
    if (item.key == otherserv && spec.service != other_protocols) {
      return "configuration[" + std::to_string(items.size() - 1) +
             "]: otherserv is for service 0xfffe alone";  // [feat_req_someipsd_500]
    }
  }
  std::vector<std::byte> all(config.limits.max_configuration_bytes);
  const auto option = encode_configuration(items, all);
  if (!items.empty() && !option) {
    return "configuration: is longer than limits.max_configuration_bytes, " + std::to_string(all.size());
  }
  if (spec.service == other_protocols && (!option || otherserv_of(option->body).empty())) {
    return "configuration: service 0xfffe needs one item otherserv=NAME";  // [feat_req_someipsd_500]
  }
  return {};
}

std::string mistake_in_identity(const ServiceSpec& spec) {
  if (!someip::names_a_service(spec.service)) {
    return no_name("service", value(spec.service));
  }
  if (!someip::names_an_instance(spec.instance)) {
    return no_name("instance", value(spec.instance));
  }
  if (spec.major == any_major) {
    return "major: 0xff means any version, which cannot be offered";
  }
  return {};
}

std::string mistake_in_access(const ServiceSpec& spec, const NodeConfig& config) {
  if (spec.options.mac_groupcast) {
    if (spec.service != other_protocols) {  // [feat_req_someipsd_1250]
      return "options.mac_groupcast: is for service 0xfffe alone";
    }
    if (spec.options.mac_groupcast->identifier_bytes > MacGroupcastOption::max_identifier_bytes) {
      return "options.mac_groupcast.identifier_bytes: must be at most 12, is " +
             std::to_string(spec.options.mac_groupcast->identifier_bytes);
    }
  } else if (!spec.udp_port && !spec.tcp_port) {
    return "neither udp_port nor tcp_port: it cannot be reached";
  }
  if (!spec.tcp_port && !spec.tcp_events.empty()) {
    return "it has TCP events but no TCP port";
  }
  for (const auto& port : {spec.udp_port, spec.tcp_port}) {
    if (port && is_for_discovery(*port, config)) {  // [feat_req_someip_676]
      return "port " + std::to_string(*port) + " is for service discovery alone";
    }
  }
  return {};
}

// --- Its eventgroups --------------------------------------------------------------------------------------

std::string mistake_in_multicast(const Endpoint& multicast, const NodeConfig& config) {
  if (!multicast.address.is_multicast() || multicast.address.v6 != config.address.v6) {
    return "multicast: " + someip::to_string(multicast.address) +
           " is not a multicast address of the IP version of the node's address";
  }
  if (multicast.port == 0) {
    return "multicast: the port must not be 0";
  }
  if (is_for_discovery(multicast.port, config)) {  // [feat_req_someip_676]
    return "port " + std::to_string(multicast.port) + " is for service discovery alone";
  }
  return {};
}

std::string mistake_in_subscribers(const ServiceSpec& spec, const EventgroupSpec& group,
                                   const NodeConfig& config) {
  const bool tcp = !spec.udp_port || std::ranges::any_of(group.events, [&](MethodId event) {
    return std::ranges::find(spec.tcp_events, event) != spec.tcp_events.end();
  });
  if (tcp && !group.configured_subscribers.empty()) {
    return "configured_subscribers: not where events go over TCP";
  }
  for (const Endpoint& client : group.configured_subscribers) {
    if (client.port == 0 || client.address.v6 != config.address.v6 || client.address.is_multicast() ||
        client.address.is_unspecified()) {
      return "configured_subscribers: " + someip::to_string(client) +
             " is no unicast endpoint of the IP version of the node's address";
    }
  }
  return {};
}

std::string mistake_in_eventgroups(const ServiceSpec& spec, const NodeConfig& config) {
  for (auto group = spec.eventgroups.begin(); group != spec.eventgroups.end(); ++group) {
    if (!someip::names_an_eventgroup(group->id)) {
      return no_name("eventgroup", value(group->id));
    }
    std::string mistake = group->multicast ? mistake_in_multicast(*group->multicast, config) : std::string{};
    if (mistake.empty()) {
      mistake = mistake_in_subscribers(spec, *group, config);
    }
    if (std::ranges::find(spec.eventgroups.begin(), group, group->id, &EventgroupSpec::id) != group) {
      mistake = "is there twice";
    }
    if (!mistake.empty()) {
      return "eventgroup " + hexadecimal(value(group->id)) + ": " + mistake;
    }
  }
  return {};
}

// --- Its methods, fields and events -----------------------------------------------------------------------

std::string mistake_in_ids(const ServiceSpec& spec) {
  std::vector<MethodId> ids;
  std::vector<MethodId> no_events;
  for (const MethodSpec& method : spec.methods) {
    if (!method.handler || method.kind == MethodKind::unknown) {
      return "method " + hexadecimal(value(method.id)) + " has no handler or no kind";
    }
    ids.push_back(method.id);
    no_events.push_back(method.id);
  }
  for (const FieldSpec& field : spec.fields) {
    if (!field.getter && !field.setter && !field.notifier) {
      return "a field has neither getter nor setter nor notifier";
    }
    if (field.without_value == someip::ReturnCode::ok) {
      return "a field without_value must not answer ok";
    }
    for (const auto& id : {field.getter, field.setter, field.notifier}) {
      if (id) {
        ids.push_back(*id);
      }
    }
    for (const auto& id : {field.getter, field.setter}) {
      if (id) {
        no_events.push_back(*id);
      }
    }
  }
  for (const EventSpec& event : spec.events) {
    ids.push_back(event.id);
  }
  std::vector<MethodId> all = ids;
  for (const EventgroupSpec& group : spec.eventgroups) {
    all.insert(all.end(), group.events.begin(), group.events.end());
    // Methods and events share one space of ids.  [feat_req_someip_625]
    const auto both = std::ranges::find_if(
        group.events, [&](MethodId event) { return std::ranges::find(no_events, event) != no_events.end(); });
    if (both != group.events.end()) {
      return "id " + hexadecimal(value(*both)) + " is used twice: for an event and for a method";
    }
  }
  const auto reserved = std::ranges::find_if(all, is_reserved);
  if (reserved != all.end()) {
    return "id " + hexadecimal(value(*reserved)) + " is reserved";
  }
  std::ranges::sort(ids);
  const auto twice = std::ranges::adjacent_find(ids);
  return twice == ids.end() ? std::string{} : "id " + hexadecimal(value(*twice)) + " is used twice";
}

std::string mistake_in_pacing(const ServiceSpec& spec) {
  const auto mistake_of = [](const auto& one, const char* name) {
    const std::string mistake = one.pacing ? mistake_in(*one.pacing) : std::string{};
    return mistake.empty() ? mistake : name + (".pacing." + mistake);
  };
  for (const MethodSpec& method : spec.methods) {
    if (std::string mistake = mistake_of(method, "method"); !mistake.empty()) {
      return mistake;
    }
  }
  for (const FieldSpec& field : spec.fields) {
    if (std::string mistake = mistake_of(field, "field"); !mistake.empty()) {
      return mistake;
    }
  }
  return {};
}

std::string mistake_in_rules(const ServiceSpec& spec) {
  for (const FieldSpec& field : spec.fields) {
    if (field.update.cycle < Duration::zero()) {
      return "a field's update.cycle: a time cannot be negative";
    }
    if (field.notifier && !is_in_a_group(spec, *field.notifier)) {
      return "notifier " + hexadecimal(value(*field.notifier)) + " is in no eventgroup";
    }
  }
  for (const EventSpec& event : spec.events) {
    const std::string name = "event " + hexadecimal(value(event.id));
    if (event.update.cycle < Duration::zero()) {
      return name + ": update.cycle: a time cannot be negative";
    }
    if (!event.update.on_change && event.update.cycle == Duration::zero()) {
      return name + " would never be sent: update has neither on_change nor a cycle";
    }
    if (!is_in_a_group(spec, event.id)) {
      return name + " is in no eventgroup";
    }
  }
  return {};
}

// --- What is needed ---------------------------------------------------------------------------------------

/// @tparam Spec  RequireSpec or SubscribeSpec.
template <typename Spec>
std::string mistake_in_need(const Spec& spec, const NodeConfig& config) {
  if (!someip::names_a_service(spec.service)) {
    return no_name("service", value(spec.service));
  }
  if (spec.instance == someip::InstanceId{0}) {
    return no_name("instance", 0);
  }
  if ((spec.service == other_protocols) == spec.otherserv.empty()) {  // [feat_req_someipsd_503]
    return spec.otherserv.empty() ? "otherserv: service 0xfffe needs a name"
                                  : "otherserv: is for service 0xfffe alone";
  }
  const ConfigurationItem name{otherserv, spec.otherserv};
  std::vector<std::byte> room(config.limits.max_configuration_bytes);
  if (!spec.otherserv.empty() && !encode_configuration({&name, 1}, room)) {
    return "otherserv: is longer than an item or limits.max_configuration_bytes";
  }
  return {};
}

}  // namespace

bool is_in_a_group(const ServiceSpec& spec, MethodId event) {
  return std::ranges::any_of(spec.eventgroups, [event](const EventgroupSpec& group) {
    return std::ranges::find(group.events, event) != group.events.end();
  });
}

std::string mistake_in(const someip::AnswerRules& rules) {
  return rules.error_type == someip::MessageType::response || rules.error_type == someip::MessageType::error
             ? std::string{}
             : "answers.error_type: must be RESPONSE or ERROR";
}

std::string mistake_in(const someip::TpPacing& pacing) {
  const std::size_t bytes = pacing.segment_bytes;
  // [feat_req_someiptp_772] [feat_req_someiptp_773]
  if (bytes % someip::tp_unit_bytes != 0 || bytes == 0 || bytes > someip::tp_default_segment_bytes) {
    return "segment_bytes: must be a multiple of 16 from 16 to 1392, is " + std::to_string(bytes);
  }
  if (pacing.burst && *pacing.burst == 0) {
    return "burst: must be at least 1, is 0";
  }
  return pacing.separation < Duration::zero() ? "separation: a time cannot be negative" : std::string{};
}

std::string mistake_in(const ServiceSpec& spec, const NodeConfig& config) {
  for (const std::string& mistake :
       {mistake_in_identity(spec), mistake_in_access(spec, config), mistake_in_ttl(spec.ttl_s),
        spec.answers ? mistake_in(*spec.answers) : std::string{}, mistake_in_configuration(spec, config),
        mistake_in_eventgroups(spec, config), mistake_in_ids(spec), mistake_in_rules(spec),
        mistake_in_pacing(spec)}) {
    if (!mistake.empty()) {
      return mistake;
    }
  }
  return {};
}

std::string mistake_in(const RequireSpec& spec, const NodeConfig& config) {
  return mistake_in_need(spec, config);
}

std::string mistake_in(const SubscribeSpec& spec, const NodeConfig& config) {
  if (std::string mistake = mistake_in_need(spec, config); !mistake.empty()) {
    return mistake;
  }
  if (!someip::names_an_eventgroup(spec.eventgroup)) {
    return no_name("eventgroup", value(spec.eventgroup));
  }
  const auto reserved = std::ranges::find_if(spec.events, is_reserved);
  if (reserved != spec.events.end()) {
    return "event id " + hexadecimal(value(*reserved)) + " is reserved";
  }
  if (!spec.udp && !spec.tcp) {
    return "neither UDP nor TCP is asked for";
  }
  if (is_for_discovery(spec.port, config)) {  // [feat_req_someip_676]
    return "port " + std::to_string(spec.port) + " is for service discovery alone";
  }
  if (spec.configured && (spec.tcp || spec.port == 0)) {
    return "a configured one needs a UDP port of its own, and no TCP";
  }
  if (spec.silence_timeout && *spec.silence_timeout <= Duration::zero()) {
    return "silence_timeout: must be longer than 0";
  }
  return mistake_in_ttl(spec.ttl_s);
}

std::vector<std::string> doubts_about(const ServiceSpec& spec) {
  std::vector<std::string> doubts;
  const auto method = [&](MethodId id) {
    if (is_for_other_kind(id, IdKind::method)) {
      doubts.push_back("method " + hexadecimal(value(id)) + ": ids from 0x8000 on are meant for events");
    }
  };
  const auto event = [&](MethodId id) {
    if (is_for_other_kind(id, IdKind::event)) {
      doubts.push_back("event " + hexadecimal(value(id)) + ": ids below 0x8000 are meant for methods");
    }
  };
  for (const MethodSpec& one : spec.methods) {
    method(one.id);
  }
  for (const FieldSpec& field : spec.fields) {
    for (const auto& id : {field.getter, field.setter}) {
      if (id) {
        method(*id);
      }
    }
  }
  std::vector<MethodId> events;
  for (const EventgroupSpec& group : spec.eventgroups) {
    events.insert(events.end(), group.events.begin(), group.events.end());
  }
  std::ranges::sort(events);
  events.erase(std::unique(events.begin(), events.end()), events.end());
  std::ranges::for_each(events, event);
  return doubts;
}

}  // namespace trestle::sd
