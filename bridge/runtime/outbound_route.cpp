#include "bridge/runtime/outbound_route.hpp"

#include <boost/asio/bind_allocator.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/circular_buffer.hpp>
#include <chrono>
#include <mutex>
#include <optional>
#include <vector>

#include "bridge/runtime/conversion_log.hpp"
#include "bridge/runtime/dds_qos.hpp"
#include "bridge/runtime/pacing.hpp"
#include "bridge/runtime/sample_limit.hpp"
#include "dds_adapter/ros_names.hpp"
#include "someip/net/pool_allocator.hpp"

namespace trestle::bridge {
namespace {

// Samples that may be lent out at once, beside as many as the QoS depth. For a subscriber who is slow the
// newest wait, as many as the depth, which are the same for all who are slow; and the one which it has begun
// to take may be an old one. So this is how many slow subscribers cost no copy.
constexpr std::size_t lent_to_slow = 8;

// A sample while it is converted and sent. Reused, so that the converter's memory is.
struct Job {
  dds::Sample sample;
  ConversionScratch scratch;
};

}  // namespace

struct OutboundRoute::State : std::enable_shared_from_this<State> {
  State(boost::asio::io_context& context, sd::Node& sender, ServiceOffer& offered, const Route& what,
        ConversionPlan how, Report& watcher)
      : io{context},
        node{&sender},
        offer{offered},
        route{what},
        plan{std::move(how)},
        report{watcher},
        log{what.topic},
        pacing{pacing_of(what.tp)},
        max_lent{what.qos.depth + lent_to_slow},
        waiting{std::max<std::size_t>(1, what.qos.depth)} {}

  // On a thread of DDS.
  void on_sample(dds::Sample sample) {
    std::optional<dds::Sample> oldest;  // released without the lock: DDS has locks of its own
    bool wake = false;
    {
      const std::lock_guard lock{mutex};
      ++received;
      if (is_stopped) {
        ++stopped;
        return;
      }
      if (route.qos.keep_all && waiting.full()) {
        ++overtaken;
        return;
      }
      if (waiting.full()) {
        oldest = std::move(waiting.front());
        waiting.pop_front();
        ++overtaken;
      }
      waiting.push_back(std::move(sample));
      wake = !std::exchange(woken, true);
    }
    if (wake) {
      boost::asio::post(io, boost::asio::bind_allocator(memory, [weak = weak_from_this()] {
                          if (const auto self = weak.lock()) {
                            self->drain();
                          }
                        }));
    }
  }

  void stop() {
    boost::circular_buffer<dds::Sample> dropped;  // released without the lock, as above
    const std::lock_guard lock{mutex};
    is_stopped = true;
    stopped += waiting.size();
    dropped.swap(waiting);
  }

  std::optional<dds::Sample> next_sample() {
    const std::lock_guard lock{mutex};
    if (waiting.empty() || node == nullptr) {
      woken = false;
      return std::nullopt;
    }
    std::optional<dds::Sample> sample{std::move(waiting.front())};
    waiting.pop_front();
    return sample;
  }

  // From here on: on the thread that runs the io_context.
  void drain() {
    if (draining) {
      return;  // a job that was done at once: the loop below goes on
    }
    draining = true;
    while (auto sample = next_sample()) {
      carry(std::move(*sample));
    }
    draining = false;
  }

  void carry(dds::Sample sample) {
    if (idle_jobs.empty()) {
      idle_jobs.push_back(std::make_unique<Job>());
      ++jobs;
    }
    plan.expect(sample.cdr(), idle_jobs.back()->scratch);
    if (is_expired(sample)) {
      ++expired;
      return;
    }
    if (!route.qos.transient_local &&
        (!offer.handle() || node->subscribers(*offer.handle(), route.event) == 0)) {
      ++no_subscriber;
      return;
    }
    // Where too many are lent out to who does not take them, what has to wait of this one is copied, to
    // memory that has a bound of its own: NodeConfig::max_queued_bytes.
    const bool lend = jobs - idle_jobs.size() < max_lent;
    const auto job = take_job();
    job->sample = std::move(sample);
    const auto before = Clock::now();
    const auto payload = plan.cdr_to_someip(job->sample.cdr(), job->scratch);
    const auto after = Clock::now();
    if (!payload) {
      ++not_convertible;
      log.refused(payload.error());
      return;
    }
    if (payload->bytes > route.tp.max_message) {
      ++too_large;
      return;
    }
    const std::size_t bytes = payload->bytes;
    const auto source_time = job->sample.source_time();
    const auto sent = route.qos.transient_local
                          ? offer.set(route.event, gathered(*payload))
                          : node->notify(*offer.handle(), route.event, payload->slices,
                                         lend ? job : std::shared_ptr<const void>{}, pacing);
    copied += lend || route.qos.transient_local ? 0 : 1;
    send_dropped += sent.dropped;
    slow_subscriber += sent.overtaken;
    if (sent.subscribers == 0 && route.qos.transient_local) {
      ++kept;
    }
    if (sent.subscribers > 0) {
      ++carried;
      carried_bytes += bytes;
      report.carried({.topic = route.topic,
                      .direction = route.direction,
                      .session = sent.session,
                      .before = before,
                      .after = after,
                      .source_time = source_time,
                      .bytes = bytes});
    }
  }

