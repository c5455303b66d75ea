#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace trestle::bridge {

/// One thing that was counted. Every message that the bridge does not carry is in one counter of losses.
struct Counter {
  enum class Kind : std::uint8_t { traffic, loss };
  const char* name;
  std::uint64_t count;
  Kind kind = Kind::traffic;
};

/// The counters of one part of the bridge: a route, or one of its networks.
struct CounterGroup {
  std::string name;
  std::vector<Counter> counters;
};

/// "route /points: received 12, sent 11; lost: no_subscriber 1", without a line end. Losses that did not
/// happen are left out.
[[nodiscard]] std::string to_string(const CounterGroup& group);
/// {"event":"counters","group":"route /points","received":12,...}, with everything.
[[nodiscard]] std::string to_json(const CounterGroup& group);

}  // namespace trestle::bridge
