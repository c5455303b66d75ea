#include <algorithm>

#include "bridge/conform/cases/all_cases.hpp"
#include "bridge/conform/trial.hpp"

namespace trestle::conform {
namespace {

using namespace std::chrono_literals;
using enum Level;

constexpr someip::MethodId event_uint8{0x8001};

void send_trigger(Trial& t, std::uint16_t method) {
  Call call = t.call(someip::MethodId{method});
  call.type = someip::MessageType::request_no_return;
  t.send(call);
}

/// An event that comes, with a field of it that has to be right.
auto subscribed(void (*judge)(Trial& t, const SeenMessage& seen)) {
  return [=](Trial& t) {
    const EventSource source = t.source();
    t.acknowledged(t.subscribe(source));
    judge(t, t.event(source));
  };
}

/// The same of an event of eventgroup 2 of the Enhanced Testability Service.
auto triggered(std::uint16_t method, someip::MethodId event) {
  return [=](Trial& t) {
    t.acknowledged(t.subscribe(t.profile.service(), someip::EventgroupId{2}, {t.own_endpoint()}));
    t.event({.event = event, .trigger = someip::MethodId{method}});
  };
}

/// Whatever notification comes first for the subscription; the case ends when none does.
SeenMessage any_notification(Trial& t) {
  const EventSource source = t.source();
  t.acknowledged(t.subscribe(source));
  t.pass();
  const std::size_t since = t.now();
  std::vector<SeenMessage> found;
  if (!t.ask_for(source, [&] {
        found = t.messages_since(since, [&](const SeenMessage& one) {
          return one.message.header.service == t.profile.service().service &&
                 (value(one.message.header.method) & 0x7fffU) == (value(source.event) & 0x7fffU) &&
                 one.packet->to == t.tester.local(t.udp());
        });
        return !found.empty();
      })) {
    t.missing("no event comes", "an event");
  }
  return found.front();
}

/// An eventgroup that goes from unicast to multicast, and one of its events with so many subscribers, each at
/// a port of its own.
SeenMessage with_subscribers(Trial& t, std::size_t missing) {
  const EventgroupProfile& group = t.eventgroup([](const EventgroupProfile& one) {
    return one.multicast && one.trigger && one.multicast_threshold > 1;
  });
  t.tester.open_udp(group.multicast);
  for (std::size_t count = 0; count + missing < group.multicast_threshold; ++count) {
    const PortId port = count == 0 ? t.udp() : t.tester.open_udp();
    t.acknowledged(
        t.subscribe(t.profile.service(), group.id, {endpoint_option(t.tester.local(port), Transport::udp)}));
  }
  SeenMessage seen = t.event({.event = group.events.front(), .trigger = group.trigger});
  t.pass();
  return seen;
}

void nothing(Trial&, const SeenMessage&) {}

/// The initial values of the first eventgroup that has some.
void initial(Trial& t, bool all) {
  const EventgroupProfile& group =
      t.eventgroup([](const EventgroupProfile& one) { return one.initial_values && !one.tcp; });
  std::vector<someip::MethodId> events = group.events;
  if (!all) {
    events.resize(1);
  }
  for (const SeenMessage& seen : t.initial_values(events, t.subscribe(group))) {
    t.require(seen.packet->to == t.tester.local(t.udp()), "receiver", "the subscriber, by unicast", "another",
              seen.packet);
  }
}

/// Whether another eventgroup has it as the notifier of a field.
bool is_of_field(const ServiceProfile& service, someip::MethodId event) {
  return std::ranges::any_of(service.eventgroups, [&](const EventgroupProfile& one) {
    return one.initial_values && std::ranges::find(one.events, event) != one.events.end();
  });
}

}  // namespace

void add_event_cases(Cases& cases) {
  const Need ets = Need::ets | Need::udp;
  const Cases all{
      {.id = "event.comes",
       .title = "sends an event to its subscriber",
       .requirements = {"feat_req_someipsd_204", "feat_req_someipsd_787", "feat_req_someip_361",
                        "feat_req_someipsd_422"},
       .tc8 = {"SOMEIP_ETS_147"},
       .needs = Need::event,
       .run = subscribed(nothing)},
      {.id = "event.id-bit",
       .title = "sends events whose id has the top bit set",
       .requirements = {"feat_req_someip_67"},
       .tc8 = {"SOMEIPSRV_BASIC_03"},
       .needs = Need::event,
       .run =
           [](Trial& t) {
             const SeenMessage seen = any_notification(t);
             t.equal("top bit of the Method ID", 1, value(seen.message.header.method) >> 15, seen.packet);
           }},
      {.id = "event.message-type",
       .title = "sends events as notifications",
       .requirements = {"feat_req_someip_684"},
       .needs = Need::event,
       .run =
           [](Trial& t) {
             const SeenMessage seen = any_notification(t);
             t.equal("Message Type", someip::MessageType::notification, seen.message.header.type,
                     seen.packet);
           }},
      {.id = "event.return-code",
       .title = "sends events with return code 0",
       .requirements = {"feat_req_someip_144", "feat_req_someip_683", "feat_req_someip_367"},
       .needs = Need::event,
       .run = subscribed([](Trial& t, const SeenMessage& seen) {
         t.equal("Return Code", someip::ReturnCode::ok, seen.message.header.return_code, seen.packet);
       })},
      {.id = "event.interface-version",
       .title = "sends events with the major version of the service",
       .requirements = {"feat_req_someip_92"},
       .needs = Need::event,
       .run = subscribed([](Trial& t, const SeenMessage& seen) {
         t.equal("Interface Version", t.profile.service().major, seen.message.header.interface_version,
                 seen.packet);
       })},
      {.id = "event.source-port",
       .title = "sends events from the offered UDP port",
       .requirements = {"feat_req_someipsd_758", "feat_req_someipsd_797", "feat_req_someipsd_781",
                        "feat_req_someipsd_850", "feat_req_someipsd_852", "feat_req_someipsd_858"},
       .tc8 = {"SOMEIPSRV_SD_MESSAGE_09"},
       .needs = Need::event,
       .run = subscribed([](Trial& t, const SeenMessage& seen) {
         const Endpoint offered = t.udp_of(t.profile.service());
         t.equal("UDP source port", offered.port, seen.packet->from.port, seen.packet);
         t.require(seen.packet->from.address == offered.address, "source address", "the offered one",
                   "another", seen.packet);
       })},
      {.id = "event.once",
       .title = "sends an event once to a subscriber, however often it has subscribed",
       .requirements = {"feat_req_someipsd_1168"},
       .needs = ets,
       .run =
           [](Trial& t) {
             const SdStimulus stimulus =
                 t.subscribe(t.profile.service(), someip::EventgroupId{2}, {t.own_endpoint()});
             t.acknowledged(stimulus);
             t.acknowledged(stimulus);
             const std::size_t since = t.now();
             std::size_t asked = 0;
             std::vector<SeenMessage> seen;
             const auto has_come = [&] {
               seen = t.messages_since(since, t.is_event(event_uint8));
               return !seen.empty();
             };
             if (!t.ask(
                     [&] {
                       ++asked;
                       send_trigger(t, 0x03);
                     },
                     has_come)) {
               t.missing("the event does not come", "one event");
             }
             t.pass();
             has_come();
             t.require(seen.size() <= asked, "events", std::to_string(asked), std::to_string(seen.size()),
                       seen.back().packet);
           }},
      {.id = "event.array",
       .title = "sends an array as an event",
       .requirements = {"feat_req_someipsd_787"},
       .tc8 = {"SOMEIP_ETS_148"},
       .needs = ets,
       .run = triggered(0x04, someip::MethodId{0x8002})},
      {.id = "event.e2e-shaped",
       .title = "sends an event that has the shape of end-to-end protection",
       .requirements = {"feat_req_someipsd_787"},
       .tc8 = {"SOMEIP_ETS_149"},
       .needs = ets,
       .run = triggered(0x06, someip::MethodId{0x8004})},
      {.id = "event.multicast",
       .title = "sends events of a multicast eventgroup to its group",
       .requirements = {"feat_req_someip_811", "feat_req_someipsd_763", "feat_req_someipsd_626"},
       .tc8 = {"SOMEIP_ETS_150"},
       .needs = ets | Need::multicast_events,
       .run =
           [](Trial& t) {
             const EventgroupProfile& group =
                 t.eventgroup([](const EventgroupProfile& one) { return one.multicast.has_value(); });
             t.tester.open_udp(group.multicast);
             t.acknowledged(t.subscribe(group));
             const SeenMessage seen =
                 t.event({.event = group.events.front(), .trigger = someip::MethodId{0x3a}});
             t.require(seen.packet->to == *group.multicast, "receiver", "the multicast group", "another",
                       seen.packet);
           }},
      {.id = "event.multicast-threshold.below",
       .title = "sends events by unicast while fewer subscribe than the multicast threshold",
       .requirements = {"feat_req_someip_813", "feat_req_someipsd_823"},
       .needs = Need::multicast_threshold | Need::udp,
       .run =
           [](Trial& t) {
             const SeenMessage seen = with_subscribers(t, 1);
             t.require(!seen.packet->to.address.is_multicast(), "receiver", "the subscriber", "the group",
                       seen.packet);
           }},
      {.id = "event.multicast-threshold.reached",
       .title = "sends events by multicast, and only so, when enough subscribe",
       .requirements = {"feat_req_someip_813", "feat_req_someipsd_823"},
       .needs = Need::multicast_threshold | Need::udp,
       .run =
           [](Trial& t) {
             const SeenMessage seen = with_subscribers(t, 0);
             for (const SeenMessage& one : t.messages_since(0, t.is_event(seen.message.header.method))) {
               t.require(one.packet->to.address.is_multicast(), "receiver", "the group", "a subscriber",
                         one.packet);
             }
           }},
      {.id = "event.second-service",
       .title = "sends events to a subscriber of more than one eventgroup at one port",
       .requirements = {"feat_req_someip_732", "feat_req_someipsd_787"},
       .needs = ets,
       .run =
           [](Trial& t) {
             t.acknowledged(t.subscribe(t.profile.service(), someip::EventgroupId{5}, {t.own_endpoint()}));
             t.acknowledged(t.subscribe(t.profile.service(), someip::EventgroupId{2}, {t.own_endpoint()}));
             t.event({.event = event_uint8, .trigger = someip::MethodId{0x03}});
           }},
      {.id = "event.not-subscribed",
       .title = "sends no events to whom has not subscribed",
       .requirements = {"feat_req_someip_807", "feat_req_someipsd_204"},
       .needs = Need::event,
       .run =
           [](Trial& t) {
             t.udp();
             for (const SeenMessage& seen : t.all_events(t.source())) {
               t.different("event", "none", "one", seen.packet);
             }
           }},
      {.id = "event.initial.comes",
       .title = "sends the value of a field to a new subscriber",
       .requirements = {"feat_req_someipsd_691", "feat_req_someipsd_833", "feat_req_someipsd_793",
                        "feat_req_someipsd_811"},
       .needs = Need::initial_values | Need::udp,
       .run = [](Trial& t) { initial(t, false); }},
      {.id = "event.initial.all",
       .title = "sends the values of all fields of an eventgroup to a new subscriber",
       .requirements = {"feat_req_someipsd_691", "feat_req_someipsd_833"},
       .tc8 = {"SOMEIP_ETS_121"},
       .needs = Need::initial_values | Need::udp,
       .run = [](Trial& t) { initial(t, true); }},
      {.id = "event.initial.not-of-events",
       .title = "sends no values of events that are no fields to a new subscriber",
       .requirements = {"feat_req_someipsd_833"},
       .needs = Need::eventgroup | Need::udp,
       .run =
           [](Trial& t) {
             const EventgroupProfile& group = t.eventgroup(
                 [](const EventgroupProfile& one) { return !one.initial_values && !one.tcp && !one.cycle; });
             const std::size_t since = t.now();
             t.acknowledged(t.subscribe(group));
             t.pass();
             for (const someip::MethodId event : group.events) {
               if (is_of_field(t.profile.service(), event)) {
                 continue;
               }
               for (const SeenMessage& seen : t.messages_since(since, t.is_event(event))) {
                 t.different("event", "none, as nothing has happened", fmt::format("{:#06x}", value(event)),
                             seen.packet);
               }
             }
           }},
      {.id = "event.initial.not-at-renewal",
       .title = "sends no values when a subscription is renewed",
       .requirements = {"feat_req_someipsd_833"},
       .needs = Need::initial_values | Need::udp,
       .run =
           [](Trial& t) {
             const EventgroupProfile& group =
                 t.eventgroup([](const EventgroupProfile& one) { return one.initial_values && !one.tcp; });
             t.initial_values({group.events.front()}, t.subscribe(group));
             t.pass();
             const std::size_t since = t.now();
             t.acknowledged(t.subscribe(group));
             t.pass();
             for (const SeenMessage& seen : t.messages_since(since, t.is_event(group.events.front()))) {
               t.different("initial event", "none for a renewed subscription", "one", seen.packet);
             }
           }},
      {.id = "event.field-changes",
       .title = "tells subscribers the new value of a field",
       .requirements = {"feat_req_someip_635"},
       .needs = Need::field | Need::initial_values | Need::udp,
       .run =
           [](Trial& t) {
             const FieldProfile& field = *t.profile.service().field;
             const EventgroupProfile& group =
                 t.eventgroup([](const EventgroupProfile& one) { return one.initial_values && !one.tcp; });
             if (group.id != field.eventgroup) {
               t.unsupported(
                   "the eventgroup of the field is not the first over UDP with initial_values: true");
             }
             const someip::MethodId notifier = group.events.front();
             t.initial_values({notifier}, t.subscribe(group));
             Bytes other = field.value;
             other.back() ^= std::byte{0x5a};
             std::size_t since = 0;
             std::vector<SeenMessage> seen;
             const auto change = [&] {
               t.good_answer_to(t.call(field.setter, other));
               t.pass();
               since = t.now();
               t.good_answer_to(t.call(field.setter, field.value));
             };
             if (!t.ask(change, [&] {
                   seen = t.messages_since(since, t.is_event(notifier));
                   return !seen.empty();
                 })) {
               t.missing("no event tells the new value", "an event");
             }
             t.equal("value", hex(field.value), hex(seen.front().message.payload), seen.front().packet);
           }},
  };
  cases.insert(cases.end(), all.begin(), all.end());
}

}  // namespace trestle::conform
