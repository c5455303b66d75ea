#include "bridge/measure/perf/bridge_path.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <deque>
#include <limits>

#include "bridge/measure/inbox.hpp"
#include "bridge/measure/perf/perf_service.hpp"
#include "bridge/measure/point_cloud.hpp"
#include "dds_adapter/ros_names.hpp"

namespace trestle::measure::perf {
namespace {

constexpr std::int64_t second_ns = 1'000'000'000;
constexpr std::uint32_t point_bytes = 16;

/// One end of the path.
struct Side {
  /// @param on_sample  called on a thread of DDS.
  Side(const PathOptions& options, const char* writes, const char* reads,
       std::function<void(dds::Sample)> on_sample)
      : participant{{.domain = options.domain,
                     .name = "trestle perf",
                     .interfaces = options.interfaces,
                     .shared_memory = options.shared_memory ? std::optional{true} : std::nullopt,
                     .on_event =
                         [warn = options.warn](const dds::Happening& event) {
                           if (warn && event.kind == dds::Happening::Kind::small_send_buffer) {
                             warn("DDS: " + event.detail);
                           }
                         }}},
        writer{participant.create_writer(name(options, writes), type(), qos())},
        reader{participant.create_reader(name(options, reads), type(), qos(), std::move(on_sample))} {
    if (options.warn) {
      for (const std::string& line : participant.buffers_not_granted()) {
        options.warn("DDS: " + line);
      }
    }
  }

  static std::string name(const PathOptions& options, const char* what) {
    return dds::ros_topic_name(options.topic + "/" + what);
  }
  static dds::Qos qos() { return {.depth = max_path_window}; }
  static std::string type() { return dds::ros_type_name("sensor_msgs/msg/PointCloud2"); }

  dds::Participant participant;
  dds::Writer writer;
  dds::Reader reader;
};

/// Sends clouds whose stamps are their numbers, and keeps `window` of them under way.
class Pinger {
 public:
  /// Called with the round-trip time of a cloud; with nothing if it has not come back in time.
  using Done = std::function<void(std::optional<std::int64_t> trip_ns)>;

  explicit Pinger(const PathOptions& options)
      : side_{options, "there", "back", [this](dds::Sample sample) { inbox_.put(std::move(sample)); }},
        window_{options.window},
        period_ns_{options.rate_hz > 0 ? static_cast<std::int64_t>(second_ns / options.rate_hz) : 0} {
    cloud_.width = std::max(options.bytes / point_bytes, 1U);
    cloud_.point_bytes = point_bytes;
    cloud_.data.resize(std::size_t{cloud_.width} * point_bytes, std::byte{0x5a});
    std::uint32_t offset = 0;
    for (const char* field : {"x", "y", "z", "intensity"}) {
      cloud_.fields.push_back({.name = field, .offset = offset, .type = FieldType::float32});
      offset += size_of(FieldType::float32);
    }
  }

  [[nodiscard]] std::size_t bytes() const noexcept { return cloud_.data.size(); }

  /// Fills the window, as far as the rate allows it, and waits until a cloud comes back, is taken for lost
  /// after `limit_ns`, or another one is due.
  void step(std::int64_t limit_ns, const Done& done) {
    for (std::int64_t now = monotonic_ns(); under_way_.size() < window_ && now >= due_ns_;
         now = monotonic_ns()) {
      due_ns_ = std::max(due_ns_, now) + period_ns_;  // what was held up is not caught up with
      send(limit_ns);
    }
    std::int64_t until = under_way_.size() < window_ ? due_ns_ : std::numeric_limits<std::int64_t>::max();
    if (!under_way_.empty()) {
      until = std::min(until, under_way_.front().lost_at_ns);
    }
    stopped_ = signals_.wait_until(until);
    for (const Inbox::Received& one : inbox_.take()) {
      const auto cloud = decode(one.sample.cdr());
      if (!cloud || cloud->data.size() != cloud_.data.size()) {
        continue;
      }
      const auto ping = std::ranges::find(under_way_, cloud->stamp_ns, &Ping::number);
      if (ping != under_way_.end()) {
        const std::int64_t trip = one.at_ns - ping->sent_ns;
        under_way_.erase(ping);
        done(trip);
      }
    }
    while (!stopped_ && !under_way_.empty() && under_way_.front().lost_at_ns <= monotonic_ns()) {
      under_way_.pop_front();
      done(std::nullopt);
    }
  }
  /// Counts clouds that are under way neither as lost nor as received.
  void forget() { under_way_.clear(); }
  [[nodiscard]] bool stopped() const noexcept { return stopped_; }

