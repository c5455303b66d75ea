#include "bridge/measure/demo/subscriber.hpp"

#include <deque>
#include <limits>
#include <mutex>
#include <nlohmann/json.hpp>

#include "bridge/measure/demo/checksum.hpp"
#include "bridge/measure/report.hpp"
#include "dds_adapter/participant.hpp"
#include "dds_adapter/ros_names.hpp"

namespace trestle::measure::demo {

namespace {

/// Samples on their way from the thread that receives them to the one that checks them.
class Queue {
 public:
  struct Received {
    dds::Sample sample;
    std::int64_t time_ns = 0;
  };

  void push(Received received) {
    constexpr std::size_t max_waiting = 64;
    const std::lock_guard lock{mutex_};
    if (waiting_.size() < max_waiting) {
      waiting_.push_back(std::move(received));
    } else {
      ++overrun_;
    }
  }
  std::deque<Received> take() {
    const std::lock_guard lock{mutex_};
    return std::exchange(waiting_, {});
  }
  [[nodiscard]] std::uint64_t overrun() {
    const std::lock_guard lock{mutex_};
    return overrun_;
  }

 private:
  std::mutex mutex_;
  std::deque<Received> waiting_;
  std::uint64_t overrun_ = 0;
};

nlohmann::json describe(const Queue::Received& received) {
  const auto cloud = decode(received.sample.cdr());
  if (cloud && !cloud->big_endian) {
    return {{"event", "received"},
            {"stamp_ns", cloud->stamp_ns},
            {"checksum", checksum(*cloud)},
            {"bytes", received.sample.cdr().size()},
            {"time_ns", received.time_ns}};
  }
  return {{"event", "unreadable"}, {"reason", cloud ? "is_bigendian is true" : cloud.error()}};
}

}  // namespace

void run_subscriber(const SubscriberOptions& options) {
  StopSignals signals;
  Report report{options.report_fd};
  Queue queue;
  dds::ParticipantConfig config;
  config.domain = options.domain;
  config.name = "trestle demo subscriber";
  config.interfaces = options.interfaces;
  config.on_event = [&report](const dds::Happening& event) {
    if (event.kind == dds::Happening::Kind::matched || event.kind == dds::Happening::Kind::unmatched) {
      report.line({{"event", "matched"}, {"count", event.matched}});
    }
  };
  dds::Participant participant{config};
  const dds::Reader reader = participant.create_reader(dds::ros_topic_name(options.topic),
                                                       dds::ros_type_name("sensor_msgs/msg/PointCloud2"), {},
                                                       [&queue, &signals](dds::Sample sample) {
                                                         queue.push({std::move(sample), monotonic_ns()});
                                                         signals.wake();
                                                       });
  report.line({{"event", "ready"}});

  const std::int64_t end = options.duration
                               ? monotonic_ns() + std::chrono::nanoseconds{*options.duration}.count()
                               : std::numeric_limits<std::int64_t>::max();
  std::uint64_t received = 0;
  bool over = false;
  while (!over) {
    over = signals.wait_until(end) || monotonic_ns() >= end || report.closed();
    for (const Queue::Received& one : queue.take()) {
      report.line(describe(one));
      ++received;
    }
  }
  report.line({{"event", "finished"},
               {"received", received},
               {"lost_by_dds", reader.counters().lost},
               {"overrun", queue.overrun()}});
}

}  // namespace trestle::measure::demo
