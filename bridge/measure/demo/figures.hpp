#pragma once
#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bridge/statistics/histogram.hpp"

/// What the demo measures, from what its four processes report. No process, clock or terminal in here.
namespace trestle::measure::demo {

inline constexpr std::int64_t second_ns = 1'000'000'000;

/// Which process reports.
enum class Process : std::uint8_t { publisher, bridge_a, bridge_b, subscriber };
inline constexpr std::size_t process_count = 4;
/// The name that output uses: "bridge A".
[[nodiscard]] const char* to_string(Process process) noexcept;

/// The parts of a cloud's way between the checkpoints of the paper: (1) and (2) just before and after the
/// conversion of DDS to SOME/IP, (3) and (4) just before and after the conversion back.
enum class Leg : std::uint8_t { to_someip, transport, to_dds, end_to_end };
inline constexpr std::size_t leg_count = 4;

/// How many clouds. A cloud counts as sent from the moment when discovery was complete.
struct CloudCounts {
  std::uint64_t early = 0;       ///< published before that: neither sent nor lost
  std::uint64_t sent = 0;        ///< published, or refused by the publisher's DDS, after that
  std::uint64_t refused = 0;     ///< of these: refused
  std::uint64_t arrived = 0;     ///< of these: received intact
  std::uint64_t duplicates = 0;  ///< received again
  std::uint64_t corrupt = 0;     ///< received, at any time, and not what was published
};

/// What the demo's processes report, put together: discovery, losses, and how long each leg took.
class Figures {
 public:
  /// Takes one line of a process. Lines may come in any order as to different processes.
  /// @param now_ns  CLOCK_MONOTONIC, as are all times in the lines.
  void on_line(Process from, std::string_view line, std::int64_t now_ns);

  /// Discovery is complete when the publisher has found bridge A, bridge A has a subscriber on the SOME/IP
  /// side (it has sent a cloud), and the subscriber has found bridge B.
  [[nodiscard]] bool discovered() const noexcept { return discovered_ns_.has_value(); }
  /// What discovery still waits for, in words.
  [[nodiscard]] std::string missing() const;

  [[nodiscard]] const CloudCounts& counts() const noexcept { return counts_; }
  /// Sent, and not arrived. At the end of a run these are lost.
  [[nodiscard]] std::uint64_t outstanding() const noexcept { return counts_.sent - counts_.arrived; }
  /// The same without those that were sent less than a second ago and may be under way.
  [[nodiscard]] std::uint64_t lost(std::int64_t now_ns) const;
  [[nodiscard]] const statistics::Histogram& leg(Leg leg) const noexcept {
    return legs_[static_cast<std::size_t>(leg)];
  }

  struct Rate {
    double clouds_per_second = 0;
    double megabytes_per_second = 0;  ///< of 10^6 bytes
  };
  /// Of what arrived in the last seconds.
  [[nodiscard]] Rate rate_now(std::int64_t now_ns) const;
  /// From the first cloud that arrived to the last.
  [[nodiscard]] Rate rate() const;

  /// What was discovered, in the order in which it was reported; cleared by the call.
  [[nodiscard]] std::vector<std::string> take_log() { return std::exchange(log_, {}); }

  /// Empty if the run was good: at least 95 % of the clouds sent have arrived, all of them intact. Otherwise
  /// says what was wrong.
  [[nodiscard]] std::string fault() const;

  /// All of it, as docs/demo.md describes it.
  [[nodiscard]] nlohmann::ordered_json to_json() const;

 private:
  using Json = nlohmann::json;
  struct Published {
    std::uint64_t checksum = 0;
    std::int64_t time_ns = 0;
    bool counts = false;  ///< was sent after discovery
    bool arrived = false;
  };
  struct Arrival {
    std::int64_t stamp_ns = 0;
    std::uint64_t checksum = 0;
    std::uint64_t bytes = 0;
    std::int64_t time_ns = 0;
  };

  void handle(Process from, const Json& event, std::int64_t now_ns);
  void on_matched(Process from, std::uint64_t count);
  void on_published(const Json& event);
  void judge_waiting(std::int64_t before_ns);
  void on_refused();
  void on_carried(Process from, const Json& event);
  void on_received(const Json& event);
  void judge(const Arrival& arrival);
  void count_arrival(const Arrival& arrival, std::int64_t published_ns);
  void count_corrupt(const std::string& reason);
  void update_discovered(std::int64_t now_ns);
  void add(Leg leg, std::int64_t duration_ns) { legs_[static_cast<std::size_t>(leg)].add(duration_ns); }

  // Discovery.
  bool publisher_matched_ = false;
  bool subscribed_ = false;
  bool subscriber_matched_ = false;
  std::optional<std::int64_t> discovered_ns_;
  std::vector<std::string> log_;

  // Clouds, by their stamps. Publisher and subscriber report on their own: either may be heard of first.
  static constexpr std::size_t most_published = 10'000;
  CloudCounts counts_;
  std::map<std::int64_t, Published> published_;  ///< the last ones
  std::vector<Arrival> waiting_;                 ///< received, not yet reported as published

  // Legs. Of a message on the SOME/IP side both bridges know the session id.
  std::array<statistics::Histogram, leg_count> legs_;
  std::map<std::uint16_t, std::int64_t> left_a_;  ///< (2) by session id
  std::map<std::uint16_t, std::int64_t> came_b_;  ///< (3) by session id

  // Rates.
  std::deque<std::pair<std::int64_t, std::uint64_t>> recent_;  ///< when, bytes
  std::int64_t first_arrival_ns_ = 0;
  std::int64_t last_arrival_ns_ = 0;
  std::uint64_t first_arrival_bytes_ = 0;
  std::uint64_t arrived_bytes_ = 0;

  std::map<std::string, std::map<std::string, std::map<std::string, std::uint64_t>>> counters_;
  std::uint64_t unreadable_lines_ = 0;
};

}  // namespace trestle::measure::demo