 private:
  struct Ping {
    std::int64_t number = 0;
    std::int64_t sent_ns = 0;
    std::int64_t lost_at_ns = 0;
  };

  void send(std::int64_t limit_ns) {
    ++number_;
    const auto encoded = encode(cloud_, number_, "perf");
    const std::array<ByteView, 3> slices{encoded.front, encoded.data, ByteView{&encoded.tail, 1}};
    const std::int64_t now = monotonic_ns();
    under_way_.push_back({number_, now, now + limit_ns});
    (void)side_.writer.write(slices);  // a refused cloud does not come back
  }

  StopSignals signals_;
  Inbox inbox_{signals_};
  Side side_;
  Cloud cloud_;
  std::size_t window_;
  std::int64_t period_ns_;
  std::int64_t due_ns_ = 0;     ///< of the next one
  std::deque<Ping> under_way_;  ///< ordered by number
  std::int64_t number_ = 0;
  bool stopped_ = false;
};

}  // namespace

std::optional<Result> measure_path(const PathOptions& options,
                                   const std::function<void(const Result& result)>& progress) {
  Pinger pinger{options};
  Result result;
  result.what = "bridge";
  result.transport = "dds";
  result.how =
      fmt::format("{}{} under way, half of the way there and back",
                  options.rate_hz > 0 ? fmt::format("{} a second, ", options.rate_hz) : "", options.window);
  result.payload_bytes = pinger.bytes();

  // Discovery takes time on every part of the path; clouds that are sent earlier are lost.
  constexpr std::int64_t try_ns = second_ns / 10;
  const std::int64_t patience_end = monotonic_ns() + options.patience.count();
  bool open = false;
  while (!open) {
    pinger.step(try_ns, [&](std::optional<std::int64_t> trip) { open |= trip.has_value(); });
    if (pinger.stopped() || monotonic_ns() > patience_end) {
      return std::nullopt;
    }
  }
  pinger.forget();  // clouds sent so far may still get lost
  const std::int64_t limit_ns = std::min<std::int64_t>(options.patience.count(), second_ns);
  for (const std::int64_t warm = monotonic_ns() + options.warm_up.count();
       monotonic_ns() < warm && !pinger.stopped();) {
    pinger.step(limit_ns, [](std::optional<std::int64_t>) {});
  }

  const Status before = own_status();
  const std::int64_t start = monotonic_ns();
  const std::int64_t end = start + options.measured.count();
  std::int64_t next_progress = start + second_ns;
  for (std::int64_t now = start; now < end && !pinger.stopped();) {
    pinger.step(limit_ns, [&](std::optional<std::int64_t> trip) {
      if (trip) {
        ++result.received;
        result.latency.add(*trip / 2);
      } else {
        ++result.lost;
      }
    });
    now = monotonic_ns();
    result.seconds = static_cast<double>(now - start) / 1e9;
    result.sent = result.received + result.lost;
    if (progress && now >= next_progress) {
      progress(result);
      next_progress = now + second_ns;
    }
  }
  result.cpu["this_end"] = cpu_between(before, own_status());
  return result;
}

void reflect(const PathOptions& options) {
  StopSignals signals;
  // On the thread that delivers them; the writer exists before the reader.
  Side side{options, "back", "there", [&side](const dds::Sample& sample) {
              (void)side.writer.write(sample.cdr());  // a refused sample is lost and counted as lost
            }};
  while (!signals.wait_until(std::numeric_limits<std::int64_t>::max())) {
  }
}

}  // namespace trestle::measure::perf
