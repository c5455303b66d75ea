#include "bridge/carry/runtime/topic_to_event.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <boost/asio/bind_allocator.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/circular_buffer.hpp>
#include <chrono>
#include <mutex>
#include <optional>
#include <vector>

#include "bridge/carry/runtime/bridge_mark.hpp"
#include "bridge/carry/runtime/conversion_log.hpp"
#include "bridge/carry/runtime/dds_qos.hpp"
#include "bridge/carry/runtime/loop_guard.hpp"
#include "bridge/carry/runtime/pacing.hpp"
#include "bridge/carry/runtime/sample_limit.hpp"
#include "dds_adapter/ros_names.hpp"
#include "someip/net/address_text.hpp"
#include "someip/net/pool_allocator.hpp"

namespace trestle::carry {
namespace {

// Samples that may be lent out at once, beside as many as the QoS depth. For a subscriber who is slow the
// newest wait, as many as the depth, which are the same for all who are slow; and the one which it has begun
// to take may be an old one. So this is how many slow subscribers cost no copy.
constexpr std::size_t lent_to_slow = 8;

// So many samples that other bridges bring back from SOME/IP show that the route is part of a ring.
constexpr std::uint64_t returned_in_ring = 3;

// A sample while it is converted and sent. Reused, so that the converter's memory is.
struct Job {
  dds::Sample sample;
  messages::ConversionScratch scratch;
};

}  // namespace

struct TopicToEvent::State : std::enable_shared_from_this<State> {
  State(const RouteContext& shared, const Route& what, messages::ConversionPlan how, std::string told)
      : context{shared},
        user_data{std::move(told)},
        route{what},
        plan{std::move(how)},
        log{what.topic},
        ours{mark_of(shared.address, what)},
        loop{shared.io, what.topic, {}, &mutex},
        pacing{pacing_of(what.tp)},
        max_lent{what.qos.depth + lent_to_slow},
        qos{what.qos},
        waiting{std::max<std::size_t>(1, what.qos.depth)},
        held{what.qos.durability_as_published} {}

  // On a thread of DDS.
  void on_sample(dds::Sample sample) {
    std::optional<dds::Sample> oldest;  // released without the lock: DDS has locks of its own
    bool wake = false;
    const std::uint64_t hash = message_hash(sample.cdr());
    // Behind a bridge there are all senders of its network.
    const std::optional<std::uint64_t> from =
        sample.from_bridge() ? std::nullopt : std::optional{message_hash(sample.id().writer)};
    const auto now = std::chrono::steady_clock::now();
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
      if (!loop.may_carry(hash, from, now, [&] {
            return from ? "the DDS writer " + sample.writer() : name_of(sample.id().writer);
          })) {
        look_at_rings = true;
        wake = !std::exchange(woken, true);
        oldest = std::move(sample);
      } else if (route.qos.keep_all && waiting.full()) {
        ++overtaken;
        return;
      } else {
        if (waiting.full()) {
          oldest = std::move(waiting.front());
          waiting.pop_front();
          ++overtaken;
        }
        waiting.push_back(std::move(sample));
        wake = !held && !std::exchange(woken, true);
      }
    }
    if (wake) {
      drain_soon();
    }
  }

  // Likewise: what another bridge brought in, which is not carried. If it was here before, there is a ring,
  // which something closes on the way that is no bridge of ours.
  void on_bridged(ByteView cdr, const dds::Guid& writer) {
    const std::uint64_t hash = message_hash(cdr);
    const auto now = std::chrono::steady_clock::now();
    bool wake = false;
    {
      const std::lock_guard lock{mutex};
      bridged_by = writer;
      returned += loop.is_repeat(hash, now) ? 1U : 0U;
      wake = !told_bridged || (!told_returned && returned >= returned_in_ring);
      look_at_rings = look_at_rings || wake;
      wake = wake && !std::exchange(woken, true);
    }
    if (wake) {
      drain_soon();
    }
  }

