#include "bridge/carry/config/load_limits.hpp"

#include <yaml-cpp/yaml.h>

#include <array>

#include "bridge/documents/section.hpp"

namespace trestle::carry {
namespace {

constexpr std::uint64_t slots_max = 60'000;  // a table has a little less than 65535
constexpr std::uint64_t ms = 1'000'000;
constexpr std::uint64_t hour = 3'600'000 * ms;
constexpr std::uint64_t gibibyte = std::uint64_t{1} << 30U;

constexpr std::array keys{
    LimitKey{"max_peers", 1, slots_max},
    LimitKey{"max_peers_per_address", 1, slots_max},
    LimitKey{"max_remote_services", 1, slots_max},
    LimitKey{"max_subscribers", 1, slots_max},
    LimitKey{"max_subscribers_per_eventgroup", 1, slots_max},
    LimitKey{"max_subscribers_per_eventgroup_and_address", 1, slots_max},
    LimitKey{"max_offers", 1, slots_max},
    LimitKey{"max_eventgroups", 1, slots_max},
    LimitKey{"max_requirements", 1, slots_max},
    LimitKey{"max_subscriptions", 1, slots_max},
    LimitKey{"max_tcp_connections", 1, slots_max},
    LimitKey{"max_configurations", 1, slots_max},
    LimitKey{"max_configuration_bytes", 16, 1024},
    LimitKey{"max_pending_entries", 16, slots_max},
    LimitKey{"max_pending_events", 16, slots_max},
    LimitKey{"max_entries_per_second", 1, 1'000'000},
    LimitKey{"max_entries_at_once", 1, 1'000'000},
    LimitKey{"max_reboots_at_once", 1, 1000},
    LimitKey{"max_calls", 1, 32'768},
    LimitKey{"max_tcp_clients", 1, slots_max},
    LimitKey{"max_tcp_clients_per_address", 1, slots_max},
    LimitKey{"unproven_answer_bytes", 0, gibibyte * 16, LimitKey::Kind::bytes},
    LimitKey{"unproven_answer_rate", 0, gibibyte * 16, LimitKey::Kind::bytes},
    LimitKey{"max_unread_answer_bytes", 4096, gibibyte * 16, LimitKey::Kind::bytes},
    LimitKey{"max_tcp_queued_bytes", 4096, gibibyte * 16, LimitKey::Kind::bytes},
    LimitKey{"max_tcp_receive_bytes", 4096, gibibyte * 16, LimitKey::Kind::bytes},
    LimitKey{"max_reassemblies", 1, slots_max},
    LimitKey{"max_reassemblies_per_sender", 1, slots_max},
    LimitKey{"max_udp_receive_bytes", 4096, gibibyte * 16, LimitKey::Kind::bytes},
    LimitKey{"reassembly_protected_rate", 0, gibibyte, LimitKey::Kind::bytes},
    LimitKey{"reassembly_timeout", ms, hour, LimitKey::Kind::time},
    LimitKey{"tcp_message_timeout", ms, hour, LimitKey::Kind::time},
    LimitKey{"silent_after", ms, hour, LimitKey::Kind::time},
    LimitKey{"reboot_pause", 0, hour, LimitKey::Kind::time},
    LimitKey{"max_queued_bytes", 4096, gibibyte * 16, LimitKey::Kind::bytes},
    LimitKey{"max_waiting_discovery", 0, slots_max},
};

}  // namespace

std::span<const LimitKey> limit_keys() noexcept {
  return keys;
}

void load_limits(documents::Section& someip, std::map<std::string, std::uint64_t, std::less<>>& into,
                 documents::Problems& problems) {
  const YAML::Node node = someip.child("limits");
  if (!node) {
    return;
  }
  documents::Section limits{node, "limits", problems};
  for (const LimitKey& key : keys) {
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
