#include <algorithm>
#include <chrono>
#include <utility>

#include "fault_ways.hpp"

namespace ets {
namespace {

/// Of the last Subscribe, for faults that need it.
Receiver last_subscriber;
/// Whether an offer came that is none of ours.
bool offered_by_others = false;

void remember_subscriber(Incoming& in) {
  each_option(in.bytes, [](Span o) {
    if (type_of(o) == 4 && o.size() >= 12) {
      last_subscriber = receiver_in(o);
    }
  });
}

}  // namespace

std::vector<Fault> sd_faults() {
  return {
      // The header of SD messages.
      {"sd-client", "sd.header.client-id", "SD messages have Client ID 1",
       sd([](Span b) { set16(b, 8, 1); })},
      {"sd-session-zero", "sd.header.first-session", "sessions of SD count from 0",
       sd([](Span b) { add16(b, 10, 0xffff); })},
      {"sd-session-stuck", "sd.header.session-counts", "sessions of SD do not count",
       sd([](Span b) { set16(b, 10, 1); })},
      {"sd-session-wraps-to-0", "sd.header.session-wraps", "session 0 comes after 0xffff", sd([](Span b) {
         if (u16(b, 10) == 1 && (b[flags_at] & 0x80U) == 0) {
           set16(b, 10, 0);
         }
       })},
      {"sd-protocol", "sd.header.protocol-version", "SD messages have Protocol Version 2",
       sd([](Span b) { b[12] = 2; })},
      {"sd-interface", "sd.header.interface-version", "SD messages have Interface Version 2",
       sd([](Span b) { b[13] = 2; })},
      {"sd-type", "sd.header.message-type", "SD messages are requests", sd([](Span b) { b[14] = 0; })},
      {"sd-code", "sd.header.return-code", "SD messages have a return code", sd([](Span b) { b[15] = 1; })},
      {"sd-no-reboot-flag", "sd.flags.reboot", "the reboot flag is never set",
       sd([](Span b) { b[flags_at] = static_cast<std::uint8_t>(b[flags_at] & 0x7fU); })},
      {"sd-reboot-flag-stays", "sd.header.session-wraps", "the reboot flag stays set for ever",
       sd([](Span b) { b[flags_at] = static_cast<std::uint8_t>(b[flags_at] | 0x80U); })},
      {"sd-no-unicast-flag", "sd.flags.unicast", "the unicast flag is not set",
       sd([](Span b) { b[flags_at] = static_cast<std::uint8_t>(b[flags_at] & 0xbfU); })},
      {"sd-undefined-flag", "sd.flags.undefined", "an undefined flag is set",
       sd([](Span b) { b[flags_at] = static_cast<std::uint8_t>(b[flags_at] | 1U); })},
      {"sd-reserved", "sd.flags.reserved", "the reserved bytes after the flags are not 0",
       sd([](Span b) { b[19] = 1; })},

      // Offers.
      {"offer-service", "sd.offer.service", "offers name another service",
       entry(is_offer, [](Span e) { add16(e, 4, 0x0900); })},
      {"offer-instance", "sd.offer.instance", "offers name another instance",
       entry(is_offer, [](Span e) { add16(e, 6, 0x0900); })},
      {"offer-instance-any", "sd.offer.instance-is-one", "offers name instance 0xffff",
       entry(is_offer, [](Span e) { set16(e, 6, 0xffff); })},
      {"offer-major", "sd.offer.major", "offers name another major version",
       entry(is_offer, [](Span e) { add8(e, 8); })},
      {"offer-minor", "sd.offer.minor", "offers name another minor version",
       entry(is_offer, [](Span e) { add16(e, 14); })},
      {"offer-ttl", "sd.offer.ttl", "offers have another TTL", entry(is_offer, [](Span e) { add8(e, 11); })},
      {"offer-index", "sd.offer.first-option", "the first run of solicited offers begins at option 1",
       entry(is_offer, [](Span e) { e[1] = 1; })},
      {"offer-no-options", "sd.offer.options,sd.offer.endpoint", "offers refer to no options",
       entry(is_offer, [](Span e) { e[3] = 0; })},
      {"offer-beyond", "sd.offer.options-exist", "offers refer to more options than there are",
       entry(is_offer, [](Span e) { e[3] = 0xf0; })},
      {"offer-type", "sd.offer.entry-type", "offers are entries of type 3",
       entry(is_offer, [](Span e) { e[0] = 3; })},
      {"endpoint-length", "sd.option.endpoint.length", "endpoint options have Length 10",
       option(4, [](Span o) { set16(o, 0, 10); })},
      {"endpoint-type", "sd.option.endpoint.type", "endpoint options have type 0x44",
       option(4, [](Span o) { o[2] = 0x44; })},
      {"endpoint-reserved-1", "sd.option.endpoint.reserved", "the first reserved byte of endpoints is not 0",
       option(4, [](Span o) { o[3] = 1; })},
      {"endpoint-address", "sd.option.endpoint.address", "endpoints have another address",
       option(4, [](Span o) { add8(o, end_of_address_in(o), 7); })},
      {"endpoint-reserved-2", "sd.option.endpoint.reserved", "the second reserved byte of endpoints is not 0",
       option(4, [](Span o) { o[reserved_in(o)] = 1; })},
      {"endpoint-protocol", "sd.option.endpoint.protocol", "the first endpoint has protocol 0x84",
       option(4, [](Span o) { o[protocol_in(o)] = 0x84; })},
      {"endpoint-port", "sd.option.endpoint.port", "the first endpoint has another port",
       option(4, [](Span o) { add16(o, port_in(o), 100); })},
      {"offer-udp-only", "sd.option.endpoint.tcp,sd.offer.both-transports", "TCP endpoints say UDP",
       sd([](Span b) {
         each_option(b, [](Span o) {
           if (type_of(o) == 4 && o[protocol_in(o)] == 6) {
             o[protocol_in(o)] = 0x11;
           }
         });
       })},
      {"no-cyclic-offers", "sd.phase.cyclic,sd.header.session-counts", "there are no cyclic offers",
       [](Outgoing& out) {
         // Those of the start-up go out within half a second.
         static const auto start = std::chrono::steady_clock::now();
         if (out.multicast && any_entry(out.bytes, is_offer) &&
             std::chrono::steady_clock::now() - start > std::chrono::milliseconds{800}) {
           out.copies = 0;
         }
       }},
      {"offers-twice", "sd.phase.cyclic,sd.phase.repetition", "each offer is sent twice",
       [](Outgoing& out) {
         if (any_entry(out.bytes, is_offer)) {
           out.copies = 2;
         }
       }},
      {"no-repetitions", "sd.phase.repetition", "the second and third offer are not sent",
       [](Outgoing& out) {
         static int offers = 0;
         if (any_entry(out.bytes, is_offer) && (++offers == 2 || offers == 3)) {
           out.copies = 0;
         }
       }},
      {"no-stop-offer", "sd.stop-offer", "nothing is said when services stop", lose(is_stop_offer)},
      {"find-ignored",
       "sd.find.unicast,sd.find.multicast,sd.find.late-multicast-answer",
       "Finds are not answered",
       {},
       [](Incoming& in) {
         in.lost = in.bytes.size() >= entries_at + 16 && is_sd(in.bytes) && in.bytes[entries_at] == 0;
       }},
      {"find-exact-major-only",
       "sd.find.any-major",
       "Finds of any major version are not answered",
       {},
       [](Incoming& in) {
         in.lost = in.bytes.size() >= entries_at + 16 && is_sd(in.bytes) && in.bytes[entries_at] == 0 &&
                   in.bytes[entries_at + 8] == 0xff && u16(in.bytes, entries_at + 6) == 0xffff;
       }},
      {"find-any-answers-one", "sd.find.two-instances", "a Find of any instance is answered with one only",
       entry([](std::span<const std::uint8_t> e) { return is_offer(e) && u16(e, 6) == 2; },
             [](Span e) { set16(e, 4, 0x0999); })},
      {"find-other-major",
       "sd.find.other-major,sd.find.other-minor,sd.find.other-instance,sd.find.other-service",
       "a Find of what is not there is answered",
       {},
       [](Incoming& in) {
         if (in.bytes.size() >= entries_at + 16 && is_sd(in.bytes) && in.bytes[entries_at] == 0) {
           set16(in.bytes, entries_at + 4, 0x0101);
           set16(in.bytes, entries_at + 6, 0x0001);
           in.bytes[entries_at + 8] = 0xff;
           set32(in.bytes, entries_at + 12, 0xffffffff);
         }
       }},
      {"find-needs-unicast-flag",
       "sd.find.unicast-flag-clear,sd.find.legacy-multicast-answer",
       "Finds without the unicast flag are not answered",
       {},
       [](Incoming& in) {
         in.lost = in.bytes.size() >= entries_at + 16 && is_sd(in.bytes) && in.bytes[entries_at] == 0 &&
                   (in.bytes[flags_at] & 0x40U) == 0;
       }},
      {"find-with-options-ignored",
       "sd.find.unreferenced-options,sd.find.referenced-options",
       "Finds in messages with options are not answered",
       {},
       [](Incoming& in) {
         in.lost = in.bytes.size() > entries_at + 20 && is_sd(in.bytes) && in.bytes[entries_at] == 0;
       }},

      {"no-offers", "sd.phase.initial", "nothing is offered", lose(is_offer)},
      {"load-balancing-length", "sd.option.load-balancing.length",
       "load balancing options have a byte too many",
       [](Outgoing& out) {
         if (is_sd(out.bytes)) {
           for (std::size_t at = options_at(out.bytes); at + 3 <= out.bytes.size();
                at += 3 + u16(out.bytes, at)) {
             if (out.bytes[at + 2] == 2) {
               set16(out.bytes, at, 6);
               out.bytes.insert(out.bytes.begin() + static_cast<std::ptrdiff_t>(at) + 8, 0);
               set32(out.bytes, options_at(out.bytes) - 4, u32(out.bytes, options_at(out.bytes) - 4) + 1);
               set32(out.bytes, 4, u32(out.bytes, 4) + 1);
               return;
             }
           }
         }
       }},
      {"load-balancing-reserved", "sd.option.load-balancing.reserved",
       "the reserved byte of load balancing is not 0", option(2, [](Span o) { o[3] = 1; })},
      {"load-balancing-priority", "sd.option.load-balancing.priority", "offers have another priority",
       option(2, [](Span o) { add16(o, 4); })},
      {"load-balancing-weight", "sd.option.load-balancing.weight", "offers have another weight",
       option(2, [](Span o) { add16(o, 6); })},
      {"configuration-reserved", "sd.option.configuration.reserved",
       "the reserved byte of configurations is not 0", option(1, [](Span o) { o[3] = 1; })},
      {"configuration-item", "sd.option.configuration.items",
       "a letter of a configuration item is another one", option(1, [](Span o) { o[5] ^= 1U; })},
      {"configuration-end", "sd.option.configuration.end", "configurations do not end with 0",
       option(1, [](Span o) { o[o.size() - 1] = 1; })},
      {"one-version-only", "sd.versions",
       "of a service in two versions, the newer one is offered as the older",
       entry([](std::span<const std::uint8_t> e) { return is_offer(e) && u16(e, 4) == 0x0103; },
             [](Span e) { e[8] = 1; })},
      {"any-version-answers",
       "sd.versions.find",
       "a Find of one major version is answered with all",
       {},
       find_message([](Incoming& in) { in.bytes[entries_at + 8] = 0xff; })},
      {"versions-mixed-up", "sd.versions.requests", "responses have the oldest interface version",
       response([](Bytes& b) { b[13] = 1; })},
      {"initial-data-flag", "sd.initial-data.flag",
       "SD messages do not say that explicit initial data is known",
       sd([](Span b) { b[flags_at] = static_cast<std::uint8_t>(b[flags_at] & 0xdfU); })},
      {"initial-data-always",
       "sd.initial-data.not-asked,sd.initial-data.flag-clear",
       "who subscribes gets initial values, whatever is asked for",
       {},
       subscribe_message([](Incoming& in) {
         in.bytes[16] = static_cast<std::uint8_t>(in.bytes[16] | 0x20U);
         in.bytes[entries_at + 13] = static_cast<std::uint8_t>(in.bytes[entries_at + 13] | 0x80U);
       })},
      {"initial-data-unknown",
       "sd.initial-data.asked-at-renewal",
       "the wish for initial values is not seen",
       {},
       subscribe_message(
           [](Incoming& in) { in.bytes[16] = static_cast<std::uint8_t>(in.bytes[16] & 0xdfU); })},
      {"initial-data-without-flag",
       "sd.initial-data.flag-clear",
       "the flag of explicit initial data is not looked at",
       {},
       subscribe_message([](Incoming& in) {
         if ((in.bytes[entries_at + 13] & 0x80U) != 0) {
           in.bytes[16] = static_cast<std::uint8_t>(in.bytes[16] | 0x20U);
         }
       })},
      {"sd-endpoint-unknown",
       "sd.endpoint-option",
       "SD endpoint options are not known",
       {},
       [](Incoming& in) {
         if (is_sd(in.bytes)) {
           each_option(in.bytes, [](Span o) { o[2] = type_of(o) == 0x24 ? 0x77 : o[2]; });
         }
       }},
      {"sd-endpoint-last-counts",
       "sd.endpoint-option.surplus",
       "the last SD endpoint option counts",
       {},
       [](Incoming& in) {
         std::vector<Span> found;
         if (is_sd(in.bytes)) {
           each_option(in.bytes, [&](Span o) {
             if (type_of(o) == 0x24) {
               found.push_back(o);
             }
           });
         }
         if (found.size() > 1 && found.front().size() == found.back().size()) {
           std::ranges::swap_ranges(found.front(), found.back());
         }
       }},
      {"sd-endpoint-sent", "sd.endpoint-option.not-sent", "offers refer to an SD endpoint option",
       option(4, [](Span o) { add8(o, 2, 0x20); })},
      {"multicast-too-early", "event.multicast-threshold.below",
       "events go to the group whatever the threshold is",
       [](Outgoing& out) {
         // The group is that of the last acknowledgement.
         static Receiver group;
         option(0x14, [&](Span o) { group = receiver_in(o); })(out);
         if (is_event(out.bytes) && u16(out.bytes, 2) == 0x800c && group.port != 0) {
           out.to = group;
         }
       }},
      {"multicast-never", "event.multicast-threshold.reached",
       "events go to a subscriber, whatever the threshold is",
       [](Outgoing& out) {
         if (is_event(out.bytes) && u16(out.bytes, 2) == 0x800c && out.multicast &&
             last_subscriber.port != 0) {
           out.to = last_subscriber;
         }
       },
       subscribe_message(remember_subscriber)},
      {"initial-of-events", "event.initial.not-of-events",
       "who subscribes gets a value of an event that is no field",
       [](Outgoing& out) {
         if (any_entry(out.bytes, is_ack) && u16(out.bytes, entries_at + 14) == 2 &&
             last_subscriber.port != 0) {
           out.besides = {0x01, 0x01, 0x80, 0x01, 0, 0, 0, 9, 0, 0, 0, 1, 1, 1, 2, 0, 0x2a};
           out.besides_to = last_subscriber;
         }
       },
       subscribe_message(remember_subscriber)},
      {"second-service-elsewhere", "sd.offer.shared-port",
       "the second service is offered at the ports of another one",
       entry([](std::span<const std::uint8_t> e) { return is_offer(e) && u16(e, 4) == 0x0102; },
             [](Span e) { add8(e, 1, 2); })},
      {"find-exact-ignored",
       "sd.find.exact",
       "Finds of a minor version are not answered",
       {},
       find_message([](Incoming& in) { in.lost = u32(in.bytes, entries_at + 12) != 0xffffffff; })},
      {"find-instance-ignored",
       "sd.find.one-of-two-instances",
       "a Find of one instance is answered with all",
       {},
       find_message([](Incoming& in) { set16(in.bytes, entries_at + 6, 0xffff); })},
      {"find-tires",
       "sd.find.burst",
       "after some Finds there are no answers for a while",
       {},
       find_message([](Incoming& in) {
         static int count = 0;
         in.lost = ++count % 12 > 5;
       })},

      // Answers to subscriptions.
      {"ack-lost", "sd.subscribe.ack,sd.subscribe.several-entries", "subscriptions are not acknowledged",
       lose(is_ack)},
      {"ack-type", "sd.subscribe.ack.entry-type", "acknowledgements have type 6",
       entry(is_ack, [](Span e) { e[0] = 6; })},
      {"ack-index", "sd.subscribe.ack.first-option", "the first run of acknowledgements begins at option 1",
       entry(is_ack, [](Span e) { e[1] = 1; })},
      {"ack-service", "sd.subscribe.ack.service", "acknowledgements name another service",
       entry(is_ack, [](Span e) { add16(e, 4, 0x0900); })},
      {"ack-instance", "sd.subscribe.ack.instance", "acknowledgements name another instance",
       entry(is_ack, [](Span e) { add16(e, 6, 0x0900); })},
      {"ack-major", "sd.subscribe.ack.major", "acknowledgements name another major version",
       entry(is_ack, [](Span e) { add8(e, 8); })},
      {"ack-ttl", "sd.subscribe.ack.ttl", "acknowledgements have another TTL than was asked for",
       entry(is_ack, [](Span e) { add8(e, 11); })},
      {"ack-reserved", "sd.subscribe.ack.reserved", "acknowledgements have reserved bits set",
       entry(is_ack, [](Span e) { e[12] = 1; })},
      {"ack-counter", "sd.subscribe.ack.counter", "acknowledgements have counter 0",
       entry(is_ack, [](Span e) { e[13] = 0; })},
      {"ack-eventgroup", "sd.subscribe.ack.eventgroup", "acknowledgements name another eventgroup",
       entry(is_ack, [](Span e) { add16(e, 14, 0x0900); })},
      {"ack-size", "sd.subscribe.ack.size",
       "the entries array of acknowledgements is said to be 17 bytes long",
       [](Outgoing& out) {
         if (any_entry(out.bytes, is_ack)) {
           add16(out.bytes, 22);
         }
       }},
      {"nack-lost", "sd.subscribe.nack", "refusals are not sent", lose(is_nack)},
      {"nack-as-ack", "sd.subscribe.nack.unknown-service,sd.subscribe.endpoint,sd.subscribe.malformed",
       "refusals look like acknowledgements", entry(is_nack, [](Span e) { e[11] = 3; })},
      {"nack-service", "sd.subscribe.nack.unknown-service", "refusals name another service",
       entry(is_nack, [](Span e) { add16(e, 4); })},
      {"nack-instance", "sd.subscribe.nack.unknown-instance", "refusals name another instance",
       entry(is_nack, [](Span e) { add16(e, 6); })},
      {"nack-major", "sd.subscribe.nack.unknown-major", "refusals name another major version",
       entry(is_nack, [](Span e) { add8(e, 8); })},
      {"nack-eventgroup", "sd.subscribe.nack.unknown-eventgroup", "refusals name another eventgroup",
       entry(is_nack, [](Span e) { add16(e, 14); })},
      {"nack-reserved", "sd.subscribe.nack.echo", "refusals have reserved bits set",
       entry(is_nack, [](Span e) { e[12] = 1; })},
      {"multicast-length", "sd.option.multicast.length", "multicast options have Length 10",
       option(0x14, [](Span o) { set16(o, 0, 10); })},
      {"multicast-type", "sd.option.multicast.type", "multicast options have type 0x54",
       option(0x14, [](Span o) { o[2] = 0x54; })},
      {"multicast-reserved-1", "sd.option.multicast.reserved",
       "the first reserved byte of multicast options is not 0", option(0x14, [](Span o) { o[3] = 1; })},
      {"multicast-address", "sd.option.multicast.address", "multicast options have another address",
       option(0x14, [](Span o) { add8(o, end_of_address_in(o)); })},
      {"multicast-reserved-2", "sd.option.multicast.reserved",
       "the second reserved byte of multicast options is not 0",
       option(0x14, [](Span o) { o[reserved_in(o)] = 1; })},
      {"multicast-protocol", "sd.option.multicast.protocol", "multicast options say TCP",
       option(0x14, [](Span o) { o[protocol_in(o)] = 6; })},
      {"multicast-port", "sd.option.multicast.port", "multicast options have another port",
       option(0x14, [](Span o) { add16(o, port_in(o)); })},
      {"subscribe-any",
       "sd.subscribe",
       "whatever looks like a Subscribe is acknowledged at once",
       {},
       acknowledge_if([](Span) { return true; })},
      {"refuse-any",
       "sd.subscribe.malformed.options-length-beyond,sd.subscribe.ack,sd.subscribe.option,sd.subscribe."
       "trailing",
       "whatever looks like a Subscribe is refused at once",
       {},
       subscribe_message([](Incoming& in) { in.answers.push_back(acknowledgement(in.bytes, 0)); })},
      {"renewal-ignored",
       "sd.subscribe.again",
       "subscriptions are not renewed",
       {},
       subscribe_message([](Incoming& in) {
         static bool had = false;
         const bool stops = u24(in.bytes, entries_at + 9) == 0;
         in.lost = had && !stops;
         had = !stops;
       })},
      {"stopped-for-good",
       "sd.subscribe.stop-then-subscribe",
       "who has stopped a subscription gets none any more",
       {},
       subscribe_message([](Incoming& in) {
         static bool stopped = false;
         in.lost = stopped;
         stopped = stopped || u24(in.bytes, entries_at + 9) == 0;
       })},
      {"configuration-unknown",
       "sd.subscribe.option.redundant,sd.subscribe.option.unreferenced,sd.subscribe.option.two-"
       "configurations",
       "Subscribes with a configuration option are ignored",
       {},
       subscribe_message([](Incoming& in) {
         for (std::size_t at = options_at(in.bytes); at + 3 <= in.bytes.size(); at += 3 + u16(in.bytes, at)) {
           in.lost = in.lost || in.bytes[at + 2] == 1;
         }
       })},
      {"configuration-once",
       "sd.subscribe.option.two-configurations",
       "Subscribes with two configuration options are ignored",
       {},
       subscribe_message([](Incoming& in) {
         std::size_t configurations = 0;
         each_option(in.bytes, [&](Span o) { configurations += type_of(o) == 1 ? 1U : 0U; });
         in.lost = configurations > 1;
       })},
      {"any-entry-type",
       "sd.subscribe.malformed.unknown-entry-type",
       "entries of unknown type are taken for Subscribes",
       {},
       [](Incoming& in) {
         if (in.bytes.size() >= entries_at + 16 && is_sd(in.bytes) && in.bytes[entries_at] == 0x55) {
           in.bytes[entries_at] = 6;
         }
       }},
      {"deaf-after-reboot",
       "sd.reboot.by-unicast-and-multicast",
       "a client that was restarted is not heard any more",
       {},
       [](Incoming& in) {
         static int heard = 0;
         static bool deaf = false;
         if (is_sd(in.bytes)) {
           deaf = deaf || (u16(in.bytes, 10) == 1 && heard > 8);
           ++heard;
           in.lost = deaf;
         }
       }},
      {"stop-subscribe-acked",
       "sd.subscription.stop-is-silent",
       "StopSubscribes are answered",
       {},
       subscribe_message([](Incoming& in) {
         if (u24(in.bytes, entries_at + 9) == 0) {
           in.answers.push_back(acknowledgement(in.bytes, 3));
         }
       })},
      {"stop-subscribe-ignored",
       "sd.subscription.stop-ends-events",
       "StopSubscribes are ignored",
       {},
       subscribe_message([](Incoming& in) { in.lost = u24(in.bytes, entries_at + 9) == 0; })},
      {"subscription-for-ever",
       "sd.subscription.ttl-expires",
       "subscriptions do not expire",
       {},
       subscribe_message([](Incoming& in) {
         if (u24(in.bytes, entries_at + 9) != 0) {
           set24(in.bytes, entries_at + 9, 0xffffff);
         }
       })},
      {"reboot-unnoticed",
       "sd.reboot",
       "reboots of clients are not noticed",
       {},
       [](Incoming& in) {
         static unsigned session = 0x1000;
         if (is_sd(in.bytes)) {
           set16(in.bytes, 10, ++session);
         }
       }},
      {"channels-mixed",
       "sd.reboot.channels",
       "the sessions of a peer by unicast and by multicast are taken for one count",
       {},
       [](Incoming& in) {
         static unsigned last = 0;
         static bool false_reboot = false;
         // Others than those of the device itself, which come back to it.
         if ((any_entry(in.bytes, is_find) && u16(in.bytes, entries_at + 4) == 0x0101) ||
             any_entry(in.bytes, is_subscribe)) {
           const unsigned session = u16(in.bytes, 10);
           // The next one shows the device what it would take for a restart: one by multicast did not show
           // it.
           if (std::exchange(false_reboot, session <= last && (in.bytes[flags_at] & 0x80U) != 0)) {
             set16(in.bytes, 10, 1);
           }
           last = session;
         }
       }},
      {"one-entry-only",
       "sd.subscribe.several-entries",
       "only the first entry of a message is read",
       {},
       [](Incoming& in) {
         if (in.bytes.size() > entries_at + 16 && is_sd(in.bytes) && u32(in.bytes, 20) > 16) {
           // The rest of the entries becomes finds of nothing.
           for (std::size_t at = entries_at + 16; at + 16 <= options_at(in.bytes) - 4; at += 16) {
             in.bytes[at] = 0x55;
           }
         }
       }},
      {"reserved-option-bytes-refused",
       "sd.subscribe.option.reserved-bytes",
       "Subscribes are ignored whose option has reserved bytes set",
       {},
       subscribe_message([](Incoming& in) { in.lost = in.bytes.size() >= 56 && in.bytes[47] != 0; })},
      {"trailing-bytes-refused",
       "sd.subscribe.trailing",
       "Subscribes with bytes behind the options are ignored",
       {},
       subscribe_message([](Incoming& in) {
         const std::size_t options = options_at(in.bytes);
         in.lost = options <= in.bytes.size() && in.bytes.size() > options + u32(in.bytes, options - 4);
       })},
      {"second-run-ignored",
       "sd.subscribe.option.second-run",
       "options of the second run are not seen",
       {},
       subscribe_message([](Incoming& in) {
         in.bytes[entries_at + 3] = static_cast<std::uint8_t>(in.bytes[entries_at + 3] & 0xf0U);
       })},
      {"options-must-be-referenced",
       "sd.subscribe.option.unreferenced",
       "Subscribes with options that nobody refers to are ignored",
       {},
       subscribe_message([](Incoming& in) {
         std::size_t options = 0;
         each_option(in.bytes, [&](Span) { ++options; });
         in.lost = options > (in.bytes[entries_at + 3] >> 4U) + (in.bytes[entries_at + 3] & 15U);
       })},
      {"stop-and-subscribe-once",
       "sd.subscribe.stop-and-subscribe",
       "a Stop and a Subscribe in one message do nothing",
       {},
       subscribe_message(
           [](Incoming& in) { in.lost = u24(in.bytes, entries_at + 9) == 0 && u32(in.bytes, 20) > 16; })},
      {"wrong-sd-method",
       "sd.subscribe.malformed.wrong-method",
       "SD messages may have any method",
       {},
       [](Incoming& in) {
         if (in.bytes.size() >= entries_at + 16 && u16(in.bytes, 0) == 0xffff && in.bytes[entries_at] == 6) {
           set16(in.bytes, 2, 0x8100);
         }
       }},

      // The device as a client: of 0x0111 by itself, of 0x0110 when it is told to.
      {"client-find-lost", "client.find,client.ets.finds", "services are not looked for", lose(is_find)},
      {"client-find-instance", "client.find.instance", "another instance is looked for",
       entry(is_find, [](Span e) { set16(e, 6, 0x0909); })},
      {"client-find-major", "client.find.major", "another major version is looked for",
       entry(is_find, [](Span e) { e[8] = 9; })},
      {"client-find-minor", "client.find.minor", "one minor version is looked for",
       entry(is_find, [](Span e) { set32(e, 12, 0); })},
      {"client-find-ttl", "client.find.ttl", "Finds have TTL 0",
       entry(is_find, [](Span e) { set24(e, 9, 0); })},
      {"client-find-options", "client.find.options", "Finds refer to an option",
       entry(is_find, [](Span e) { e[3] = 0x10; })},
      {"client-finds-for-ever",
       "client.find.ends-with-offer,client.find.not-in-main-phase,client.subscribe.after-stop-offer",
       "the service that is used is looked for with each offer", each_offer_has(0, 0x0111)},
      {"client-finds-for-ever-as-told", "client.ets.finds-end,client.ets.stop-offer",
       "the service that is used when told to is looked for with each offer", each_offer_has(0, 0x0110)},
      {"client-subscribe-lost", "client.subscribe,client.ignores,client.ets.subscribes",
       "nothing is subscribed to", lose(is_subscribe)},
      {"client-subscribe-multicast", "client.subscribe.unicast", "Subscribes go to the group",
       [](Outgoing& out) {
         static Bytes group;
         if (out.multicast && is_sd(out.bytes)) {
           group = out.to.address;
         }
         if (any_entry(out.bytes, is_subscribe) && !group.empty()) {
           out.to.address = group;
         }
       }},
      {"client-subscribe-instance", "client.subscribe.instance", "Subscribes name another instance",
       entry(is_subscribe, [](Span e) { set16(e, 6, 0x0909); })},
      {"client-subscribe-major", "client.subscribe.major", "Subscribes name another major version",
       entry(is_subscribe, [](Span e) { e[8] = 9; })},
      {"client-subscribe-eventgroup", "client.subscribe.eventgroup", "Subscribes name another eventgroup",
       entry(is_subscribe, [](Span e) { set16(e, 14, 0x0909); })},
      {"client-subscribe-reserved", "client.subscribe.reserved", "Subscribes have reserved bits set",
       entry(is_subscribe, [](Span e) { e[12] = 1; })},
      {"client-subscribe-address", "client.subscribe.endpoint", "Subscribes name another address",
       [](Outgoing& out) {
         if (any_entry(out.bytes, is_subscribe)) {
           option(4, [](Span o) { add8(o, end_of_address_in(o), 7); })(out);
         }
       }},
      {"client-never-asks",
       "client.subscribe.initial-data,client.subscribe.after-ttl,client.subscribe.after-reboot,client."
       "subscribe."
       "after-no-answer",
       "initial values are never asked for",
       entry(is_subscribe, [](Span e) { e[13] = static_cast<std::uint8_t>(e[13] & 0x7fU); })},
      {"client-always-asks", "client.subscribe.initial-data", "each Subscribe asks for initial values",
       entry(is_subscribe, [](Span e) { e[13] = static_cast<std::uint8_t>(e[13] | 0x80U); })},
      {"client-subscribes-once",
       "client.subscribe.each-offer,client.subscribe.after-nack,client.subscribe.after",
       "subscriptions are not renewed",
       [](Outgoing& out) {
         static bool had = false;
         if (any_entry(out.bytes, is_subscribe)) {
           out.copies = had ? 0 : 1;
           had = true;
         }
       }},
      {"client-subscribes-by-itself", "client.subscribe.only-with-offers",
       "there is a Subscribe with each offer", each_offer_has(6, 0x0111)},
      {"client-subscribes-untold", "client.ets.not-by-itself",
       "there is a Subscribe with each offer, without being told", each_offer_has(6, 0x0110)},
      {"client-takes-any-offer", "client.ignores", "each offer brings a Subscribe, whatever it is",
       [](Outgoing& out) {
         if (offered_by_others && any_entry(out.bytes, is_offer)) {
           offered_by_others = false;
           add_entry(out.bytes, 6, 0x0111);
         }
       },
       [](Incoming& in) {
         if (in.bytes.size() >= entries_at + 16 && u16(in.bytes, 0) == 0xffff && in.bytes[entries_at] == 1 &&
             (u16(in.bytes, entries_at + 4) < 0x0101 || u16(in.bytes, entries_at + 4) > 0x0103)) {
           offered_by_others = true;
         }
       }},
      {"client-needs-minor",
       "client.subscribe.any-minor",
       "offers of a minor version beyond 255 are ignored",
       {},
       [](Incoming& in) {
         in.lost = any_entry(in.bytes, is_offer) && u32(in.bytes, entries_at + 12) > 0xff;
       }},
      {"client-stop-lost", "client.stop,client.ets.stops", "subscriptions end without a word",
       lose(is_stop_subscribe)},
      {"client-deaf-to-orders",
       "client.ets",
       "what the client is told it does not do",
       {},
       [](Incoming& in) {
         in.lost = is_message(in.bytes) && (u16(in.bytes, 2) == 0x2f || u16(in.bytes, 2) == 0x32);
       }},
      {"client-last-value", "client.ets.event", "the last value of an event is another one",
       good([](Bytes& b) {
         if (u16(b, 2) >= 0x3b && u16(b, 2) <= 0x3d) {
           b.back() ^= 1U;
         }
       })},
  };
}

}  // namespace ets
