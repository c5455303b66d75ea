#include "bridge/carry/runtime/make_routes.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "bridge/carry/config/bridge_config.hpp"
#include "bridge/carry/runtime/bridge_mark.hpp"
#include "bridge/carry/runtime/calm_updates.hpp"
#include "bridge/carry/runtime/conversion_log.hpp"
#include "bridge/carry/runtime/onlookers.hpp"
#include "bridge/carry/runtime/route_meter.hpp"
#include "bridge/carry/runtime/sample_limit.hpp"
#include "bridge/carry/runtime/suspected_loop.hpp"
#include "bridge/messages/map/mapped_plan.hpp"
#include "dds_adapter/ros_names.hpp"
#include "someip/net/address_text.hpp"
#include "someip/wire/counters.hpp"

namespace trestle::carry {
namespace {

/// Carries a SOME/IP event to a DDS topic, on the thread that runs the io_context: the reassembled payload is
/// converted where it lies and written to DDS, which copies it once. As the route's presence says, it writes
/// to the topic only while the service is offered, and subscribes only while somebody reads. What another
/// bridge takes from the very topic is not written there again. Where somebody at the sender's host reads the
/// topic who does not say that he is a bridge, what comes again and again is put on trial: LoopGuard.
class EventToTopic final : public RunningRoute {
 public:
  /// @param context  outlives the route.
  /// @param user_data  of the writer.
  EventToTopic(const RouteContext& context, const Route& route, const sd::SubscribeSpec& subscription,
               messages::MappedPlan plan, std::string user_data)
      : RunningRoute{route.e2e},
        context_{context},
        subscription_spec_{subscription},
        route_{route},
        plan_{std::move(plan)},
        log_{context.clock, route.topic},
        user_data_{std::move(user_data)},
        mark_{mark_of(context.address, route)},
        returns_{dds::ros_topic_name(route.topic), mark_},
        loop_{context.clock,
              route.topic,
              {dds::ros_topic_name(route.topic), false},
              ", who reads the topic, and the SOME/IP service at "},
        updates_{context.clock, [this] { return update(); }} {}

  /// Subscribes, or looks for the service.
  void join_someip() override {
    const sd::SubscribeSpec& wanted = subscription_spec_;
    if (context_.values != nullptr) {
      on_value_ = context_.values->of(route_.service, route_.instance, route_.event);
    }
    if (route_.presence.write_while_offered) {
      requirement_ =
          context_.someip->require({.service = wanted.service,
                                    .instance = wanted.instance,
                                    .major = wanted.major,
                                    .minor = wanted.minor},
                                   [this](const sd::RemoteService&, bool) { updates_.look_soon(); });
    }
    if (!route_.presence.subscribe_while_read) {
      subscribe();
    } else if (wanted.udp && wanted.port != 0) {
      port_ = context_.someip->hold_port(wanted.port, Transport::udp);
    }
  }

  void join_dds() override {
    if (context_.watch != nullptr && route_.presence.subscribe_while_read) {
      context_.watch->watch(dds::ros_topic_name(route_.topic), TopicWatch::End::writer, [this] { update(); });
    }
    if (context_.watch != nullptr && route_.qos.transient_local) {
      context_.watch->watch(dds::ros_topic_name(route_.topic), TopicWatch::End::writer,
                            [this] { bridges_changed(); });
    }
    if (!requirement_) {
      make_writer();
    }
  }

  void stop() override {
    past_faults_ = faults();  // the node forgets its subscriptions
    stopped_ = true;
  }

  [[nodiscard]] CounterGroup counters() const override {
    using enum someip::CounterKind;
    const sd::SubscriptionFaults sd = faults();
    dds::WriterCounters dds = past_writers_;
    if (writer_) {
      dds += writer_->counters();
    }
    CounterGroup group{
        "route " + route_.topic + " from SOME/IP",
        {{"received", received_},
         {"carried", carried_},
         {"bytes", carried_bytes_},
         {"readers", writer_ ? writer_->matched() : 0, now},
         {"bridges", bridges(), now},
         {"written", writer_ ? 1U : 0U, now},
         {"subscribed", subscription_ && context_.someip->subscribed(*subscription_) ? 1U : 0U, now},
         {"refused", sd.refused, loss},
         {"other_transport", sd.other_transport, loss},
         {"other_version", sd.other_version, loss},
         {"returned", returned_, loss},
         {"looped", loop_.looped(), loss},
         {"unexpected", sd.other_events, loss},
         {"no_reader", no_reader_, loss},
         {"not_convertible", not_convertible_, loss},
         {"too_large", too_large_, loss}},
        labels_of(picture_of(route_))};
    dds.for_each_counter(losses_into(group));
    append_map(group, plan_);
    append_e2e(group, e2e_);
    return group;
  }

