#include "bridge/record/offered_qos.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cstdint>
#include <string_view>

namespace trestle::record {
namespace {

/// Longer texts of files are not read.
constexpr std::size_t max_text = std::size_t{64} << 10U;
/// RMW_DURATION_INFINITE, in seconds and nanoseconds.
constexpr std::int64_t forever_s = 9223372036;
constexpr std::int64_t forever_ns = 854775807;

// The values of rmw_qos_history_policy_t and its like.
constexpr int history_keep_all = 2;
constexpr int history_unknown = 3;
constexpr int reliable = 1;
constexpr int best_effort = 2;
constexpr int transient_local = 1;
constexpr int volatile_ = 2;
constexpr int automatic = 1;
constexpr int manual_by_topic = 3;

std::string time_text(std::chrono::nanoseconds time) {
  const std::int64_t sec = time.count() == 0 ? forever_s : time.count() / 1'000'000'000;
  const std::int64_t nsec = time.count() == 0 ? forever_ns : time.count() % 1'000'000'000;
  return fmt::format("\n    sec: {}\n    nsec: {}", sec, nsec);
}

bool is(const YAML::Node& value, int number, std::string_view word) {
  if (!value.IsScalar()) {
    return false;
  }
  return value.Scalar() == word || value.Scalar() == std::to_string(number);
}

std::chrono::nanoseconds time_of(const YAML::Node& value) {
  if (!value.IsMap()) {
    return {};
  }
  const auto sec = value["sec"].as<std::int64_t>(0);
  const auto nsec = value["nsec"].as<std::int64_t>(0);
  // Also what older distributions have for ever: 2147483647 s.
  constexpr std::int64_t longest_s = 1'000'000'000;
  if (sec < 0 || sec > longest_s || nsec < 0 || nsec >= 1'000'000'000) {
    return {};
  }
  return std::chrono::seconds{sec} + std::chrono::nanoseconds{nsec};
}

}  // namespace

std::string offered_qos(std::span<const dds::Qos> writers) {
  std::string text;
  for (const dds::Qos& qos : writers) {
    text += fmt::format(
        "- history: {}\n  depth: 0\n  reliability: {}\n  durability: {}\n  deadline:{}\n  lifespan:{}\n"
        "  liveliness: {}\n  liveliness_lease_duration:{}\n  avoid_ros_namespace_conventions: false\n",
        history_unknown, qos.reliable ? reliable : best_effort,
        qos.transient_local ? transient_local : volatile_, time_text(qos.deadline), time_text(qos.lifespan),
        qos.manual_liveliness ? manual_by_topic : automatic, time_text(qos.liveliness_lease));
  }
  return text;
}

std::vector<dds::Qos> writers_of(const std::string& text) {
  std::vector<dds::Qos> writers;
  if (text.size() > max_text) {
    return writers;
  }
  try {
    const YAML::Node all = YAML::Load(text);
    for (std::size_t i = 0; all.IsSequence() && i < all.size(); ++i) {
      const YAML::Node one = all[i];
      if (!one.IsMap()) {
        return {};
      }
      dds::Qos qos;
      qos.reliable = !one["reliability"] || !is(one["reliability"], best_effort, "best_effort");
      qos.transient_local = one["durability"] && is(one["durability"], transient_local, "transient_local");
      qos.keep_all = one["history"] && is(one["history"], history_keep_all, "keep_all");
      const auto depth = one["depth"] ? one["depth"].as<std::uint32_t>(0) : 0;
      qos.depth = depth == 0 ? qos.depth : std::min<std::uint32_t>(depth, 10'000);
      qos.deadline = one["deadline"] ? time_of(one["deadline"]) : qos.deadline;
      qos.lifespan = one["lifespan"] ? time_of(one["lifespan"]) : qos.lifespan;
      writers.push_back(qos);
    }
  } catch (const YAML::Exception&) {
    return {};
  }
  return writers;
}

dds::Qos most_of(std::span<const dds::Qos> writers) {
  dds::Qos most;
  if (writers.empty()) {
    return most;
  }
  most = {.reliable = false, .depth = 1};
  for (const dds::Qos& one : writers) {
    most.reliable |= one.reliable;
    most.transient_local |= one.transient_local && one.reliable;
    most.depth = std::max(most.depth, one.depth);
  }
  return most;
}

dds::Qos least_of(std::span<const dds::Qos> writers) {
  dds::Qos least{.reliable = true, .transient_local = true};
  for (const dds::Qos& one : writers) {
    least.reliable &= one.reliable;
    least.transient_local &= one.transient_local;
  }
  least.transient_local &= least.reliable && !writers.empty();
  return least;
}

}  // namespace trestle::record
