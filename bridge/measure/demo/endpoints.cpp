#include "bridge/measure/demo/endpoints.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "bridge/measure/demo/lidar_scene.hpp"
#include "bridge/measure/demo/pcd.hpp"
#include "bridge/measure/inbox.hpp"
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

dds::ParticipantConfig participant_of(const EndpointOptions& options, const char* name, Report& report) {
  dds::ParticipantConfig config;
  config.domain = options.domain;
  config.name = name;
  config.interfaces = options.interfaces;
  config.on_event = [&report](const dds::Happening& event) {
    if (event.kind == dds::Happening::Kind::matched || event.kind == dds::Happening::Kind::unmatched) {
      report.line({{"event", "matched"}, {"count", event.matched}});
    }
  };
  return config;
}

std::string type_name() {
  return dds::ros_type_name("sensor_msgs/msg/PointCloud2");
}

/// When an end is over that begins now.
std::int64_t end_of(const EndpointOptions& options) {
  return options.duration ? monotonic_ns() + std::chrono::nanoseconds{*options.duration}.count()
                          : std::numeric_limits<std::int64_t>::max();
}

nlohmann::json describe(const Inbox::Received& received) {
  const auto cloud = decode(received.sample.cdr());
  if (cloud && !cloud->big_endian) {
    return {{"event", "received"},
            {"stamp_ns", cloud->stamp_ns},
            {"checksum", checksum(*cloud)},
            {"bytes", received.sample.cdr().size()},
            {"time_ns", received.at_ns}};
  }
  return {{"event", "unreadable"}, {"reason", cloud ? "is_bigendian is true" : cloud.error()}};
}

}  // namespace

void run_publisher(const PublisherOptions& options) {
  if (!(options.rate_hz > 0 && options.rate_hz <= 1000)) {
    throw std::runtime_error{"the rate must be above 0 and at most 1000 clouds a second"};
  }
  StopSignals signals;
  Report report{options.report_fd};
  Source source{options};
  dds::Participant participant{participant_of(options, "trestle demo publisher", report)};
  dds::Writer writer = participant.create_writer(dds::ros_topic_name(options.topic), type_name(), {});
  report.line({{"event", "ready"}});

  const auto period = static_cast<std::int64_t>(std::llround(1e9 / options.rate_hz));
  const std::int64_t end = end_of(options);
  std::int64_t due = monotonic_ns();
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
    const std::array<ByteView, 3> slices{encoded.front, encoded.data, ByteView{&encoded.tail, 1}};
    const std::int64_t time = monotonic_ns();
    if (const auto written = writer.write(slices); written) {
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

void run_subscriber(const EndpointOptions& options) {
  StopSignals signals;
  Report report{options.report_fd};
  Inbox inbox{signals};
  dds::Participant participant{participant_of(options, "trestle demo subscriber", report)};
  const dds::Reader reader =
      participant.create_reader(dds::ros_topic_name(options.topic), type_name(), {},
                                [&inbox](dds::Sample sample) { inbox.put(std::move(sample)); });
  report.line({{"event", "ready"}});

  const std::int64_t end = end_of(options);
  std::uint64_t received = 0;
  bool over = false;
  while (!over) {
    over = signals.wait_until(end) || monotonic_ns() >= end || report.closed();
    for (const Inbox::Received& one : inbox.take()) {
      report.line(describe(one));
      ++received;
    }
  }
  report.line({{"event", "finished"},
               {"received", received},
               {"lost_by_dds", reader.counters().lost},
               {"overrun", inbox.overrun()}});
}

}  // namespace trestle::measure::demo