  /// Its state is OK while it is subscribed, or need not be as nobody reads.
  void append_diagnoses(std::vector<Diagnosis>& diagnoses, bool all) const override {
    append_checks(diagnoses, route_.topic, event_id(route_));
    if (all) {
      const bool waits = !subscription_ && route_.presence.subscribe_while_read &&
                         (!requirement_ || !context_.someip->available(*requirement_).empty());
      diagnoses.push_back(route_state(counters(),
                                      waits || (subscription_ && context_.someip->subscribed(*subscription_)),
                                      "the SOME/IP service is not there, or not subscribed to", route_));
    }
  }

  [[nodiscard]] const std::string* awaited() const override { return &route_.topic; }
  [[nodiscard]] const Route* looked_at() const override { return &route_; }
  [[nodiscard]] std::uint64_t received() const override { return received_; }

  [[nodiscard]] RoutePicture picture(const Surroundings& around) const override {
    RoutePicture result = picture_of(route_);
    const sd::SubscriptionFaults sd = faults();
    const sd::OtherEvents others =
        subscription_ && !stopped_ ? context_.someip->other_events(*subscription_) : sd::OtherEvents{};
    result.someip.offers = pictures_of(around.offers_of(route_.service));
    result.someip.wanted = subscription_.has_value();
    result.someip.subscribed = subscription_ && !stopped_ && context_.someip->subscribed(*subscription_);
    result.someip.refused = sd.refused > 0;
    result.someip.over_tcp_only = sd.other_transport > 0;
    result.someip.other_events = others.count;
    for (const someip::MethodId id : others.ids) {
      result.someip.other_ids.push_back(value(id));
    }
    result.dds.open = writer_ != nullptr;
    if (writer_) {
      result.dds.matched = static_cast<std::uint32_t>(writer_->matched());
      result.dds.incompatible_qos = writer_->counters().incompatible_qos;
    }
    result.received = received_;
    result.carried = carried_;
    result.bytes = carried_bytes_;
    meter_.fill(result, context_.clock);
    return result;
  }

 private:
  // What was written before the other bridge was known is forgotten: who comes late has it from its
  // publisher.
  void bridges_changed() {
    if (stopped_ || !returns_.update(*context_.dds) || returns_.none() || !writer_) {
      return;
    }
    try {
      drop_writer();
      make_writer();
    } catch (const std::exception& error) {
      spdlog::error("{}: {}", route_.topic, error.what());
    }
  }

  void carry(const someip::Message& event, const Endpoint& from) {
    plan_.expect(event.payload, scratch_);
    const auto came = context_.clock.now();
    meter_.came(came);
    ++received_;
    if (onlooker_ != nullptr) {
      onlooker_->keep_payload(event.payload);
    }
    if (comes_back(from)) {
      return;
    }
    if (e2e_ && event.check != nullptr) {
      e2e_->note(*event.check);
      if (!e2e_->passes()) {
        return;
      }
    }
    // The node takes what the largest route takes.
    if (event.payload.size() > route_.tp.max_message) {
      ++too_large_;
      return;
    }
    if (on_value_) {
      on_value_(event.payload);
    }
    // The first value comes with the acknowledgement, perhaps before the route has looked at the offer.
    if (!writer_) {
      updates_.look_if_due();
    }
    // A late joiner of a transient-local topic wants what was written before it came.
    if (!writer_ || (writer_->matched() == 0 && !route_.qos.transient_local)) {
      ++no_reader_;
      if (writer_) {
        writer_->forget_written();
      }
      return;
    }
    const auto before = context_.clock.now();
    if (loop_.refuses(event.payload, from, *context_.dds, before)) {
      return;
    }
    const auto received = plan_.needs_time() ? context_.clock.since_1970() : std::chrono::nanoseconds{0};
    const auto sample = plan_.someip_to_cdr(event.payload, received, scratch_);
    const auto after = context_.clock.now();
    if (!sample) {
      ++not_convertible_;
      log_.refused(sample.error(), event.payload, &route_.rules.payload);
      return;
    }
    if (!writer_->write(sample->slices)) {
      return;  // counted by the writer
    }
    ++carried_;
    carried_bytes_ += sample->bytes;
    meter_.carried({.came = came,
                    .before = before,
                    .after = after,
                    .sent = context_.clock.now(),
                    .bytes = sample->bytes,
                    .session = event.header.session});
    context_.report.carried({.topic = route_.topic,
                             .direction = route_.direction,
                             .session = event.header.session,
                             .before = before,
                             .after = after,
                             .source_time = {},
                             .bytes = sample->bytes});
  }

