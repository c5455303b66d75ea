#pragma once
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "bridge/statistics/histogram.hpp"

namespace trestle::measure::perf {

/// CPU time of a process while it was measured.
struct CpuTime {
  double user_percent = 0;  ///< of one core
  double system_percent = 0;
};

/// What was measured.
struct Result {
  std::string what;       ///< "calls", "events", "bridge"
  std::string transport;  ///< "udp", "tcp", "dds"
  std::string how;        ///< in words: "1 in flight"
  std::uint64_t payload_bytes = 0;
  double seconds = 0;
  std::uint64_t sent = 0;      ///< equals received + lost + failed
  std::uint64_t received = 0;  ///< answers, or events; with a latency each
  std::uint64_t lost = 0;
  std::uint64_t failed = 0;  ///< answered with an error
  statistics::Histogram latency{};
  /// Of events: how exact latencies are, as the two clocks had to be compared; nothing: it is one clock.
  std::optional<std::int64_t> clock_error_ns{};
  std::map<std::string, CpuTime> cpu{};  ///< by process: "client", "server"; "this_end" of a bridge
  std::map<std::string, std::uint64_t> counters{};  ///< of the Node

  [[nodiscard]] double per_second() const;
  [[nodiscard]] double megabytes_per_second() const;  ///< of 10^6 bytes of payload
};

/// A few lines for people.
[[nodiscard]] std::string to_text(const Result& result);
/// docs/tools.md describes it.
[[nodiscard]] nlohmann::ordered_json to_json(const Result& result);
/// A drawing of latency over percentile, SVG.
[[nodiscard]] std::string to_svg(const Result& result);

}  // namespace trestle::measure::perf
