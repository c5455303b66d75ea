#pragma once
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace trestle::measure::demo {

/// What to receive, where and how long.
struct SubscriberOptions {
  std::uint32_t domain = 0;
  std::vector<std::string> interfaces{"127.0.0.1"};
  std::string topic = "/points";
  std::optional<std::chrono::seconds> duration;  ///< none: until SIGINT or SIGTERM
  int report_fd = 1;                             ///< where the events go
};

/// Receives what run_publisher() sends, however far it has come, and tells the stamps and checksums of it.
///
/// Reports one JSON object a line; times are CLOCK_MONOTONIC in nanoseconds:
///   {"event":"ready"}
///   {"event":"matched","count":1}                                  how many writers there are now
///   {"event":"received","stamp_ns":...,"checksum":...,"bytes":3145892,"time_ns":...}
///   {"event":"unreadable","reason":"..."}                          it is no cloud
///   {"event":"finished","received":200,"lost_by_dds":0,"overrun":0}
///                                            overrun: came while 64 others were still waiting to be checked
///
/// Blocks SIGINT and SIGTERM in the calling thread. Ends early when nobody reads the events any more.
/// @throws std::runtime_error  DDS can't be used: what() says why.
void run_subscriber(const SubscriberOptions& options);

}  // namespace trestle::measure::demo