  void drain_soon() {
    boost::asio::post(context.io, boost::asio::bind_allocator(memory, [weak = weak_from_this()] {
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
    if (waiting.empty() || ended || held) {
      woken = false;
      return std::nullopt;
    }
    std::optional<dds::Sample> sample{std::move(waiting.front())};
    waiting.pop_front();
    return sample;
  }

  // From here on: on the thread that runs the io_context.
  void open_reader() {
    reader = context.dds->reader(
        dds::ros_topic_name(route.topic), dds::ros_type_name(route.type), dds_qos(qos),
        [this](dds::Sample sample) { on_sample(std::move(sample)); }, max_sample_bytes(route),
        {.user_data = user_data,
         .bridge = to_text(ours),
         .takes_bridge = [mark = ours](std::string_view other) { return goes_on(mark, other); },
         .on_bridged = [this](ByteView cdr, const dds::Guid& writer) { on_bridged(cdr, writer); }});
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
      past += reader->counters();
      reader.reset();
    }
    const bool begins_to_latch = wanted.transient_local && !qos.transient_local;
    if (qos.transient_local && !wanted.transient_local) {
      offer->forget(route.event);
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

  void tell_of_rings() {
    loop.arm();
    std::optional<dds::Guid> by;
    bool in_ring = false;
    {
      const std::lock_guard lock{mutex};
      in_ring = !told_returned && returned >= returned_in_ring;
      if (bridged_by && (!told_bridged || in_ring)) {
        by = bridged_by;
        told_bridged = true;
        told_returned = told_returned || in_ring;
      }
    }
    if (by && in_ring) {
      spdlog::error(
          "{}: this route seems to loop through {}: what it carries comes back from there. It is not carried "
          "again; end the ring (docs/several_bridges.md)",
          route.topic, name_of(*by));
    } else if (by) {
      spdlog::info("{}: what {} brings from SOME/IP is not carried there again", route.topic, name_of(*by));
    }
  }

  // Of the bridge whose writer it is.
  [[nodiscard]] std::string name_of(const dds::Guid& writer) const {
    for (const dds::BridgeEnd& end : context.dds->bridge_ends(dds::ros_topic_name(route.topic))) {
      const auto mark = end.guid == writer ? parse_bridge_mark(end.text) : std::nullopt;
      if (mark) {
        return "the bridge " + someip::to_string(mark->address);
      }
    }
    return "another bridge";
  }

  void drain() {
    if (look_at_rings.exchange(false)) {
      tell_of_rings();
    }
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
    if (!qos.transient_local &&
        (!offer->handle() || context.someip->subscribers(*offer->handle(), route.event) == 0)) {
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
      log.refused(payload.error(), job->sample.cdr());
      return;
    }
    if (payload->bytes > route.tp.max_message) {
      ++too_large;
      return;
    }
    const std::size_t bytes = payload->bytes;
    const auto source_time = job->sample.source_time();
    const auto sent = qos.transient_local
                          ? offer->set(route.event, gathered(*payload))
                          : context.someip->notify(*offer->handle(), route.event, payload->slices,
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
      context.report.carried({.topic = route.topic,
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
  static std::shared_ptr<const std::vector<std::byte>> gathered(const messages::Gathered& payload) {
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

  const RouteContext& context;
  const std::string user_data;
  ServiceOffer* offer = nullptr;
  const Route route;
  messages::ConversionPlan plan;
  ConversionLog log;
  const BridgeMark ours;  ///< what the reader says of itself
  std::atomic<bool> look_at_rings = false;
  LoopGuard loop;  ///< but for its timer under the mutex
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
  bool ended = false;               ///< the route is gone: what is lent out may come back later
  std::uint64_t received = 0;
  std::uint64_t overtaken = 0;
  bool is_stopped = false;
  std::uint64_t stopped = 0;
  std::optional<dds::Guid> bridged_by;  ///< the last one
  std::uint64_t returned = 0;           ///< what others brought back that was carried before
  bool told_bridged = false;
  bool told_returned = false;

  std::unique_ptr<DdsReader> reader;  // last: its destructor waits for callbacks that use the above
};

TopicToEvent::TopicToEvent(const RouteContext& context, const Route& route, messages::ConversionPlan plan,
                           std::string user_data)
    : state_{std::make_shared<State>(context, route, std::move(plan), std::move(user_data))} {}

TopicToEvent::~TopicToEvent() {
  state_->reader.reset();  // from here on no callback
  const std::lock_guard lock{state_->mutex};
  state_->ended = true;
}

void TopicToEvent::describe(ServiceOffers& offers) {
  const Route& route = state_->route;
  state_->offer = &offers.of(route);
  state_->offer->wait_for_needs(route.presence.offer_while_published);
  sd::ServiceSpec& spec = state_->offer->spec();
  if (route.transport == Transport::tcp) {
    spec.tcp_port = route.port;
    spec.tcp_events.push_back(route.event);
  } else {
    spec.udp_port = route.port;
  }
  auto& groups = spec.eventgroups;
  auto group = std::ranges::find(groups, route.eventgroup, &sd::EventgroupSpec::id);
  if (group == groups.end()) {
    group = groups.insert(group, {.id = route.eventgroup});
  }
  if (route.multicast) {
    group->multicast = route.multicast->group;
    group->multicast_threshold = route.multicast->threshold;
  }
  group->events.push_back(route.event);
  spec.waits.push_back(
      {.id = route.event,
       .rule = {.most = std::max<std::size_t>(1, route.qos.depth), .keep_oldest = route.qos.keep_all}});
  if (route.e2e) {
    spec.e2e.push_back(
        {.id = route.event, .protect = route.e2e->profile, .payload_only = route.e2e->payload_only});
  }
  // Late subscribers get the last value, as late readers do; none while the topic is not latched.
  if (route.qos.transient_local || route.qos.durability_as_published) {
    spec.fields.push_back({.notifier = route.event,
                           .differs = [](ByteView, ByteView) { return true; },
                           .pacing = pacing_of(route.tp)});
  }
}

void TopicToEvent::join_dds() {
  const RouteContext& context = state_->context;
  const Route& route = state_->route;
  const std::string topic = dds::ros_topic_name(route.topic);
  state_->open_reader();
  if (route.presence.offer_while_published) {
    state_->offer->needs([this] { return published(); });
    if (context.watch != nullptr) {
      context.watch->watch(topic, TopicWatch::End::reader, [offer = state_->offer] { offer->update(); });
    }
  }
  if (context.publishers != nullptr && is_as_published(route.qos)) {
    context.publishers->add(topic, dds::ros_type_name(route.type), state_->ours,
                            [this](const PublishedQos& published) { follow(published); });
  }
}

void TopicToEvent::stop() {
  state_->stop();
}

void TopicToEvent::follow(const PublishedQos& published) {
  state_->follow(published);
}

bool TopicToEvent::published() const {
  State& state = *state_;
  const bool matches = state.reader && state.reader->matched() > 0;
  state.between_readers = state.between_readers && !matches;
  return matches || state.between_readers;
}

void TopicToEvent::append_diagnoses(std::vector<Diagnosis>& diagnoses, bool all) const {
  if (all) {
    diagnoses.push_back(route_state(counters(), published(), "nobody publishes the topic", state_->route));
  }
}

const std::string* TopicToEvent::awaited() const {
  return &state_->route.topic;
}

std::uint64_t TopicToEvent::received() const {
  const std::lock_guard lock{state_->mutex};
  return state_->received;
}

SilenceReason TopicToEvent::silence(const Surroundings& around) const {
  std::vector<dds::FoundWriter> others;  // than bridges that it has nothing to do with
  std::ranges::copy_if(
      around.writers_of(dds::ros_topic_name(state_->route.topic)), std::back_inserter(others),
      [this](const dds::FoundWriter& one) { return !one.bridge || goes_on(state_->ours, one.bridge_text); });
  return why_silent(state_->route, DdsSilence{.participants = around.participants,
                                              .writers = others,
                                              .matched = state_->reader ? state_->reader->matched() : 0});
}

CounterGroup TopicToEvent::counters() const {
  using enum Counter::Kind;
  const State& state = *state_;
  const dds::ReaderCounters dds = state.reader ? state.reader->counters() : dds::ReaderCounters{};
  dds::ReaderCounters all = state.past;
  all += dds;
  const std::uint64_t publishers = state.reader ? state.reader->matched() : 0;
  const std::uint64_t bridges = state.context.dds->bridge_ends(dds::ros_topic_name(state.route.topic)).size();
  const std::uint64_t offered = state.offer->handle() ? 1 : 0;
  const std::lock_guard lock{state.mutex};
  return {"route " + state.route.topic + " to SOME/IP",
          {{"received", state.received},
           {"carried", state.carried},
           {"bytes", state.carried_bytes},
           {"publishers", publishers, now},
           {"bridges", bridges, now},
           {"offered", offered, now},
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
           {"looped", state.loop.looped(), loss},
           {"dds_own", all.own, loss},
           {"dds_from_bridge", all.from_bridge, loss},
           {"dds_other_type", all.other_type, loss},
           {"dds_bad_encapsulation", all.bad_encapsulation, loss},
           {"dds_oversize", all.oversize, loss},
           {"dds_lost", all.lost, loss},
           {"dds_rejected", all.rejected, loss},
           {"dds_incompatible_qos", dds.incompatible_qos, loss},  // of those before: why they are gone
           {"dds_deadlines_missed", all.deadlines_missed, loss},
           {"dds_liveliness_lost", all.liveliness_lost, loss}}};
}

}  // namespace trestle::carry
