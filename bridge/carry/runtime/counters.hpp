#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "bridge/picture/labels.hpp"
#include "someip/wire/counters.hpp"

namespace trestle::carry {

/// One thing that was counted. Every message that the bridge does not carry is in one counter of losses.
/// Those in doubt were carried, and may be lost beyond it.
struct Counter {
  /// What the number tells.
  using Kind = someip::CounterKind;
  const char* name;
  std::uint64_t count;
  Kind kind = Kind::traffic;
  /// Whether it says nothing: a loss or doubt that there is none of.
  [[nodiscard]] bool says_nothing() const noexcept {
    return (kind == Kind::loss || kind == Kind::doubt) && count == 0;
  }
};

/// The counters of one part of the bridge: a route, or one of its networks.
struct CounterGroup {
  std::string name;
  std::vector<Counter> counters;
  Labels labels{};
};

/// Appends a counter, or adds it to the one of its name.
void add(CounterGroup& sum, const Counter& counter);
/// For for_each_counter(): adds each.
[[nodiscard]] inline auto into(CounterGroup& group) {
  return [&group](const char* name, std::uint64_t count, Counter::Kind kind) {
    add(group, Counter{name, count, kind});
  };
}
/// The same without traffic: where the group counts that in its own way.
[[nodiscard]] inline auto losses_into(CounterGroup& group) {
  return [&group](const char* name, std::uint64_t count, Counter::Kind kind) {
    if (kind != Counter::Kind::traffic) {
      add(group, Counter{name, count, kind});
    }
  };
}
/// Adds what was counted by something that has ended.
void add(CounterGroup& sum, const CounterGroup& ended);

/// "route /points: received 12, sent 11; lost: no_subscriber 1; perhaps lost: dds_overwritten 1", without a
/// line end. Losses and doubts that there are none of are left out.
[[nodiscard]] std::string to_string(const CounterGroup& group);
/// {"event":"counters","group":"route /points","labels":{"topic":"/points",...},"received":12,...}, with
/// everything; without labels if there are none.
[[nodiscard]] std::string to_json(const CounterGroup& group);

}  // namespace trestle::carry
