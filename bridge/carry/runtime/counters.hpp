#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace trestle::carry {

/// One thing that was counted. Every message that the bridge does not carry is in one counter of losses.
/// Those in doubt were carried, and may be lost beyond it.
struct Counter {
  enum class Kind : std::uint8_t { traffic, loss, doubt };
  const char* name;
  std::uint64_t count;
  Kind kind = Kind::traffic;
};

/// The counters of one part of the bridge: a route, or one of its networks.
struct CounterGroup {
  std::string name;
  std::vector<Counter> counters;
};

/// "route /points: received 12, sent 11; lost: no_subscriber 1; perhaps lost: dds_overwritten 1", without a
/// line end. Losses and doubts that there are none of are left out.
[[nodiscard]] std::string to_string(const CounterGroup& group);
/// {"event":"counters","group":"route /points","received":12,...}, with everything.
[[nodiscard]] std::string to_json(const CounterGroup& group);

}  // namespace trestle::carry
