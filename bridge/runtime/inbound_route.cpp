#include "bridge/runtime/inbound_route.hpp"

#include "bridge/runtime/sample_limit.hpp"
#include "dds_adapter/ros_names.hpp"

namespace trestle::bridge {

InboundRoute::InboundRoute(sd::Node& node, const Route& route, const sd::SubscribeSpec& subscription,
                           ConversionPlan plan, Report& report)
    : route_{route}, plan_{std::move(plan)}, report_{report}, log_{route.topic} {
  node.subscribe(subscription, [this](const someip::Message& event, const Endpoint&) { carry(event); });
}

void InboundRoute::open(dds::Participant& participant) {
  writer_ = participant.create_writer(dds::ros_topic_name(route_.topic), dds::ros_type_name(route_.type),
                                      {.reliable = route_.qos.reliable,
                                       .transient_local = route_.qos.transient_local,
                                       .depth = route_.qos.depth},
                                      max_sample_bytes(route_));
}

void InboundRoute::carry(const someip::Message& event) {
  ++received_;
  // A late joiner of a transient-local topic wants what was written before it came.
  if (writer_->matched() == 0 && !route_.qos.transient_local) {
    ++no_reader_;
    return;
  }
  // The node takes what the largest route takes.
  if (event.payload.size() > route_.tp.max_message) {
    ++too_large_;
    return;
  }
  const auto before = Clock::now();
  const auto sample = plan_.someip_to_cdr(event.payload, scratch_);
  const auto after = Clock::now();
  if (!sample) {
    ++not_convertible_;
    log_.refused(sample.error());
    return;
  }
  if (!writer_->write(sample->slices)) {
    return;  // counted by the writer
  }
  ++carried_;
  carried_bytes_ += sample->bytes;
  report_.carried({.topic = route_.topic,
                   .direction = route_.direction,
                   .session = event.header.session,
                   .before = before,
                   .after = after,
                   .source_time = {},
                   .bytes = sample->bytes});
}

CounterGroup InboundRoute::counters() const {
  using enum Counter::Kind;
  const dds::WriterCounters dds = writer_->counters();
  return {"route " + route_.topic + " from SOME/IP",
          {{"received", received_},
           {"carried", carried_},
           {"bytes", carried_bytes_},
           {"no_reader", no_reader_, loss},
           {"not_convertible", not_convertible_, loss},
           {"too_large", too_large_, loss},
           {"dds_bad_encapsulation", dds.bad_encapsulation, loss},
           {"dds_oversize", dds.oversize, loss},
           {"dds_refused", dds.refused, loss},
           {"dds_overwritten", dds.overwritten, loss}}};
}

}  // namespace trestle::bridge
