#include "bridge/runtime/outbound_route.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
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
  State(boost::asio::io_context& context, sd::Node& sender, ServiceOffer& offered, dds::Participant& joined,
        const Route& what, ConversionPlan how, std::string told, Report& watcher)
      : io{context},
        participant{joined},
        user_data{std::move(told)},
        node{&sender},
        offer{offered},
        route{what},
        plan{std::move(how)},
        report{watcher},
        log{what.topic},
        pacing{pacing_of(what.tp)},
        max_lent{what.qos.depth + lent_to_slow},
        qos{what.qos},
        waiting{std::max<std::size_t>(1, what.qos.depth)},
        held{what.qos.durability_as_published} {}

  // On a thread of DDS.
  void on_sample(dds::Sample sample) {
    std::optional<dds::Sample> oldest;  // released without the lock: DDS has locks of its own
    bool wake = false;
    {
      const std::lock_guard lock{mutex};
      if (!seen.empty() && was_seen(sample.id())) {
        return;
      }
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
      wake = !held && !std::exchange(woken, true);
    }
    if (wake) {
      drain_soon();
    }
  }

  void drain_soon() {
    boost::asio::post(io, boost::asio::bind_allocator(memory, [weak = weak_from_this()] {
                        if (const auto self = weak.lock()) {
                          self->drain();
                        }
                      }));
  }

  // Whether the reader before had it already: who asks for what was published before gets that again.
  bool was_seen(const dds::SampleId& id) {
    const auto last = std::ranges::find(seen, id.writer, &dds::SampleId::writer);
    if (last == seen.end()) {
      return false;
    }
    if (id.sequence <= last->sequence) {
      return true;
    }
    seen.erase(last);
    return false;
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
    if (waiting.empty() || node == nullptr || held) {
      woken = false;
      return std::nullopt;
    }
    std::optional<dds::Sample> sample{std::move(waiting.front())};
    waiting.pop_front();
    return sample;
  }

  // From here on: on the thread that runs the io_context.
  void open_reader() {
    reader =
        participant.create_reader(dds::ros_topic_name(route.topic), dds::ros_type_name(route.type),
                                  dds_qos(qos), [this](dds::Sample sample) { on_sample(std::move(sample)); },
                                  max_sample_bytes(route), {.user_data = user_data});
  }

  void follow(const PublishedQos& published) {
    const QosSettings wanted = followed(route.qos, published);
    if (published.publishers > 0 && wanted != qos) {
      exchange_reader(wanted);
    }
    between_readers = between_readers && published.publishers > 0;
    // What publishes nothing yet may be latched when it does. Of one that matches and is not known, as there
    // are more than can be remembered, that will never be known.
    hold(route.qos.durability_as_published && published.publishers == 0 &&
         (!reader || reader->matched() == 0));
  }

  void exchange_reader(const QosSettings& wanted) {
    if (reader) {
      between_readers = reader->matched() > 0;
      const dds::ReaderCounters last = reader->counters();
      past.own += last.own;
      past.other_type += last.other_type;
      past.bad_encapsulation += last.bad_encapsulation;
      past.oversize += last.oversize;
      past.lost += last.lost;
      past.rejected += last.rejected;
      past.deadlines_missed += last.deadlines_missed;
      past.liveliness_lost += last.liveliness_lost;
      reader.reset();
    }
    const bool begins_to_latch = wanted.transient_local && !qos.transient_local;
    if (qos.transient_local && !wanted.transient_local) {
      offer.forget(route.event);
    }
    qos = wanted;
    {
      const std::lock_guard lock{mutex};
      seen.clear();
      for (const dds::Sample& sample : waiting) {
        const dds::SampleId id = sample.id();
        const auto known = std::ranges::find(seen, id.writer, &dds::SampleId::writer);
        if (known != seen.end()) {
          known->sequence = std::max(known->sequence, id.sequence);
        } else if (begins_to_latch) {
          seen.push_back(id);
        }
      }
    }
    spdlog::info("{}: asks for what its publishers offer: {}, {}", route.topic,
                 qos.reliable ? "reliable" : "best_effort",
                 qos.transient_local ? "transient_local" : "volatile");
    try {
      open_reader();
    } catch (const std::exception& error) {  // tried again when publishers come or go
      spdlog::error("{}: {}", route.topic, error.what());
    }
  }

  void hold(bool now) {
    bool wake = false;
    {
      const std::lock_guard lock{mutex};
      held = now;
      wake = !held && !waiting.empty() && !std::exchange(woken, true);
    }
    if (wake) {
      drain_soon();
    }
  }

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
    if (!qos.transient_local && (!offer.handle() || node->subscribers(*offer.handle(), route.event) == 0)) {
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
    const auto sent = qos.transient_local ? offer.set(route.event, gathered(*payload))
                                          : node->notify(*offer.handle(), route.event, payload->slices,
                                                         lend ? job : std::shared_ptr<const void>{}, pacing);
    copied += lend || qos.transient_local ? 0 : 1;
    send_dropped += sent.dropped;
    slow_subscriber += sent.overtaken;
    if (sent.subscribers == 0 && qos.transient_local) {
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
  dds::Participant& participant;
  const std::string user_data;
  sd::Node* node;
  ServiceOffer& offer;
  const Route route;
  ConversionPlan plan;
  Report& report;
  ConversionLog log;
  const someip::TpPacing pacing;
  const someip::PoolAllocator<std::byte> memory;  ///< of what comes and goes with each sample
  const std::size_t max_lent;
  QosSettings qos;               ///< of the reader
  bool between_readers = false;  ///< the reader is new, and matches again what the one before did
  dds::ReaderCounters past;      ///< of readers before
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
  bool held;                        ///< what comes waits until it is known whether the topic is latched
  std::vector<dds::SampleId> seen;  ///< the last of each writer that the reader before had
  bool woken = false;               ///< drain() has been asked for
  std::uint64_t received = 0;
  std::uint64_t overtaken = 0;
  bool is_stopped = false;
  std::uint64_t stopped = 0;

  std::optional<dds::Reader> reader;  // last: its destructor waits for callbacks that use the above
};

OutboundRoute::OutboundRoute(boost::asio::io_context& io, sd::Node& node, ServiceOffer& offer,
                             dds::Participant& participant, const Route& route, ConversionPlan plan,
                             const std::string& user_data, Report& report)
    : state_{
          std::make_shared<State>(io, node, offer, participant, route, std::move(plan), user_data, report)} {
  state_->open_reader();
}

OutboundRoute::~OutboundRoute() {
  state_->reader.reset();  // from here on no callback
  const std::lock_guard lock{state_->mutex};
  state_->node = nullptr;
}

void OutboundRoute::stop() {
  state_->stop();
}

void OutboundRoute::follow(const PublishedQos& published) {
  state_->follow(published);
}

bool OutboundRoute::published() const {
  State& state = *state_;
  const bool matches = state.reader && state.reader->matched() > 0;
  state.between_readers = state.between_readers && !matches;
  return matches || state.between_readers;
}

CounterGroup OutboundRoute::counters() const {
  using enum Counter::Kind;
  const State& state = *state_;
  const dds::ReaderCounters dds = state.reader ? state.reader->counters() : dds::ReaderCounters{};
  const dds::ReaderCounters& past = state.past;
  const std::uint64_t publishers = state.reader ? state.reader->matched() : 0;
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
           {"dds_own", past.own + dds.own, loss},
           {"dds_other_type", past.other_type + dds.other_type, loss},
           {"dds_bad_encapsulation", past.bad_encapsulation + dds.bad_encapsulation, loss},
           {"dds_oversize", past.oversize + dds.oversize, loss},
           {"dds_lost", past.lost + dds.lost, loss},
           {"dds_rejected", past.rejected + dds.rejected, loss},
           {"dds_incompatible_qos", dds.incompatible_qos, loss},
           {"dds_deadlines_missed", past.deadlines_missed + dds.deadlines_missed, loss},
           {"dds_liveliness_lost", past.liveliness_lost + dds.liveliness_lost, loss}}};
}

}  // namespace trestle::bridge
