#include "bridge/carry/config/load_limits.hpp"

#include <yaml-cpp/yaml.h>

#include <array>
#include <type_traits>

#include "bridge/documents/section.hpp"
#include "sd/net/node_config.hpp"

namespace trestle::carry {
namespace {

constexpr std::uint64_t slots_max = 60'000;  // a table has a little less than 65535
constexpr std::uint64_t ms = 1'000'000;
constexpr std::uint64_t hour = 3'600'000 * ms;
constexpr std::uint64_t gibibyte = std::uint64_t{1} << 30U;
constexpr std::uint64_t bytes_max = 16 * gibibyte;

using Node = sd::NodeConfig;

template <auto... Members>
void set(Node& node, std::uint64_t limit) {
  auto& into = (node.*....*Members);
  into = static_cast<std::remove_reference_t<decltype(into)>>(limit);
}

}  // namespace

std::span<const LimitKey> limit_keys() noexcept {
  using enum LimitKey::Kind;
  using Rules = sd::DiscoveryRules;
  static constexpr auto keys = std::to_array<LimitKey>({
      {"max_peers", 1, slots_max, set<&Node::limits, &sd::Limits::max_peers>},
      {"max_peers_per_address", 1, slots_max, set<&Node::discovery, &Rules::max_peers_per_address>},
      {"max_remote_services", 1, slots_max, set<&Node::limits, &sd::Limits::max_remote_services>},
      {"max_subscribers", 1, slots_max, set<&Node::limits, &sd::Limits::max_subscribers>},
      {"max_subscribers_per_eventgroup", 1, slots_max,
       set<&Node::discovery, &Rules::max_subscribers_per_eventgroup>},
      {"max_subscribers_per_eventgroup_and_address", 1, slots_max,
       set<&Node::discovery, &Rules::max_subscribers_per_eventgroup_and_address>},
      {"max_offers", 1, slots_max, set<&Node::limits, &sd::Limits::max_offers>},
      {"max_eventgroups", 1, slots_max, set<&Node::limits, &sd::Limits::max_eventgroups>},
      {"max_requirements", 1, slots_max, set<&Node::limits, &sd::Limits::max_requirements>},
      {"max_subscriptions", 1, slots_max, set<&Node::limits, &sd::Limits::max_subscriptions>},
      {"max_tcp_connections", 1, slots_max, set<&Node::limits, &sd::Limits::max_tcp_connections>},
      {"max_configurations", 1, slots_max, set<&Node::limits, &sd::Limits::max_configurations>},
      {"max_configuration_bytes", 16, 1024, set<&Node::limits, &sd::Limits::max_configuration_bytes>},
      {"max_pending_entries", 16, slots_max, set<&Node::limits, &sd::Limits::max_pending_entries>},
      {"max_pending_events", 16, slots_max, set<&Node::limits, &sd::Limits::max_pending_events>},
      {"max_silent_hosts", 1, slots_max, set<&Node::limits, &sd::Limits::max_silent_hosts>},
      {"max_entries_per_second", 1, 1'000'000, set<&Node::discovery, &Rules::max_entries_per_second>},
      {"max_entries_at_once", 1, 1'000'000, set<&Node::discovery, &Rules::max_entries_at_once>},
      {"max_reboots_at_once", 1, 1000, set<&Node::discovery, &Rules::max_reboots_at_once>},
      {"max_calls", 1, 32'736, set<&Node::max_calls>},
      {"max_tcp_clients", 1, slots_max, set<&Node::max_tcp_clients>},
      {"max_tcp_clients_per_address", 1, slots_max, set<&Node::max_tcp_clients_per_address>},
      {"max_tcp_connects_per_second", 0, 1'000'000, set<&Node::max_tcp_connects_per_second>},
      {"max_requests_per_second", 0, 1'000'000, set<&Node::max_requests_per_second>},
      {"unproven_answer_bytes", 0, bytes_max, set<&Node::unproven_answer_bytes>, bytes},
      {"unproven_answer_rate", 0, bytes_max, set<&Node::unproven_answer_rate>, bytes},
      {"max_repeated_values", 1, slots_max, set<&Node::max_repeated_values>},
      {"max_unread_answer_bytes", 4096, bytes_max, set<&Node::max_unread_answer_bytes>, bytes},
      {"max_tcp_queued_bytes", 4096, bytes_max, set<&Node::max_tcp_queued_bytes>, bytes},
      {"max_tcp_receive_bytes", 4096, bytes_max, set<&Node::max_tcp_receive_bytes>, bytes},
      {"max_reassemblies", 1, slots_max, set<&Node::max_reassemblies>},
      {"max_reassemblies_per_sender", 1, slots_max, set<&Node::max_reassemblies_per_sender>},
      {"max_udp_receive_bytes", 4096, bytes_max, set<&Node::max_udp_receive_bytes>, bytes},
      {"reassembly_protected_rate", 0, gibibyte, set<&Node::reassembly_protected_rate>, bytes},
      {"reassembly_timeout", ms, hour, set<&Node::reassembly_timeout>, time},
      {"tcp_unanswered_timeout", ms, 24 * hour, set<&Node::tcp_unanswered_timeout>, time},
      {"tcp_dead_after", 1000 * ms, hour, set<&Node::tcp_dead_after>, time},
      {"tcp_message_timeout", ms, hour, set<&Node::tcp_message_timeout>, time},
      {"duplicate_window", 0, hour, set<&Node::discovery, &Rules::duplicate_window>, time},
      {"silent_after", ms, hour, set<&Node::discovery, &Rules::silent_after>, time},
      {"reboot_pause", 0, hour, set<&Node::discovery, &Rules::reboot_pause>, time},
      {"max_queued_bytes", 4096, bytes_max, set<&Node::max_queued_bytes>, bytes},
      {"max_waiting_discovery", 0, slots_max, set<&Node::max_waiting_discovery>},
  });
  return keys;
}

void load_limits(documents::Section& someip, std::map<std::string, std::uint64_t, std::less<>>& into,
                 documents::Problems& problems) {
  const YAML::Node node = someip.child("limits");
  if (!node) {
    return;
  }
  documents::Section limits{node, "limits", problems};
  for (const LimitKey& key : limit_keys()) {
    if (key.kind == LimitKey::Kind::time) {
      const auto time = [](std::uint64_t ns) { return Duration{static_cast<Duration::rep>(ns)}; };
      Duration value{};
      if (limits.read(key.name, documents::duration(time(key.min), time(key.max)), value)) {
        into[key.name] = static_cast<std::uint64_t>(value.count());
      }
      continue;
    }
    std::uint64_t value = 0;
    const bool is_bytes = key.kind == LimitKey::Kind::bytes;
    if (limits.read(
            key.name,
            is_bytes ? documents::byte_size(key.min, key.max) : documents::whole_number(key.min, key.max),
            value)) {
      into[key.name] = value;
    }
  }
  limits.finish();
}

}  // namespace trestle::carry
