#include "bridge/measure/demo/publisher.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "bridge/measure/demo/checksum.hpp"
#include "bridge/measure/demo/lidar_scene.hpp"
#include "bridge/measure/demo/pcd.hpp"
#include "bridge/measure/report.hpp"
#include "dds_adapter/participant.hpp"
#include "dds_adapter/ros_names.hpp"

namespace trestle::measure::demo {

namespace {

constexpr const char* frame_id = "lidar";

/// What is published, frame by frame.
class Source {
 public:
  explicit Source(const PublisherOptions& options) : scene_{options.seed} {
    for (const std::string& input : options.inputs) {
      auto cloud = load_pcd(input);
      if (!cloud) {
        throw std::runtime_error{cloud.error()};
      }
      inputs_.push_back(std::move(*cloud));
    }
  }

  /// Valid until the next call.
  const Cloud& frame(std::uint64_t number) {
    if (!inputs_.empty()) {
      return inputs_[number % inputs_.size()];
    }
    scene_.render(number, rendered_);
    return rendered_;
  }

 private:
  std::vector<Cloud> inputs_;
  LidarScene scene_;
  Cloud rendered_;
};

}  // namespace

void run_publisher(const PublisherOptions& options) {
  if (!(options.rate_hz > 0 && options.rate_hz <= 1000)) {
    throw std::runtime_error{"the rate must be above 0 and at most 1000 clouds a second"};
  }
  StopSignals signals;
  Report report{options.report_fd};
  Source source{options};
  dds::ParticipantConfig config;
  config.domain = options.domain;
  config.name = "trestle demo publisher";
  config.interfaces = options.interfaces;
  config.on_event = [&report](const dds::Happening& event) {
    if (event.kind == dds::Happening::Kind::matched || event.kind == dds::Happening::Kind::unmatched) {
      report.line({{"event", "matched"}, {"count", event.matched}});
    }
  };
  dds::Participant participant{config};
  dds::Writer writer = participant.create_writer(dds::ros_topic_name(options.topic),
                                                 dds::ros_type_name("sensor_msgs/msg/PointCloud2"), {});
  report.line({{"event", "ready"}});

  const auto period = static_cast<std::int64_t>(std::llround(1e9 / options.rate_hz));
  const std::int64_t start = monotonic_ns();
  const std::int64_t end = options.duration ? start + std::chrono::nanoseconds{*options.duration}.count()
                                            : std::numeric_limits<std::int64_t>::max();
  std::int64_t due = start;
  std::int64_t stamp = 0;
  std::uint64_t published = 0;
  for (std::uint64_t number = 1; due < end; ++number) {
    const Cloud& cloud = source.frame(number);  // rendered early, so that it delays nobody
    bool stopped = false;
    do {
      stopped = signals.wait_until(due);
    } while (!stopped && monotonic_ns() < due);
    if (stopped || report.closed()) {
      break;
    }
    stamp = std::max(stamp + 1, realtime_ns());  // identifies a cloud; grows even if the clock is set back
    const EncodedCloud encoded = encode(cloud, stamp, frame_id);
    const std::array<ByteView, 3> pieces{encoded.front, encoded.data, ByteView{&encoded.tail, 1}};
    const std::int64_t time = monotonic_ns();
    if (const auto written = writer.write(pieces); written) {
      ++published;
      report.line({{"event", "published"},
                   {"stamp_ns", stamp},
                   {"checksum", checksum(encoded)},
                   {"bytes", encoded.size()},
                   {"time_ns", time}});
    } else {
      report.line({{"event", "refused"}, {"reason", to_string(written.error())}});
    }
    // After a stall there must be no burst of clouds.
    due = std::max(due + period, monotonic_ns());
  }
  (void)writer.wait_until_received(std::chrono::seconds{2});
  report.line({{"event", "finished"}, {"published", published}});
}

}  // namespace trestle::measure::demo
