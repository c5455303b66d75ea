#pragma once
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

/// The two ends of the demo. Each reports one JSON object a line; times are CLOCK_MONOTONIC in nanoseconds.
/// Each blocks SIGINT and SIGTERM in the calling thread, and ends when its time is over, when one of these
/// comes, or when nobody reads the reports any more.
namespace trestle::measure::demo {

/// Where an end publishes or receives, and how long.
struct EndpointOptions {
  std::uint32_t domain = 0;
  std::vector<std::string> interfaces{"127.0.0.1"};
  std::string topic = "/points";
  std::optional<std::chrono::seconds> duration;  ///< none: until SIGINT or SIGTERM
  int report_fd = 1;                             ///< where the events go
};

struct PublisherOptions : EndpointOptions {
  double rate_hz = 10;  ///< clouds a second, above 0
  /// PCD files to publish in turn, over and over; empty: the synthetic scene.
  std::vector<std::string> inputs;
  std::uint64_t seed = 1;  ///< of the synthetic scene
};

/// Publishes PointCloud2 messages as a ROS 2 node would, of which it tells the stamps and checksums:
///   {"event":"ready"}                                                      inputs are read, DDS is up
///   {"event":"matched","count":1}                                          how many readers there are now
///   {"event":"published","stamp_ns":...,"checksum":...,"bytes":3145892,"time_ns":...}
///                                                                          just before it was written
///   {"event":"refused","reason":"timeout"}                                 DDS did not take it
///   {"event":"finished","published":200}
/// @throws std::runtime_error  an input can't be read, or DDS can't be used: what() says which and why.
void run_publisher(const PublisherOptions& options);

/// Receives what run_publisher() sends, however far it has come, and tells the stamps and checksums of it:
///   {"event":"ready"}
///   {"event":"matched","count":1}                                  how many writers there are now
///   {"event":"received","stamp_ns":...,"checksum":...,"bytes":3145892,"time_ns":...}
///   {"event":"unreadable","reason":"..."}                          it is no cloud
///   {"event":"finished","received":200,"lost_by_dds":0,"overrun":0}
///                                            overrun: came while 64 others were still waiting to be checked
/// @throws std::runtime_error  DDS can't be used: what() says why.
void run_subscriber(const EndpointOptions& options);

}  // namespace trestle::measure::demo
