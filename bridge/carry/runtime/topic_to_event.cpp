#include "bridge/carry/runtime/make_routes.hpp"

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
#include "bridge/carry/runtime/loop_guard.hpp"
#include "bridge/carry/runtime/onlookers.hpp"
#include "bridge/carry/runtime/route_meter.hpp"
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

// A sample that has come, and when.
struct Waiting {
  dds::Sample sample;
  RouteClock::TimePoint came;
  bool is_tried = false;  ///< there was no room for it
};

// A sample while it is converted and sent. Reused, so that the converter's memory is.
struct Job {
  dds::Sample sample;
  messages::MappedScratch scratch;
};

/// Carries a DDS topic to a SOME/IP event. Samples arrive on threads of DDS and wait, at most as many as the
/// route's QoS depth, for the thread that runs the io_context; there they are converted and sent. A sample's
/// memory stays on loan from DDS until the last byte of it has been sent: nothing is copied on the way.
///
/// What other bridges brought to the topic from SOME/IP is not carried.
///
/// A subscriber who takes them more slowly than they come gets the newest, as many as the depth: what is
/// dropped is dropped for that subscriber alone. While there is no room for any, the newest wait here.
class TopicToEvent final : public RunningRoute, public std::enable_shared_from_this<TopicToEvent> {
 public:
  TopicToEvent(const RouteContext& context, const Route& route, messages::MappedPlan plan,
               std::string user_data)
      : context_{context},
        user_data_{std::move(user_data)},
        route_{route},
        plan_{std::move(plan)},
        log_{context.clock, route.topic},
        ours_{mark_of(context.address, route)},
        loop_{context.clock, route.topic, {}, &mutex_},
        pacing_{route.tp},
        max_lent_{route.qos.depth + lent_to_slow},
        qos_{route.qos},
        waiting_{std::max<std::size_t>(1, route.qos.depth)},
        held_{route.qos.durability_as_published} {}

  void describe(ServiceOffers& offers) override {
    offer_ = &offers.of(route_);
    offer_->wait_for_needs(route_.presence.offer_while_published);
    sd::ServiceSpec& spec = offer_->spec();
    if (route_.transport == Transport::tcp) {
      spec.tcp_port = route_.port;
      spec.tcp_events.push_back(route_.event);
    } else {
      spec.udp_port = route_.port;
    }
    auto& groups = spec.eventgroups;
    auto group = std::ranges::find(groups, route_.eventgroup, &sd::EventgroupSpec::id);
    if (group == groups.end()) {
      group = groups.insert(group, {.id = route_.eventgroup});
    }
    if (route_.multicast) {
      group->multicast = route_.multicast->group;
      group->multicast_threshold = route_.multicast->threshold;
    }
    group->events.push_back(route_.event);
    spec.waits.push_back(
        {.id = route_.event,
         .rule = {.most = std::max<std::size_t>(1, route_.qos.depth), .keep_oldest = route_.qos.keep_all}});
    if (route_.e2e) {
      spec.e2e.push_back(
          {.id = route_.event, .protect = route_.e2e->profile, .payload_only = route_.e2e->payload_only});
    }
    // Late subscribers get the last value, as late readers do; none while the topic is not latched.
    if (route_.qos.transient_local || route_.qos.durability_as_published) {
      spec.fields.push_back({.notifier = route_.event,
                             .differs = [](ByteView, ByteView) { return true; },
                             .pacing = route_.tp});
    }
  }

  void join_dds() override {
    const std::string topic = dds::ros_topic_name(route_.topic);
    open_reader();
    if (route_.presence.offer_while_published) {
      offer_->needs([this] { return published(); });
      if (context_.watch != nullptr) {
        context_.watch->watch(topic, TopicWatch::End::reader, [offer = offer_] { offer->update(); });
      }
    }
    if (context_.publishers != nullptr && is_as_published(route_.qos)) {
      context_.publishers->add(topic, dds::ros_type_name(route_.type), ours_,
                               [this](const PublishedQos& published) { follow(published); });
    }
  }

  /// What waits or comes is counted as `stopped`.
  void stop() override {
    boost::circular_buffer<Waiting> dropped;  // released without the lock, as above
    const std::lock_guard lock{mutex_};
    is_stopped_ = true;
    stopped_ += waiting_.size();
    dropped.swap(waiting_);
  }