  // Nothing that waited for longer than its lifespan is worth carrying.
  [[nodiscard]] bool is_expired(const dds::Sample& sample) const {
    return route.qos.lifespan.count() > 0 && sample.source_time().count() > 0 &&
           std::chrono::system_clock::now().time_since_epoch() > sample.source_time() + route.qos.lifespan;
  }

  // The value of a field is kept in one piece.
  static std::shared_ptr<const std::vector<std::byte>> gathered(const Gathered& payload) {
    auto value = std::make_shared<std::vector<std::byte>>();
    value->reserve(payload.bytes);
    for (const ByteView slice : payload.slices) {
      value->insert(value->end(), slice.begin(), slice.end());
    }
    return value;
  }

  // A job that comes back by itself when the last sender lets go of it.
  std::shared_ptr<Job> take_job() {
    std::unique_ptr<Job> job = std::move(idle_jobs.back());
    idle_jobs.pop_back();
    return {job.release(),
            [weak = weak_from_this()](Job* done) {
              std::unique_ptr<Job> owned{done};
              owned->sample.release();
              if (const auto self = weak.lock()) {
                self->idle_jobs.push_back(std::move(owned));
                self->drain();
              }
            },
            memory};
  }

  boost::asio::io_context& io;
  sd::Node* node;
  ServiceOffer& offer;
  const Route route;
  ConversionPlan plan;
  Report& report;
  ConversionLog log;
  const someip::TpPacing pacing;
  const someip::PoolAllocator<std::byte> memory;  ///< of what comes and goes with each sample
  const std::size_t max_lent;
  std::vector<std::unique_ptr<Job>> idle_jobs;
  std::size_t jobs = 0;  ///< those that are idle, and one for each sample that is lent out
  bool draining = false;
  std::uint64_t carried = 0;
  std::uint64_t carried_bytes = 0;
  std::uint64_t kept = 0;  ///< values of a latched topic that wait for subscribers
  std::uint64_t no_subscriber = 0;
  std::uint64_t expired = 0;
  std::uint64_t not_convertible = 0;
  std::uint64_t too_large = 0;
  std::uint64_t send_dropped = 0;
  std::uint64_t slow_subscriber = 0;
  std::uint64_t copied = 0;  ///< samples that could not be lent out

  mutable std::mutex mutex;  // of what follows
  boost::circular_buffer<dds::Sample> waiting;
  bool woken = false;  ///< drain() has been asked for
  std::uint64_t received = 0;
  std::uint64_t overtaken = 0;
  bool is_stopped = false;
  std::uint64_t stopped = 0;

  std::optional<dds::Reader> reader;  // last: its destructor waits for callbacks that use the above
};

OutboundRoute::OutboundRoute(boost::asio::io_context& io, sd::Node& node, ServiceOffer& offer,
                             dds::Participant& participant, const Route& route, ConversionPlan plan,
                             const std::string& user_data, Report& report)
    : state_{std::make_shared<State>(io, node, offer, route, std::move(plan), report)} {
  state_->reader = participant.create_reader(
      dds::ros_topic_name(route.topic), dds::ros_type_name(route.type), dds_qos(route.qos),
      [state = state_.get()](dds::Sample sample) { state->on_sample(std::move(sample)); },
      max_sample_bytes(route), {.user_data = user_data});
}

OutboundRoute::~OutboundRoute() {
  state_->reader.reset();  // from here on no callback
  const std::lock_guard lock{state_->mutex};
  state_->node = nullptr;
}

void OutboundRoute::stop() {
  state_->stop();
}

bool OutboundRoute::published() const {
  return state_->reader->matched() > 0;
}

CounterGroup OutboundRoute::counters() const {
  using enum Counter::Kind;
  const State& state = *state_;
  const dds::ReaderCounters dds = state.reader->counters();
  const std::uint64_t publishers = state.reader->matched();
  const std::uint64_t offered = state.offer.handle() ? 1 : 0;
  const std::lock_guard lock{state.mutex};
  return {"route " + state.route.topic + " to SOME/IP",
          {{"received", state.received},
           {"carried", state.carried},
           {"bytes", state.carried_bytes},
           {"publishers", publishers},
           {"offered", offered},
           {"no_subscriber", state.no_subscriber, loss},
           {"kept", state.kept},
           {"expired", state.expired, loss},
           {"overtaken", state.overtaken, loss},
           {"not_convertible", state.not_convertible, loss},
           {"too_large", state.too_large, loss},
           {"not_sent", state.send_dropped, loss},
           {"slow_subscriber", state.slow_subscriber, loss},
           {"copied", state.copied},
           {"stopped", state.stopped, loss},
           {"dds_own", dds.own, loss},
           {"dds_bad_encapsulation", dds.bad_encapsulation, loss},
           {"dds_oversize", dds.oversize, loss},
           {"dds_lost", dds.lost, loss},
           {"dds_rejected", dds.rejected, loss},
           {"dds_incompatible_qos", dds.incompatible_qos, loss},
           {"dds_deadlines_missed", dds.deadlines_missed, loss},
           {"dds_liveliness_lost", dds.liveliness_lost, loss}}};
}

}  // namespace trestle::bridge
