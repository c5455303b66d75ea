#include "sd/net/checks.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "sd/net/discovery_text.hpp"
#include "someip/net/address_text.hpp"

namespace trestle::sd {

using someip::MethodId;
using someip::MethodKind;

namespace {

constexpr std::uint16_t discovery_port = 30490;
constexpr std::uint16_t first_event_id = 0x8000;
constexpr std::uint8_t most_dscp = 63;
constexpr std::size_t most_payload_bytes = 0xfffffff7;  // what the Length field can say
constexpr std::uint16_t most_calls = 0x8000;

[[noreturn]] void refuse(const std::string& field, const std::string& why) {
  throw std::invalid_argument{field + ": " + why};
}

void in_order(const char* first, const char* last, Duration from, Duration to) {
  if (from < Duration::zero()) {
    refuse(first, "a time cannot be negative");
  }
  if (from > to) {
    refuse(first, std::string{"is longer than "} + last);
  }
}

template <typename Number>
void at_least(Number least, Number number, const char* field) {
  if (number < least) {
    refuse(field, "must be at least " + std::to_string(least) + ", is " + std::to_string(number));
  }
}

template <typename Number>
void at_most(Number most, Number number, const char* field) {
  if (number > most) {
    refuse(field, "must be at most " + std::to_string(most) + ", is " + std::to_string(number));
  }
}

void check(const Timing& timing) {
  in_order("timing.initial_delay_min", "initial_delay_max", timing.initial_delay_min,
           timing.initial_delay_max);
  in_order("timing.request_response_delay_min", "request_response_delay_max",
           timing.request_response_delay_min, timing.request_response_delay_max);
  in_order("timing.repetitions_base_delay", "", timing.repetitions_base_delay, Duration::max());
  in_order("timing.cyclic_offer_delay", "", timing.cyclic_offer_delay, Duration::max());
  at_least(1U, timing.ttl_s, "timing.ttl_s");  // 0 would withdraw what is offered
  at_most(infinite_ttl_s, timing.ttl_s, "timing.ttl_s");
}

void check(const DiscoveryRules& rules, bool v6) {
  if (rules.subnet_prefix_bits) {
    at_most(v6 ? 128 : 32, int{*rules.subnet_prefix_bits}, "discovery.subnet_prefix_bits");
  }
  if (rules.sd_endpoint && rules.sd_endpoint->address.v6 != v6) {
    refuse("discovery.sd_endpoint", "is not of the IP version of the node's address");
  }
}

bool is_good(const someip::AnswerRules& rules) {
  return rules.error_type == someip::MessageType::response || rules.error_type == someip::MessageType::error;
}

bool is_for_discovery(std::uint16_t port, const NodeConfig& config) {
  return port == discovery_port || port == config.port;
}

}  // namespace

void check(const someip::TpPacing& pacing, const char* field) {
  const std::string name{field};
  const std::size_t bytes = pacing.segment_bytes;
  // [feat_req_someiptp_772] [feat_req_someiptp_773]
  if (bytes % someip::tp_unit_bytes != 0 || bytes == 0 || bytes > someip::tp_default_segment_bytes) {
    refuse(name + ".segment_bytes", "must be a multiple of 16 from 16 to 1392, is " + std::to_string(bytes));
  }
  if (pacing.burst == 0) {
    refuse(name + ".burst", "must be at least 1, is 0");
  }
  if (pacing.separation < Duration::zero()) {
    refuse(name + ".separation", "a time cannot be negative");
  }
}

void check(const NodeConfig& config) {
  if (config.address.is_unspecified() || config.address.is_multicast()) {
    refuse("address", someip::to_string(config.address) + " is not the address of an interface");
  }
  if (!config.multicast.is_multicast() || config.multicast.v6 != config.address.v6) {
    refuse("multicast", someip::to_string(config.multicast) +
                            " is not a multicast address of the IP version of the node's address");
  }
  at_least(1, int{config.port}, "port");
  at_most(int{most_dscp}, int{config.dscp}, "dscp");
  at_least(0, config.receive_buffer_bytes, "receive_buffer_bytes");
  at_least(0, config.send_buffer_bytes, "send_buffer_bytes");
  in_order("busy_poll", "1 s", config.busy_poll, std::chrono::seconds{1});
  check(config.timing);
  check(config.discovery, config.address.v6);
  at_least(1, int{config.limits.max_peers}, "limits.max_peers");
  at_least(1, int{config.limits.max_pending_entries}, "limits.max_pending_entries");
  at_least(1, int{config.limits.max_pending_events}, "limits.max_pending_events");
  at_least<std::size_t>(1, config.max_message_bytes, "max_message_bytes");
  at_most(most_payload_bytes, config.max_message_bytes, "max_message_bytes");
  at_least<std::size_t>(1, config.max_queued_bytes, "max_queued_bytes");
  at_least<std::size_t>(1, config.max_reassemblies, "max_reassemblies");
  at_least<std::size_t>(1, config.max_reassemblies_per_sender, "max_reassemblies_per_sender");
  at_least(1, int{config.max_calls}, "max_calls");
  at_most(int{most_calls}, int{config.max_calls}, "max_calls");
  at_least<std::size_t>(1, config.max_tcp_clients, "max_tcp_clients");
  at_least<std::size_t>(1, config.max_tcp_clients_per_address, "max_tcp_clients_per_address");
  if (!is_good(config.answers)) {
    refuse("answers.error_type", "must be RESPONSE or ERROR");
  }
  check(config.pacing, "pacing");
  in_order("collect_for", "", config.collect_for, Duration::max());
  in_order("tcp_message_timeout", "", config.tcp_message_timeout, Duration::max());
  in_order("reassembly_timeout", "", config.reassembly_timeout, Duration::max());
  at_least(0, config.tcp_receive_buffer_bytes, "tcp_receive_buffer_bytes");
  at_least(0, config.tcp_send_buffer_bytes, "tcp_send_buffer_bytes");
  in_order("tcp_retry_min", "tcp_retry_max", config.tcp_retry_min, config.tcp_retry_max);
  if (config.tcp_retry_min == Duration::zero() || config.tcp_connect_timeout <= Duration::zero()) {
    refuse(config.tcp_retry_min == Duration::zero() ? "tcp_retry_min" : "tcp_connect_timeout",
           "must be longer than nothing");
  }
  // The system counts them as int, in milliseconds.
  if (config.tcp_dead_after < std::chrono::seconds{1} ||
      config.tcp_dead_after > std::chrono::milliseconds{std::numeric_limits<int>::max()}) {
    refuse("tcp_dead_after", "must be from 1 second to 24 days");
  }
}

std::string mistake_in(const ServiceSpec& spec, const NodeConfig& config) {
  if (!spec.tcp_port && !spec.tcp_events.empty()) {
    return "it has TCP events but no TCP port";
  }
  if (spec.answers && !is_good(*spec.answers)) {
    return "answers.error_type must be RESPONSE or ERROR";
  }
  for (const auto& port : {spec.udp_port, spec.tcp_port}) {
    if (port && is_for_discovery(*port, config)) {  // [feat_req_someip_676]
      return "port " + std::to_string(*port) + " is for service discovery alone";
    }
  }
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
  std::vector<MethodId> all = ids;
  for (const EventgroupSpec& group : spec.eventgroups) {
    all.insert(all.end(), group.events.begin(), group.events.end());
    if (group.multicast && is_for_discovery(group.multicast->port, config)) {  // [feat_req_someip_676]
      return "eventgroup " + hexadecimal(value(group.id)) + ": port " +
             std::to_string(group.multicast->port) + " is for service discovery alone";
    }
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
  return twice == ids.end() ? "" : "id " + hexadecimal(value(*twice)) + " is used twice";
}

std::string mistake_in(const SubscribeSpec& spec, const NodeConfig& config) {
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
  return {};
}

// The specification recommends to split the ids [feat_req_someip_626], and says "should".
// [feat_req_someip_60] [feat_req_someip_67]
std::vector<std::string> doubts_about(const ServiceSpec& spec) {
  std::vector<std::string> doubts;
  const auto method = [&](MethodId id) {
    if (value(id) >= first_event_id) {
      doubts.push_back("method " + hexadecimal(value(id)) + ": ids from 0x8000 on are meant for events");
    }
  };
  const auto event = [&](MethodId id) {
    if (value(id) < first_event_id) {
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