  /// Where the quality of service is to be as published: asks for the least that the publishers offer.
  /// Until this has been called samples wait, as they may be those of a latched topic. To be called when
  /// publishers have come or gone.
  void follow(const PublishedQos& published) override {
    const QosSettings wanted = followed(route_.qos, published);
    if (published.publishers > 0 && wanted != qos_) {
      exchange_reader(wanted);
    }
    between_readers_ = between_readers_ && published.publishers > 0;
    // What publishes nothing yet may be latched when it does. Of one that matches and is not known, as there
    // are more than can be remembered, that will never be known.
    hold(route_.qos.durability_as_published && published.publishers == 0 &&
         (!reader_ || reader_->matched() == 0));
  }

  [[nodiscard]] CounterGroup counters() const override {
    using enum someip::CounterKind;
    const dds::ReaderCounters dds = reader_ ? reader_->counters() : dds::ReaderCounters{};
    dds::ReaderCounters all = past_;
    all += dds;
    all.incompatible_qos = dds.incompatible_qos;  // of readers before: why they are gone
    const std::uint64_t publishers = reader_ ? reader_->matched() : 0;
    const std::uint64_t bridges = context_.dds->bridge_ends(dds::ros_topic_name(route_.topic)).size();
    const std::uint64_t offered = offer_->handle() ? 1 : 0;
    const std::lock_guard lock{mutex_};
    CounterGroup group{"route " + route_.topic + " to SOME/IP",
                       {{"received", received_},
                        {"carried", carried_},
                        {"bytes", carried_bytes_},
                        {"publishers", publishers, now},
                        {"bridges", bridges, now},
                        {"offered", offered, now},
                        {"no_subscriber", no_subscriber_, loss},
                        {"kept", kept_},
                        {"expired", expired_, loss},
                        {"overtaken", overtaken_, loss},
                        {"not_convertible", not_convertible_, loss},
                        {"too_large", too_large_, loss},
                        {"not_sent", send_dropped_, loss},
                        {"slow_subscriber", slow_subscriber_, loss},
                        {"copied", copied_},
                        {"stopped", stopped_, loss},
                        {"looped", loop_.looped(), loss}},
                       labels_of(picture_of(route_))};
    all.for_each_counter(losses_into(group));
    append_map(group, plan_);
    return group;
  }

  /// OK while somebody publishes the topic.
  void append_diagnoses(std::vector<Diagnosis>& diagnoses, bool all) const override {
    if (all) {
      diagnoses.push_back(route_state(counters(), published(), "nobody publishes the topic", route_));
    }
  }

  [[nodiscard]] const std::string* awaited() const override { return &route_.topic; }
  [[nodiscard]] const Route* looked_at() const override { return &route_; }

  [[nodiscard]] std::uint64_t received() const override {
    const std::lock_guard lock{mutex_};
    return received_;
  }

  [[nodiscard]] RoutePicture picture(const Surroundings& around) const override {
    RoutePicture result = picture_of(route_);
    result.dds.qos = picture_of(qos_);
    result.dds.open = reader_ != nullptr;
    result.dds.matched = reader_ ? static_cast<std::uint32_t>(reader_->matched()) : 0;
    for (const dds::FoundWriter& one : around.writers_of(dds::ros_topic_name(route_.topic))) {
      // Not of bridges that it has nothing to do with.
      if ((!one.bridge || goes_on(ours_, one.bridge_text)) && result.dds.writers.size() < most_in_picture) {
        result.dds.writers.push_back(picture_of(one));
      }
    }
    const auto& handle = offer_->handle();
    result.someip.offered = handle.has_value();
    result.someip.subscribers =
        handle ? static_cast<std::uint32_t>(context_.someip->subscribers(*handle, route_.event)) : 0;
    result.carried = carried_ + kept_;
    result.bytes = carried_bytes_;
    result.limit = static_cast<std::uint32_t>(std::max<std::size_t>(1, route_.qos.depth));
    RouteClock::TimePoint came{};
    {
      const std::lock_guard lock{mutex_};
      result.received = received_;
      result.in_use = static_cast<std::uint32_t>(waiting_.size());
      came = came_;
    }
    meter_.fill(result, context_.clock, came);
    return result;
  }

