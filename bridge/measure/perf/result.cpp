#include "bridge/measure/perf/result.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "bridge/cli/terminal.hpp"

namespace trestle::measure::perf {

double Result::per_second() const {
  return seconds > 0 ? static_cast<double>(received) / seconds : 0;
}

double Result::megabytes_per_second() const {
  return per_second() * static_cast<double>(payload_bytes) / 1e6;
}

std::string to_text(const Result& result) {
  std::string out = fmt::format("{} by {}, {} bytes, {}\n", result.what, result.transport,
                                result.payload_bytes, result.how);
  out += fmt::format("  in {:.2f} s  sent {}   received {}   lost {}   failed {}\n", result.seconds,
                     result.sent, result.received, result.lost, result.failed);
  out += fmt::format("  rate       {:.0f} /s   {:.2f} MB/s\n", result.per_second(),
                     result.megabytes_per_second());
  const statistics::Histogram& latency = result.latency;
  const auto at = [&](double percent) { return cli::duration_text(latency.percentile(percent)); };
  out += fmt::format("  latency    min {}   p50 {}   p90 {}   p99 {}   p99.9 {}   max {}\n",
                     cli::duration_text(latency.min()), at(50), at(90), at(99), at(99.9),
                     cli::duration_text(latency.max()));
  if (result.clock_error_ns) {
    out +=
        fmt::format("             of two clocks: exact to {}\n", cli::duration_text(*result.clock_error_ns));
  }
  for (const auto& [process, cpu] : result.cpu) {
    out += fmt::format("  CPU        {}: {:.0f} % of a core, {:.0f} % of it in the kernel\n", process,
                       cpu.user_percent + cpu.system_percent,
                       100 * cpu.system_percent / std::max(cpu.user_percent + cpu.system_percent, 1e-9));
  }
  for (const auto& [name, count] : result.counters) {
    if (count > 0) {
      out += fmt::format("  {} {}\n", name, count);
    }
  }
  return out;
}

nlohmann::ordered_json to_json(const Result& result) {
  const statistics::Histogram& latency = result.latency;
  nlohmann::ordered_json out{{"what", result.what},
                             {"transport", result.transport},
                             {"how", result.how},
                             {"payload_bytes", result.payload_bytes},
                             {"seconds", result.seconds},
                             {"sent", result.sent},
                             {"received", result.received},
                             {"lost", result.lost},
                             {"failed", result.failed},
                             {"per_second", result.per_second()},
                             {"megabytes_per_second", result.megabytes_per_second()}};
  out["latency_ns"] = {{"count", latency.count()},         {"min", latency.min()},
                       {"mean", latency.mean()},           {"p50", latency.percentile(50)},
                       {"p90", latency.percentile(90)},    {"p99", latency.percentile(99)},
                       {"p999", latency.percentile(99.9)}, {"max", latency.max()}};
  if (result.clock_error_ns) {
    out["clock_error_ns"] = *result.clock_error_ns;
  }
  auto& histogram = out["histogram"] = nlohmann::ordered_json::array();
  for (const statistics::Histogram::Bucket& bucket : latency.buckets()) {
    histogram.push_back({bucket.up_to, bucket.count});
  }
  for (const auto& [process, cpu] : result.cpu) {
    out["cpu_percent"][process] = {{"user", cpu.user_percent}, {"system", cpu.system_percent}};
  }
  for (const auto& [name, count] : result.counters) {
    out["counters"][name] = count;
  }
  return out;
}

}  // namespace trestle::measure::perf
