// bridge/measure/perf: `trestle perf`: latency, rate and loss.
//
//   perf_service.hpp  the service that is measured: its methods and events
//   server.hpp        offers it; event_source.hpp: its events
//   client.hpp        measures calls and events
//   bridge_path.hpp   measures a way through DDS and bridges
//   result.hpp        what was measured, as text, JSON and a drawing
//
// docs/tools.md describes the command and the service.
#pragma once
#include <cstdint>

#include "bridge/measure/perf/result.hpp"
#include "someip/core/tp_pacing.hpp"
#include "someip/wire/header.hpp"

/// The SOME/IP service that `trestle perf server` offers: docs/tools.md describes it for other stacks.
namespace trestle::measure::perf {

inline constexpr const char* default_service = "0x7e57.0x0001";

/// Answers with what the request carries.
inline constexpr someip::MethodId echo_method{0x0001};
/// Answers with a Status.
inline constexpr someip::MethodId status_method{0x0002};
/// Takes an EventPlan, and sends events from then on; not_ready when nobody has subscribed to them.
inline constexpr someip::MethodId start_method{0x0003};
/// Fire and forget: takes the sequence number (uint64) of the last event that has come.
inline constexpr someip::MethodId acknowledge_method{0x0004};
/// Sends no more events. Answers with a Status.
inline constexpr someip::MethodId stop_method{0x0005};

inline constexpr someip::EventgroupId udp_eventgroup{0x0001};
inline constexpr someip::EventgroupId tcp_eventgroup{0x0002};
inline constexpr someip::MethodId udp_event{0x8001};
inline constexpr someip::MethodId tcp_event{0x8002};
/// The caller subscribes to it so that the server knows how much the caller's socket can take. Its event is
/// never sent.
inline constexpr someip::EventgroupId callers_eventgroup{0x0003};
inline constexpr someip::MethodId no_event{0x8003};

/// Events begin with their sequence number from 1, and the time just before notify(), or at a fixed rate the
/// time at which they were due (Status::now_ns): uint64 each.
inline constexpr std::uint32_t min_event_bytes = 16;
inline constexpr std::uint32_t max_event_bytes = std::uint32_t{16} << 20U;

struct Status {
  std::uint64_t now_ns = 0;     ///< CLOCK_MONOTONIC
  std::uint64_t clock = 0;      ///< names that clock: equal on hosts, or in containers, that share it
  std::uint64_t user_ns = 0;    ///< CPU time of the server
  std::uint64_t system_ns = 0;  ///< likewise, in the kernel
  std::uint64_t events = 0;     ///< that were to be sent since the last start
  std::uint64_t dropped = 0;    ///< of these: not sent, as too much was waiting
};

/// How events are to be sent.
struct EventPlan {
  bool tcp = false;
  std::uint32_t bytes = 64;         ///< payload of each
  double rate_hz = 0;               ///< 0: no limit
  std::uint32_t window = 0;         ///< that may be under way, not acknowledged; 0: no limit
  std::uint32_t separation_ns = 0;  ///< from one burst of segments to the next
  std::uint16_t burst = 0;          ///< segments; 0: as many as the receiver can take
};

/// Of events, or calls.
[[nodiscard]] someip::TpPacing pacing_of(const EventPlan& plan);

/// This process's view of it, without `events` and `dropped`.
[[nodiscard]] Status own_status();
/// Of two views of one process.
[[nodiscard]] CpuTime cpu_between(const Status& before, const Status& after);

}  // namespace trestle::measure::perf