 private:
  // On a thread of DDS.
  void on_sample(dds::Sample sample) {
    std::optional<dds::Sample> oldest;  // released without the lock: DDS has locks of its own
    bool wake = false;
    const std::uint64_t hash = message_hash(sample.cdr());
    // Behind a bridge there are all senders of its network.
    const std::optional<std::uint64_t> from =
        sample.from_bridge() ? std::nullopt : std::optional{message_hash(sample.id().writer)};
    const auto now = context_.clock.now();
    {
      const std::lock_guard lock{mutex_};
      if (!seen_.empty() && was_seen(sample.id())) {
        return;
      }
      ++received_;
      came_ = now;
      if (is_stopped_) {
        ++stopped_;
        return;
      }
      if (!loop_.may_carry(hash, from, now, [&] {
            return from ? "the DDS writer " + sample.writer() : name_of(sample.id().writer);
          })) {
        look_at_rings_ = true;
        wake = !std::exchange(woken_, true);
        oldest = std::move(sample);
      } else if (route_.qos.keep_all && waiting_.full()) {
        ++overtaken_;
        return;
      } else {
        if (waiting_.full()) {
          oldest = std::move(waiting_.front().sample);
          waiting_.pop_front();
          ++overtaken_;
        }
        waiting_.push_back({std::move(sample), now});
        wake = !held_ && !no_room_ && !std::exchange(woken_, true);
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
    const auto now = context_.clock.now();
    bool wake = false;
    {
      const std::lock_guard lock{mutex_};
      bridged_by_ = writer;
      returned_ += loop_.is_repeat(hash, now) ? 1U : 0U;
      wake = !told_bridged_ || (!told_returned_ && returned_ >= returned_in_ring);
      look_at_rings_ = look_at_rings_ || wake;
      wake = wake && !std::exchange(woken_, true);
    }
    if (wake) {
      drain_soon();
    }
  }

  void drain_soon() {
    boost::asio::post(context_.io, boost::asio::bind_allocator(memory_, [weak = weak_from_this()] {
                        if (const auto self = weak.lock()) {
                          self->drain();
                        }
                      }));
  }

  // Whether the reader before had it already: who asks for what was published before gets that again.
  bool was_seen(const dds::SampleId& id) {
    const auto last = std::ranges::find(seen_, id.writer, &dds::SampleId::writer);
    if (last == seen_.end()) {
      return false;
    }
    if (id.sequence <= last->sequence) {
      return true;
    }
    seen_.erase(last);
    return false;
  }

  std::optional<Waiting> next_sample() {
    const std::lock_guard lock{mutex_};
    if (waiting_.empty() || held_ || no_room_) {
      woken_ = false;
      return std::nullopt;
    }
    std::optional<Waiting> sample{std::move(waiting_.front())};
    waiting_.pop_front();
    return sample;
  }

  // From here on: on the thread that runs the io_context.
  void open_reader() {
    reader_ = context_.dds->reader(
        dds::ros_topic_name(route_.topic), dds::ros_type_name(route_.type), qos_,
        [this](dds::Sample sample) { on_sample(std::move(sample)); }, max_sample_bytes(route_),
        {.user_data = user_data_,
         .bridge = to_text(ours_),
         .takes_bridge = [mark = ours_](std::string_view other) { return goes_on(mark, other); },
         .on_bridged = [this](ByteView cdr, const dds::Guid& writer) { on_bridged(cdr, writer); }});
  }

  void exchange_reader(const QosSettings& wanted) {
    if (reader_) {
      between_readers_ = reader_->matched() > 0;
      past_ += reader_->counters();
      reader_.reset();
    }
    const bool begins_to_latch = wanted.transient_local && !qos_.transient_local;
    if (qos_.transient_local && !wanted.transient_local) {
      offer_->forget(route_.event);
    }
    qos_ = wanted;
    {
      const std::lock_guard lock{mutex_};
      seen_.clear();
      for (const Waiting& one : waiting_) {
        const dds::SampleId id = one.sample.id();
        const auto known = std::ranges::find(seen_, id.writer, &dds::SampleId::writer);
        if (known != seen_.end()) {
          known->sequence = std::max(known->sequence, id.sequence);
        } else if (begins_to_latch) {
          seen_.push_back(id);
        }
      }
    }
    spdlog::info("{}: asks for what its publishers offer: {}, {}", route_.topic,
                 qos_.reliable ? "reliable" : "best_effort",
                 qos_.transient_local ? "transient_local" : "volatile");
    try {
      open_reader();
    } catch (const std::exception& error) {  // tried again when publishers come or go
      spdlog::error("{}: {}", route_.topic, error.what());
    }
  }

  void hold(bool now) {
    bool wake = false;
    {
      const std::lock_guard lock{mutex_};
      held_ = now;
      wake = !held_ && !waiting_.empty() && !std::exchange(woken_, true);
    }
    if (wake) {
      drain_soon();
    }
  }

  void tell_of_rings() {
    loop_.arm();
    std::optional<dds::Guid> by;
    bool in_ring = false;
    {
      const std::lock_guard lock{mutex_};
      in_ring = !told_returned_ && returned_ >= returned_in_ring;
      if (bridged_by_ && (!told_bridged_ || in_ring)) {
        by = bridged_by_;
        told_bridged_ = true;
        told_returned_ = told_returned_ || in_ring;
      }
    }
    if (by && in_ring) {
      spdlog::error(
          "{}: this route seems to loop through {}: what it carries comes back from there. It is not carried "
          "again; end the ring (docs/several_bridges.md)",
          route_.topic, name_of(*by));
    } else if (by) {
      spdlog::info("{}: what {} brings from SOME/IP is not carried there again", route_.topic, name_of(*by));
    }
  }

  // Of the bridge whose writer it is.
  [[nodiscard]] std::string name_of(const dds::Guid& writer) const {
    for (const dds::BridgeEnd& end : context_.dds->bridge_ends(dds::ros_topic_name(route_.topic))) {
      const auto mark = end.guid == writer ? parse_bridge_mark(end.text) : std::nullopt;
      if (mark) {
        return "the bridge " + someip::to_string(mark->address);
      }
    }
    return "another bridge";
  }

  void drain() {
    if (look_at_rings_.exchange(false)) {
      tell_of_rings();
    }
    if (draining_) {
      return;  // a job that was done at once: the loop below goes on
    }
    draining_ = true;
    while (auto next = next_sample()) {
      carry(std::move(*next));
    }
    draining_ = false;
  }

  void carry(Waiting next) {
    dds::Sample& sample = next.sample;
    if (idle_jobs_.empty()) {
      idle_jobs_.push_back(std::make_unique<Job>());
      ++jobs_;
    }
    plan_.expect(sample.cdr(), idle_jobs_.back()->scratch);
    if (onlooker_ != nullptr && !next.is_tried) {
      onlooker_->keep_sample(sample.cdr());
    }
    if (is_expired(sample)) {
      ++expired_;
      return;
    }
    if (!qos_.transient_local &&
        (!offer_->handle() || context_.someip->subscribers(*offer_->handle(), route_.event) == 0)) {
      ++no_subscriber_;
      return;
    }
    // If too many are lent out to slow subscribers, what has to wait of this one is copied, to memory that
    // has a bound of its own: NodeConfig::max_queued_bytes.
    const bool lend = jobs_ - idle_jobs_.size() < max_lent_;
    const auto job = take_job();
    job->sample = std::move(sample);
    const auto before = context_.clock.now();
    const auto payload = plan_.cdr_to_someip(job->sample.cdr(), job->scratch);
    const auto after = context_.clock.now();
    if (!payload) {
      ++not_convertible_;
      log_.refused(payload.error(), job->sample.cdr());
      return;
    }
    if (payload->bytes > route_.tp.max_message) {
      ++too_large_;
      return;
    }
    const std::size_t bytes = payload->bytes;
    const auto source_time = job->sample.source_time();
    const auto sent = qos_.transient_local
                          ? offer_->set(route_.event, gathered(*payload))
                          : context_.someip->notify(*offer_->handle(), route_.event, payload->slices,
                                                    lend ? job : std::shared_ptr<const void>{}, pacing_);
    if (sent.no_room > 0 && sent.subscribers == 0) {
      wait_for_room({std::move(job->sample), next.came, true}, bytes);
      return;
    }
    copied_ += lend || qos_.transient_local ? 0 : 1;
    send_dropped_ += sent.dropped;
    slow_subscriber_ += sent.overtaken;
    if (sent.subscribers == 0 && qos_.transient_local) {
      ++kept_;
      meter_.carried(after, bytes);
    }
    if (sent.subscribers > 0) {
      ++carried_;
      carried_bytes_ += bytes;
      meter_.carried({.came = next.came,
                      .before = before,
                      .after = after,
                      .sent = context_.clock.now(),
                      .source = since(source_time),
                      .bytes = bytes,
                      .session = sent.session});
      context_.report.carried({.topic = route_.topic,
                               .direction = route_.direction,
                               .session = sent.session,
                               .before = before,
                               .after = after,
                               .source_time = source_time,
                               .bytes = bytes});
    }
  }

  // Too much waits for all who want this sample. It is sent when there is room again, unless newer ones take
  // its place. Where all are to be kept, the newest gives way.
  void wait_for_room(Waiting refused, std::size_t bytes) {
    std::optional<dds::Sample> dropped;  // released without the lock, as above
    {
      const std::lock_guard lock{mutex_};
      no_room_ = true;
      if (is_stopped_) {
        ++stopped_;
        dropped = std::move(refused.sample);
      } else if (!waiting_.full()) {
        waiting_.push_front(std::move(refused));
      } else {
        ++overtaken_;
        if (route_.qos.keep_all) {
          dropped = std::move(waiting_.back().sample);
          waiting_.pop_back();
          waiting_.push_front(std::move(refused));
        } else {
          dropped = std::move(refused.sample);
        }
      }
    }
    context_.someip->when_room(*offer_->handle(), route_.event, bytes, [weak = weak_from_this()] {
      if (const auto self = weak.lock()) {
        {
          const std::lock_guard lock{self->mutex_};
          self->no_room_ = false;
        }
        self->drain();
      }
    });
  }

  // Since then, by the clock on the wall; negative: the writer did not say when.
  [[nodiscard]] std::chrono::nanoseconds since(std::chrono::nanoseconds source_time) const {
    return source_time.count() <= 0
               ? std::chrono::nanoseconds{-1}
               : std::max(std::chrono::nanoseconds{0}, context_.clock.since_1970() - source_time);
  }

  // Nothing that waited for longer than its lifespan is worth carrying.
  [[nodiscard]] bool is_expired(const dds::Sample& sample) const {
    return route_.qos.lifespan.count() > 0 && sample.source_time().count() > 0 &&
           context_.clock.since_1970() > sample.source_time() + route_.qos.lifespan;
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
    std::unique_ptr<Job> job = std::move(idle_jobs_.back());
    idle_jobs_.pop_back();
    return {job.release(),
            [weak = weak_from_this()](Job* done) {
              std::unique_ptr<Job> owned{done};
              owned->sample.release();
              if (const auto self = weak.lock()) {
                self->idle_jobs_.push_back(std::move(owned));
                self->drain();
              }
            },
            memory_};
  }

  /// Whether the topic has a publisher now.
  [[nodiscard]] bool published() const {
    const bool matches = reader_ && reader_->matched() > 0;
    between_readers_ = between_readers_ && !matches;
    return matches || between_readers_;
  }

  const RouteContext& context_;
  const std::string user_data_;
  ServiceOffer* offer_ = nullptr;
  const Route route_;
  messages::MappedPlan plan_;
  ConversionLog log_;
  const BridgeMark ours_;  ///< what the reader says of itself
  std::atomic<bool> look_at_rings_ = false;
  LoopGuard loop_;  ///< but for its timer under the mutex
  const someip::TpPacing pacing_;
  const someip::PoolAllocator<std::byte> memory_;  ///< of what comes and goes with each sample
  const std::size_t max_lent_;
  QosSettings qos_;                       ///< of the reader
  mutable bool between_readers_ = false;  ///< the reader is new, and matches again what the one before did
  dds::ReaderCounters past_;              ///< of readers before
  std::vector<std::unique_ptr<Job>> idle_jobs_;
  std::size_t jobs_ = 0;  ///< those that are idle, and one for each sample that is lent out
  bool draining_ = false;
  RouteMeter meter_;
  std::uint64_t carried_ = 0;
  std::uint64_t carried_bytes_ = 0;
  std::uint64_t kept_ = 0;  ///< values of a latched topic that wait for subscribers
  std::uint64_t no_subscriber_ = 0;
  std::uint64_t expired_ = 0;
  std::uint64_t not_convertible_ = 0;
  std::uint64_t too_large_ = 0;
  std::uint64_t send_dropped_ = 0;
  std::uint64_t slow_subscriber_ = 0;
  std::uint64_t copied_ = 0;  ///< samples that could not be lent out

  mutable std::mutex mutex_;  // of what follows
  boost::circular_buffer<Waiting> waiting_;
  bool no_room_ = false;             ///< to send: what comes waits until there is
  bool held_;                        ///< what comes waits until it is known whether the topic is latched
  std::vector<dds::SampleId> seen_;  ///< the last of each writer that the reader before had
  bool woken_ = false;               ///< drain() has been asked for
  RouteClock::TimePoint came_{};     ///< the last one
  std::uint64_t received_ = 0;
  std::uint64_t overtaken_ = 0;
  bool is_stopped_ = false;
  std::uint64_t stopped_ = 0;
  std::optional<dds::Guid> bridged_by_;  ///< the last one
  std::uint64_t returned_ = 0;           ///< what others brought back that was carried before
  bool told_bridged_ = false;
  bool told_returned_ = false;

  std::unique_ptr<DdsReader> reader_;  // last: its destructor waits for callbacks that use the above
};

}  // namespace

void topic_to_event(RouteMaker& maker) {
  maker.each(maker.config.routes, [&](const Route& route) {
    return route.direction == Direction::dds_to_someip
               ? std::make_shared<TopicToEvent>(maker.context, route, compile(route, maker.types),
                                                user_data_of(route.type, maker.types))
               : nullptr;
  });
}

}  // namespace trestle::carry
