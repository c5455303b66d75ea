#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "fault_ways.hpp"

namespace ets {
namespace {

/// Methods that have answered E_E2E_REPEATED.
std::set<unsigned> with_repeated_counter;

/// Where the counter of an event with end-to-end protection stands, or its lowest byte, and how many values
/// that has.
struct CounterPlace {
  std::size_t at;
  unsigned values;
};

/// In each event with end-to-end protection, 0x8050 to 0x8059.
Out protected_event(std::function<void(Bytes&, CounterPlace)> change) {
  return event([=](Outgoing& out) {
    // Profiles 1, 2, 4, 5, 6, 7, 8, 11, 22, 44.
    constexpr std::array<CounterPlace, 10> places{{{17, 15},
                                                   {17, 16},
                                                   {19, 256},
                                                   {18, 256},
                                                   {20, 256},
                                                   {31, 256},
                                                   {27, 256},
                                                   {17, 15},
                                                   {17, 16},
                                                   {19, 256}}};
    const unsigned id = u16(out.bytes, 2);
    if (id >= 0x8050 && id < 0x8050 + places.size()) {
      change(out.bytes, places[id - 0x8050]);
    }
  });
}

void set_counter(Bytes& bytes, CounterPlace place, unsigned counter) {
  const unsigned beside = place.values <= 16 ? bytes[place.at] & 0xf0U : 0U;
  bytes[place.at] = static_cast<std::uint8_t>(beside | counter);
}

}  // namespace

std::vector<Fault> load_faults() {
  return {
      {"deaf-after-burst",
       "load.burst,load.flood",
       "after many datagrams nothing is heard any more",
       {},
       [](Incoming& in) {
         // Not of how many come within a time: a slow machine would never get there.
         static int count = 0;
         if (any_entry(in.bytes, is_offer)) {
           return;  // our own, as multicast comes back
         }
         // Where fewer come at once, they have to be stranger.
         const bool strange = in.bytes.size() > 600 || (in.bytes.size() > 60 && u16(in.bytes, 0) != 0x0101);
         count += strange ? 20 : 1;
         in.lost = count > 150;
       }},
      {"answers-twice", "load.burst.requests", "responses are sent twice",
       [](Outgoing& out) { out.copies = is_response(out.bytes) ? 2 : 1; }},
      {"subscribers-forgotten", "load.peers.subscribers", "of many subscribers only one gets events",
       event([](Outgoing& out) {
         static unsigned port = out.to.port;
         out.copies = out.to.port == port ? 1 : 0;
       })},
      {"connections-stay", "load.peers.connections,load.half-open",
       "after some connections TCP is served no more",
       [](Outgoing& out) {
         if (out.stream) {
           out.copies = 0;
         }
       }},
  };
}

std::vector<Fault> message_faults() {
  return {
      // Answers to requests.
      {"response-lost", "rpc.response.comes,ets.survive,ets.field", "there are no responses",
       [](Outgoing& out) { out.copies = is_response(out.bytes) ? 0 : 1; }},
      {"response-service", "rpc.response.message-id", "responses name another service",
       response([](Bytes& b) { add16(b, 0, 1); })},
      {"response-method", "rpc.response.message-id,rpc.response.method-bit",
       "responses have the top bit of the method set",
       response([](Bytes& b) { b[2] = static_cast<std::uint8_t>(b[2] | 0x80U); })},
      {"response-client", "rpc.response.request-id", "responses have another Client ID",
       response([](Bytes& b) { add16(b, 8); })},
      {"response-session", "rpc.response.request-id", "responses have another Session ID",
       response([](Bytes& b) { add16(b, 10); })},
      {"response-protocol", "rpc.response.protocol-version", "responses have Protocol Version 2",
       response([](Bytes& b) { b[12] = 2; })},
      {"response-interface", "rpc.response.interface-version", "responses have another interface version",
       response([](Bytes& b) { add8(b, 13); })},
      {"response-type", "rpc.response.message-type", "good responses have the type of errors",
       good([](Bytes& b) { b[14] = static_cast<std::uint8_t>(b[14] | 1U); })},
      {"response-code", "rpc.response.return-code", "good responses have a return code",
       good([](Bytes& b) { b[15] = 1; })},
      {"response-first-only", "rpc.request.parallel", "every second response is lost",
       [](Outgoing& out) {
         static int count = 0;
         if (is_response(out.bytes) && out.bytes[8] == 0x5a && out.bytes[9] != 0xff && ++count % 2 == 0) {
           out.copies = 0;
         }
       }},
      {"request-id-once", "rpc.request.id-reused", "a Request ID is answered once, and then never again",
       [](Outgoing& out) {
         static std::set<unsigned> answered;
         if (is_response(out.bytes) && !answered.insert(u32(out.bytes, 8)).second) {
           out.copies = 0;
         }
       }},
      {"payload-changed", "ets.echo,rpc.field.set", "the last byte of responses is another one",
       good([](Bytes& b) {
         if (b.size() > 16) {
           b.back() ^= 1U;
         }
       })},
      {"payload-longer", "ets.echo,rpc.field.get", "responses have four bytes too many",
       good([](Bytes& b) { add_payload(b, 4); })},
      {"getter-empty", "rpc.field", "responses of getters and setters are empty", good([](Bytes& b) {
         if (u16(b, 2) >= 0x25 && u16(b, 2) <= 0x2b) {
           b.resize(16);
           set32(b, 4, 8);
         }
       })},
      {"setter-without-effect", "rpc.field.set-is-kept,ets.field,ets.reset",
       "getters give 0, whatever was set",
       [](Outgoing& out) {
         if (is_response(out.bytes) &&
             (u16(out.bytes, 2) == 0x26 || u16(out.bytes, 2) == 0x28 || u16(out.bytes, 2) == 0x2a)) {
           for (std::size_t at = 16; at < out.bytes.size(); ++at) {
             out.bytes[at] = 0;
           }
         }
       }},
      {"reset-without-effect",
       "ets.reset",
       "resetInterface does nothing",
       {},
       [](Incoming& in) { in.lost = is_message(in.bytes) && u16(in.bytes, 2) == 0x01; }},
      {"suspend-without-effect",
       "ets.suspend",
       "suspendInterface does nothing",
       {},
       [](Incoming& in) { in.lost = is_message(in.bytes) && u16(in.bytes, 2) == 0x02; }},
      {"error-lost", "rpc.error.unknown-method,rpc.error.unknown-service", "there are no errors",
       [](Outgoing& out) {
         if (is_response(out.bytes) && out.bytes[15] != 0) {
           out.copies = 0;
         }
       }},
      {"error-code-wrong", "rpc.error.unknown-method,rpc.error.unknown-service", "errors have another code",
       error([](Bytes& b) { b[15] = 1; })},
      {"error-code-high", "rpc.error.code-range", "errors have the top bits of the code set",
       error([](Bytes& b) { b[15] = static_cast<std::uint8_t>(b[15] | 0xc0U); })},
      {"error-payload", "rpc.error.no-payload", "errors have a payload",
       error([](Bytes& b) { add_payload(b, 4); })},
      {"error-message-id", "rpc.error.message-id", "errors name another method",
       error([](Bytes& b) { add16(b, 2); })},
      {"error-request-id", "rpc.error.request-id", "errors have another Client ID",
       error([](Bytes& b) { add16(b, 8); })},
      {"error-interface", "rpc.error.interface-version", "errors have another interface version",
       error([](Bytes& b) { add8(b, 13); })},
      {"error-as-success", "ets.reject,rpc.reject,rpc.error.unknown-method,rpc.error.unknown-service",
       "errors look like success", error([](Bytes& b) {
         b[14] = 0x80;
         b[15] = 0;
       })},
      {"answers-any-request",
       "rpc.reject,ets.reject,tp.reject,rpc.silence.error-request",
       "whatever comes is answered with success at once",
       {},
       answer_if([](Span b) { return b[14] != 1 && u16(b, 8) != 0x5aff; }, 0x80, 0)},
      {"answers-fire-and-forget",
       "rpc.silence",
       "requests without return are answered with an error",
       {},
       answer_if([](Span b) { return b[14] == 1; }, 0x80, 9)},
      {"answers-notifications",
       "rpc.silence.notification,rpc.silence.wrong-type-to-fire-and-forget",
       "notifications are answered with an error",
       {},
       answer_if([](Span b) { return b[14] == 2; }, 0x80, 9)},
      {"answers-responses",
       "rpc.silence.response,rpc.silence.error",
       "responses are answered with an error",
       {},
       answer_if([](Span b) { return (b[14] & 0x80U) != 0; }, 0x80, 9)},
      {"answers-errors",
       "rpc.silence.error-request",
       "requests with a return code are answered with an error",
       {},
       [](Incoming& in) {
         if (is_message(in.bytes) && in.bytes[14] == 0 && in.bytes[15] != 0) {
           in.answers.push_back(answer(in.bytes, 0x80, 9));
           in.lost = true;
         }
       }},
      {"first-of-datagram-only",
       "rpc.npdu",
       "only the first message of a datagram is read",
       {},
       [](Incoming& in) {
         if (is_message(in.bytes) && u32(in.bytes, 4) >= 8 && u32(in.bytes, 4) + 8 < in.bytes.size()) {
           in.bytes = in.bytes.first(u32(in.bytes, 4) + 8);
         }
       }},

      {"return-code-dropped",
       "rpc.request.return-code-ignored",
       "requests with a return code are not answered",
       {},
       [](Incoming& in) { in.lost = is_message(in.bytes) && in.bytes[14] == 0 && in.bytes[15] != 0; }},
      {"second-service-silent", "rpc.services.one-port,tcp.services.one-connection",
       "the second service does not answer",
       [](Outgoing& out) { out.copies = is_response(out.bytes) && u16(out.bytes, 0) == 0x0102 ? 0 : 1; }},
      {"second-instance-silent", "rpc.instances.own-ports,tcp.instances.own-ports",
       "the second instance does not answer", [](Outgoing& out) { out.copies = out.port == 30502 ? 0 : 1; }},

      // Events.
      {"event-lost", "event", "there are no events", event([](Outgoing& out) { out.copies = 0; })},
      {"event-id", "event.id-bit", "events have the top bit of their id clear",
       event([](Outgoing& out) { out.bytes[2] = static_cast<std::uint8_t>(out.bytes[2] & 0x7fU); })},
      {"event-type", "event.message-type", "events are requests",
       event([](Outgoing& out) { out.bytes[14] = 0; })},
      {"event-code", "event.return-code", "events have a return code",
       event([](Outgoing& out) { out.bytes[15] = 1; })},
      {"event-interface", "event.interface-version", "events have another interface version",
       event([](Outgoing& out) { add8(out.bytes, 13); })},
      {"event-twice", "event.once", "events are sent twice", event([](Outgoing& out) { out.copies = 2; })},
      {"initial-event-lost", "event.initial.comes,event.field-changes", "field events are not sent",
       event([](Outgoing& out) {
         if (u16(out.bytes, 2) >= 0x8006 && u16(out.bytes, 2) <= 0x8008) {
           out.copies = 0;
         }
       })},
      {"initial-event-only-one", "event.initial.all", "of the fields of an eventgroup, one is sent",
       event([](Outgoing& out) { out.copies = u16(out.bytes, 2) == 0x8007 ? 0 : 1; })},

      {"events-for-all",
       "event.not-subscribed,sd.subscription.stop-ends-events,sd.subscription.ttl-expires,sd.reboot.ends-"
       "subscriptions,ets.suspend.ends-subscriptions",
       "whoever asks for an event gets it",
       {},
       [](Incoming& in) {
         if (is_message(in.bytes) && u16(in.bytes, 2) == 0x03) {
           Bytes event = answer(in.bytes, 2, 0);
           set16(event, 2, 0x8001);
           in.answers.push_back(event);
         }
       }},
      {"initial-events-at-renewal",
       "event.initial.not-at-renewal",
       "each Subscribe brings initial events",
       {},
       subscribe_message([](Incoming& in) {
         in.bytes[16] = static_cast<std::uint8_t>(in.bytes[16] | 0x20U);  // it says which ones it wants
         in.bytes[entries_at + 13] = static_cast<std::uint8_t>(in.bytes[entries_at + 13] | 0x80U);
       })},

      // End-to-end protection: methods 0x50 to 0x5d.
      {"e2e-crc", "e2e.*.response", "protected responses have a CRC that does not fit", good([](Bytes& b) {
         if (is_protected(b)) {
           b.back() ^= 1U;
         }
       })},
      {"e2e-counter-stuck", "e2e.*.counter", "protected responses repeat their first protection",
       good([](Bytes& b) {
         static std::map<unsigned, Bytes> first;
         if (is_protected(b)) {
           const Bytes& had = first.try_emplace(u16(b, 2), b.begin() + 16, b.end()).first->second;
           std::copy_n(had.begin(), std::min(had.size(), b.size() - 16), b.begin() + 16);
         }
       })},
      {"e2e-repeated-ends", "e2e.*.repeated", "after a repeated counter no protected request is served",
       error([](Bytes& b) {
         if (u16(b, 2) >= 0x50 && u16(b, 2) <= 0x5d && b[15] == 0x0b) {
           with_repeated_counter.insert(u16(b, 2));
         }
       }),
       [](Incoming& in) {
         in.lost = is_message(in.bytes) && is_protected(in.bytes) &&
                   with_repeated_counter.contains(u16(in.bytes, 2));
       }},
      {"e2e-unchecked",
       "e2e",
       "protected requests are served without a check",
       {},
       [](Incoming& in) {
         if (is_message(in.bytes) && is_protected(in.bytes)) {
           Bytes back = answer(in.bytes, 0x80, 0);
           back.insert(back.end(), in.bytes.begin() + 16, in.bytes.end());
           back.resize(std::max<std::size_t>(back.size(), 16 + 24));
           set32(back, 4, static_cast<unsigned>(back.size() - 8));
           in.answers.push_back(back);
         }
       }},
      // Events 0x8050 to 0x8059.
      {"e2e-event-crc", "e2e.*.event", "protected events have a CRC that does not fit",
       protected_event([](Bytes& b, CounterPlace) { b.back() ^= 1U; })},
      {"e2e-event-bare", "e2e.*.event,e2e.*.event-counter", "protected events have no E2E header",
       protected_event([](Bytes& b, CounterPlace) {
         b.erase(b.begin() + 16, b.end() - 4);
         set32(b, 4, static_cast<unsigned>(b.size() - 8));
       })},
      {"e2e-event-counter-stuck", "e2e.*.event-counter", "protected events have one counter for ever",
       protected_event([](Bytes& b, CounterPlace place) { set_counter(b, place, 7); })},
      {"e2e-event-counts-copies", "e2e.*.event-for-two",
       "protected events count for each subscriber that they go to",
       protected_event([](Bytes& b, CounterPlace place) {
         static std::map<unsigned, unsigned> copies;
         set_counter(b, place, copies[u16(b, 2)]++ % place.values);
       })},
      {"e2e-event-never-zero", "e2e.*.event-wrap", "protected events count to 15 after their last counter",
       protected_event([](Bytes& b, CounterPlace place) {
         if (place.values <= 16 && (b[place.at] & 0x0fU) == 0) {
           set_counter(b, place, 15);
         }
       })},
      {"e2e-event-data-id", "e2e.profile4.event,e2e.profile44.event,e2e.profile7.event,e2e.profile8.event",
       "protected events that have their Data ID in the header have another one",
       protected_event([](Bytes& b, CounterPlace place) {
         if (place.values == 256 && b.size() >= 16 + 12 + 4) {
           b[b.size() - 4 - (u16(b, 2) == 0x8052 || u16(b, 2) == 0x8059 ? 5U : 1U)] ^= 1U;
         }
       })},

      // TCP.
      {"tcp-silent", "tcp", "nothing is answered over TCP",
       [](Outgoing& out) {
         if (out.stream) {
           out.copies = 0;
         }
       }},
      {"tcp-first-only", "tcp.several,tcp.split", "over TCP the first answer is the only one",
       [](Outgoing& out) {
         static int count = 0;
         if (out.stream && is_message(out.bytes) && u32(out.bytes, 4) + 8 < out.bytes.size()) {
           out.bytes.resize(u32(out.bytes, 4) + 8);
         } else if (out.stream && ++count % 2 == 0) {
           out.copies = 0;
         }
       }},
      {"tcp-second-service-events", "tcp.services.events-of-two",
       "the second service sends no events over TCP",
       event([](Outgoing& out) { out.copies = out.stream && u16(out.bytes, 0) == 0x0102 ? 0 : 1; })},
      {"tcp-payload-changed", "tcp.echo", "responses over TCP have another payload",
       [](Outgoing& out) {
         if (out.stream && is_response(out.bytes) && out.bytes.size() > 16) {
           out.bytes.back() ^= 1U;
         }
       }},

      // SOME/IP-TP.
      {"tp-ignored",
       "tp",
       "segments are not put together",
       {},
       [](Incoming& in) { in.lost = is_message(in.bytes) && (in.bytes[14] & 0x20U) != 0; }},
      {"tp-more-flag-stays", "tp.response.last", "the last segment says that more follow",
       response([](Bytes& b) {
         if ((b[14] & 0x20U) != 0) {
           b[19] = static_cast<std::uint8_t>(b[19] | 1U);
         }
       })},
      {"tp-reserved", "tp.response.reserved", "reserved bits of segments are set", response([](Bytes& b) {
         if ((b[14] & 0x20U) != 0) {
           b[19] = static_cast<std::uint8_t>(b[19] | 2U);
         }
       })},
      {"tp-session", "tp.response.session", "segments have different Session IDs", response([](Bytes& b) {
         if ((b[14] & 0x20U) != 0) {
           add16(b, 10, b[18] + b[17]);
         }
       })},
      {"tp-flag-missing", "tp.response.flag", "segments have no TP flag",
       response([](Bytes& b) { b[14] = static_cast<std::uint8_t>(b[14] & 0xdfU); })},
      {"tp-duplicate", "tp.response.once", "segments are sent twice",
       [](Outgoing& out) {
         if (is_response(out.bytes) && (out.bytes[14] & 0x20U) != 0) {
           out.copies = 2;
         }
       }},
      {"tp-payload", "tp.response.payload,tp.order", "a byte of each segment is another one",
       response([](Bytes& b) {
         if ((b[14] & 0x20U) != 0) {
           b.back() ^= 1U;
         }
       })},
  };
}

}  // namespace ets
