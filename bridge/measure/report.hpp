// bridge/measure: `trestle perf` and `trestle demo`, and what they share.
//
//   report.hpp       reports to another process through a pipe; clocks; stopping
//   point_cloud.hpp  point clouds as CDR
//   inbox.hpp        samples of DDS for a thread that waits
//   perf/            latency, rate and loss of a service or of a bridge
//   demo/            lidar clouds through two bridges, shown on a screen
//
// What it measures it starts as a program of its own: this room includes nothing of bridge/carry.
#pragma once
#include <csignal>
#include <cstdint>
#include <mutex>
#include <nlohmann/json_fwd.hpp>

#include "bridge/cli/signals.hpp"

namespace trestle::measure {

/// CLOCK_MONOTONIC in nanoseconds: the same for all processes of a host.
[[nodiscard]] std::int64_t monotonic_ns();
/// CLOCK_REALTIME in nanoseconds since 1970.
[[nodiscard]] std::int64_t realtime_ns();

/// Writes events as JSON, one a line, each with one write(). May be used by several threads.
class Report {
 public:
  explicit Report(int fd) : fd_{fd} {}
  void line(const nlohmann::json& event);
  /// Whether nobody reads any more. SIGPIPE does not come.
  [[nodiscard]] bool closed();

 private:
  int fd_;
  std::mutex mutex_;
  bool closed_ = false;
};

/// SIGINT and SIGTERM as something to wait for. Blocks them, and SIGPIPE, in this thread and all that it
/// starts.
class StopSignals {
 public:
  StopSignals();
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  /// Waits until CLOCK_MONOTONIC is `until_ns`, a signal has come, or `wake()` was called.
  /// @return true when a signal has come, now or before.
  bool wait_until(std::int64_t until_ns);
  /// Ends a wait. May be called by any thread.
  void wake() const;

 private:
  cli::Signals signals_{SIGINT, SIGTERM};
  int wakes_ = -1;
  bool stopped_ = false;
};

}  // namespace trestle::measure