  /// Whether the event was on the topic before.
  [[nodiscard]] bool comes_back(const Endpoint& from) {
    if (!route_.qos.transient_local) {  // else by bridges_changed()
      returns_.update(*context_.dds);
    }
    if (!returns_.has(from.address)) {
      return false;
    }
    ++returned_;
    if (told_returns_.size() < 8 && std::ranges::find(told_returns_, from.address) == told_returns_.end()) {
      told_returns_.push_back(from.address);
      spdlog::warn("{}: what comes from {} is not carried: the bridge there takes it from this topic",
                   route_.topic, someip::to_string(from.address));
    }
    return true;
  }

  void subscribe() {
    subscription_ = context_.someip->subscribe(
        subscription_spec_,
        [this](const someip::Message& event, const Endpoint& from) { carry(event, from); });
  }

  /// Makes or ends writer and subscription, as they are needed. Returns whether the writer has changed.
  bool update() {
    bool changed = false;
    if (stopped_) {
      return changed;
    }
    try {
      const bool offered = !requirement_ || !context_.someip->available(*requirement_).empty();
      changed = offered == (writer_ == nullptr);
      if (offered && !writer_) {
        make_writer();
      } else if (!offered && writer_) {
        drop_writer();
      }
      if (!route_.presence.subscribe_while_read) {
        return changed;
      }
      const bool read = writer_ && writer_->matched() > 0;
      if (read && !subscription_) {
        subscribe();
      } else if (!read && subscription_) {
        past_faults_ = faults();
        context_.someip->unsubscribe(*subscription_);
        subscription_.reset();
        if (on_value_) {
          on_value_(std::nullopt);
        }
      }
    } catch (const std::exception& error) {
      spdlog::error("{}: {}", route_.topic, error.what());
    }
    return changed;
  }

  void make_writer() {
    writer_ = context_.dds->writer(
        dds::ros_topic_name(route_.topic), dds::ros_type_name(route_.type), route_.qos,
        max_sample_bytes(route_),
        {.on_match = loop_.suspects().on_match(),
         .user_data = user_data_,
         .bridge = to_text(mark_),
         .takes_bridge = [mark = mark_](std::string_view other) { return goes_on(mark, other); }});
  }

  void drop_writer() {
    past_writers_ += writer_->counters();
    writer_.reset();
  }

  [[nodiscard]] sd::SubscriptionFaults faults() const {
    sd::SubscriptionFaults sum = past_faults_;
    if (subscription_ && !stopped_) {
      someip::add_counters(sum, context_.someip->subscription_faults(*subscription_));
    }
    return sum;
  }

  // Ends of other bridges on the topic.
  [[nodiscard]] std::uint64_t bridges() const {
    return context_.dds->bridge_ends(dds::ros_topic_name(route_.topic)).size();
  }

  const RouteContext& context_;
  const sd::SubscribeSpec subscription_spec_;
  const Route route_;
  messages::MappedPlan plan_;
  messages::MappedScratch scratch_;
  ConversionLog log_;
  const std::string user_data_;
  const BridgeMark mark_;
  Returns returns_;
  std::vector<IpAddress> told_returns_;
  SuspectedLoop loop_;  ///< closed by a reader of the topic that does not say that it is a bridge
  std::unique_ptr<DdsWriter> writer_;
  dds::WriterCounters past_writers_;
  std::optional<sd::RequirementId> requirement_;  ///< to write while the service is offered
  std::optional<sd::SubscriptionId> subscription_;
  sd::SubscriptionFaults past_faults_;  ///< of subscriptions that have ended
  std::shared_ptr<const void> port_;    ///< held while there is no subscription, if it has a number
  /// A server that has restarted is lost and found by one message: when all of it has been looked at, nothing
  /// has changed, and the writer stays.
  CalmUpdates updates_;
  bool stopped_ = false;
  FieldValues::Told on_value_;  ///< of each payload
  RouteMeter meter_;
  std::uint64_t received_ = 0;
  std::uint64_t carried_ = 0;
  std::uint64_t carried_bytes_ = 0;
  std::uint64_t returned_ = 0;
  std::uint64_t no_reader_ = 0;
  std::uint64_t not_convertible_ = 0;
  std::uint64_t too_large_ = 0;
};

}  // namespace

void event_to_topic(RouteMaker& maker) {
  maker.each(maker.config.routes, [&](const Route& route) -> std::shared_ptr<RunningRoute> {
    if (route.direction != Direction::someip_to_dds) {
      return nullptr;
    }
    auto plan = compile(route, maker.types);
    const auto subscription = subscription_of(maker.config.routes, route, plan.wire());
    return std::make_shared<EventToTopic>(maker.context, route, subscription, std::move(plan),
                                          user_data_of(route.type, maker.types));
  });
}

}  // namespace trestle::carry
