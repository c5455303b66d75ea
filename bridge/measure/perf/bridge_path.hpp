#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bridge/measure/perf/result.hpp"
#include "someip/wire/types.hpp"

namespace trestle::measure::perf {

inline constexpr std::uint32_t max_path_window = 32;

/// A way through DDS and whatever bridges are on it: samples go out on topic TOPIC/there and are awaited on
/// TOPIC/back, both sensor_msgs/msg/PointCloud2. On its far side somebody reflects them.
struct PathOptions {
  std::uint32_t domain = 0;
  std::vector<std::string> interfaces{};  ///< as in dds::ParticipantConfig
  bool shared_memory = false;             ///< beside UDP
  std::string topic = "/perf";
  std::uint32_t bytes = 65536;  ///< of the clouds' data; rounded down to whole points of 16
  std::uint32_t window = 1;     ///< clouds under way at a time, up to max_path_window
  double rate_hz = 0;           ///< clouds a second at most; 0: as many as the window allows
  Duration warm_up{};
  Duration measured{};
  Duration patience{};  ///< for the first sample to come back; and for a later one, at most a second
  std::function<void(const std::string& line)> warn{};  ///< of what may spoil the figures; empty: nobody
};

/// Sends clouds, a further one whenever there is room in the window and the rate allows it, and counts half
/// of the time until they are back as latency. What is not back after a second is lost. Blocks SIGINT and
/// SIGTERM in the calling thread; either of them ends it.
/// @return nothing when no sample came back.
/// @throws dds::DdsError
[[nodiscard]] std::optional<Result> measure_path(const PathOptions& options,
                                                 const std::function<void(const Result& result)>& progress);

/// The other side: writes to TOPIC/back what comes on TOPIC/there, until SIGINT or SIGTERM.
/// @throws dds::DdsError
void reflect(const PathOptions& options);

}  // namespace trestle::measure::perf
