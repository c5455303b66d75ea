#include "sd/net/checks.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "someip/net/address_text.hpp"

namespace trestle::sd {

namespace {

constexpr std::uint8_t most_dscp = 63;
constexpr std::size_t most_payload_bytes = 0xfffffff7;  // the largest payload for the Length field
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

void check(const std::vector<Subnet>& peers, const std::string& field) {
  for (const Subnet& subnet : peers) {
    at_most(subnet.address.v6 ? 128 : 32, int{subnet.prefix_bits}, (field + ".prefix_bits").c_str());
  }
}

// A rule with a mistake would allow less, or more, than was meant.
void check(const AccessControl& access) {
  check(access.peers, "access.peers");
  for (const AccessPolicy& policy : access.policies) {
    for (const AccessRule& rule : policy.rules) {
      const auto may_be = [&](Access one) {
        return rule.allow.empty() || std::ranges::find(rule.allow, one) != rule.allow.end();
      };
      check(rule.peers, "access.policies.rules.peers");
      if (rule.first_service > rule.last_service) {
        refuse("access.policies.rules.first_service", "is above last_service");
      }
      if (!rule.methods.empty() && !may_be(Access::call)) {
        refuse("access.policies.rules.methods", "are for a rule that allows calls");
      }
      if (!rule.eventgroups.empty() && !may_be(Access::subscribe)) {
        refuse("access.policies.rules.eventgroups", "are for a rule that allows subscriptions");
      }
    }
  }
}

}  // namespace

void check(const someip::TpPacing& pacing, const char* field) {
  if (const std::string mistake = mistake_in(pacing); !mistake.empty()) {
    throw std::invalid_argument{field + ("." + mistake)};
  }
}

void check(const CallSpec& spec) {
  if (spec.pacing) {
    check(*spec.pacing, "pacing");
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
  check(config.access);
  if (config.tls) {
    if (const std::string mistake = someip::mistake_in(*config.tls); !mistake.empty()) {
      refuse("tls", mistake);
    }
  }
  at_least(1, int{config.limits.max_peers}, "limits.max_peers");
  at_least(1, int{config.limits.max_pending_entries}, "limits.max_pending_entries");
  at_least(1, int{config.limits.max_pending_events}, "limits.max_pending_events");
  at_least<std::size_t>(1, config.max_message_bytes, "max_message_bytes");
  at_most(most_payload_bytes, config.max_message_bytes, "max_message_bytes");
  at_least<std::size_t>(1, config.max_queued_bytes, "max_queued_bytes");
  at_least<std::size_t>(1, config.max_reassemblies, "max_reassemblies");
  at_least<std::size_t>(1, config.max_reassemblies_per_sender, "max_reassemblies_per_sender");
  at_least<std::size_t>(1, config.max_udp_receive_bytes, "max_udp_receive_bytes");
  at_least(1, int{config.max_calls}, "max_calls");
  at_most(int{most_calls}, int{config.max_calls}, "max_calls");
  at_least(1, int{config.max_repeated_values}, "max_repeated_values");
  at_least<std::size_t>(1, config.max_tcp_clients, "max_tcp_clients");
  at_least<std::size_t>(1, config.max_tcp_clients_per_address, "max_tcp_clients_per_address");
  at_least<std::size_t>(1, config.max_tcp_receive_bytes, "max_tcp_receive_bytes");
  if (const std::string mistake = mistake_in(config.answers); !mistake.empty()) {
    throw std::invalid_argument{mistake};
  }
  if (config.gateway_to && (!config.gateway_to->address.is_multicast() || config.gateway_to->port == 0)) {
    refuse("gateway_to", someip::to_string(*config.gateway_to) + " is not a multicast endpoint");
  }
  in_order("max_withheld", "", config.max_withheld, Duration::max());
  check(config.pacing, "pacing");
  in_order("collect_for", "", config.collect_for, Duration::max());
  in_order("tcp_idle_timeout", "", config.tcp_idle_timeout, Duration::max());
  in_order("tcp_unanswered_timeout", "", config.tcp_unanswered_timeout, Duration::max());
  in_order("tcp_message_timeout", "", config.tcp_message_timeout, Duration::max());
  in_order("reassembly_timeout", "", config.reassembly_timeout, Duration::max());
  at_least(0, config.tcp_receive_buffer_bytes, "tcp_receive_buffer_bytes");
  at_least(0, config.tcp_send_buffer_bytes, "tcp_send_buffer_bytes");
  in_order("tcp_retry_min", "tcp_retry_max", config.tcp_retry_min, config.tcp_retry_max);
  if (config.tcp_retry_min == Duration::zero() || config.tcp_connect_timeout <= Duration::zero()) {
    refuse(config.tcp_retry_min == Duration::zero() ? "tcp_retry_min" : "tcp_connect_timeout",
           "must be longer than 0");
  }
  // The system takes them as milliseconds in an int.
  if (config.tcp_dead_after < std::chrono::seconds{1} ||
      config.tcp_dead_after > std::chrono::milliseconds{std::numeric_limits<int>::max()}) {
    refuse("tcp_dead_after", "must be from 1 second to 24 days");
  }
}

}  // namespace trestle::sd
