#pragma once
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace trestle::measure::demo {

/// What to publish, where and how long.
struct PublisherOptions {
  std::uint32_t domain = 0;
  std::vector<std::string> interfaces{"127.0.0.1"};
  std::string topic = "/points";
  double rate_hz = 10;  ///< clouds a second, above 0
  /// PCD files to publish in turn, over and over; empty: the synthetic scene.
  std::vector<std::string> inputs;
  std::uint64_t seed = 1;                        ///< of the synthetic scene
  std::optional<std::chrono::seconds> duration;  ///< none: until SIGINT or SIGTERM
  int report_fd = 1;                             ///< where the events go
};

/// Publishes PointCloud2 messages as a ROS 2 node would, of which it tells the stamps and checksums
/// (see checksum.hpp), until its time is over or SIGINT or SIGTERM comes.
///
/// Reports one JSON object a line; times are CLOCK_MONOTONIC in nanoseconds:
///   {"event":"ready"}                                                      inputs are read, DDS is up
///   {"event":"matched","count":1}                                          how many readers there are now
///   {"event":"published","stamp_ns":...,"checksum":...,"bytes":3145892,"time_ns":...}
///                                                                          just before it was written
///   {"event":"refused","reason":"timeout"}                                 DDS did not take it
///   {"event":"finished","published":200}
///
/// Blocks SIGINT and SIGTERM in the calling thread. Ends early when nobody reads the events any more.
/// @throws std::runtime_error  an input can't be read, or DDS can't be used: what() says which and why.
void run_publisher(const PublisherOptions& options);

}  // namespace trestle::measure::demo
