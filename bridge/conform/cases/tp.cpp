#include <algorithm>
#include <numeric>

#include "bridge/conform/cases/all_cases.hpp"
#include "bridge/conform/trial.hpp"
#include "someip/wire/tp.hpp"

namespace trestle::conform {
namespace {

using namespace std::chrono_literals;
using enum Level;

constexpr std::size_t segment_bytes = 1392;
constexpr someip::ClientId client{0x5a42};

/// An array of bytes: a length field and so many of them.
Bytes array_of(std::size_t count) {
  Bytes payload;
  append_u32(payload, static_cast<std::uint32_t>(count));
  for (std::size_t number = 0; number < count; ++number) {
    append_u8(payload, static_cast<std::uint8_t>(number * 7 + number / 251));
  }
  return payload;
}

struct Segment {
  std::uint32_t offset = 0;
  Bytes slice;
  bool more = true;
};

std::vector<Segment> segments_of(const Bytes& payload) {
  std::vector<Segment> all;
  for (std::size_t at = 0; at < payload.size(); at += segment_bytes) {
    const std::size_t size = std::min(segment_bytes, payload.size() - at);
    const auto from = payload.begin() + static_cast<std::ptrdiff_t>(at);
    all.push_back({static_cast<std::uint32_t>(at),
                   {from, from + static_cast<std::ptrdiff_t>(size)},
                   at + size < payload.size()});
  }
  return all;
}

/// The request of a profile that takes segments. [the need of all cases that send some]
LargeRequest receiver(const Trial& t) {
  return large_request(t.profile).value_or(LargeRequest{});
}

/// Sends segments as those of one request.
Call send_segments(Trial& t, const std::vector<Segment>& segments, std::uint16_t session,
                   std::uint8_t reserved = 0) {
  Call call = t.call(receiver(t).method);
  call.client = client;
  call.session = someip::SessionId{session};
  call.type = someip::MessageType::tp_request;
  for (const Segment& one : segments) {
    call.payload.clear();
    append_u32(call.payload, someip::to_word({.offset = one.offset, .more = one.more, .reserved = reserved}));
    append(call.payload, one.slice);
    t.send(call);
  }
  return call;
}

/// Whether a message needs nothing after it: the last segment, or one that is none.
bool is_last(const SeenMessage& one) {
  const auto segment = someip::decode_tp(one.message);
  return segment ? !segment->header.more : !someip::is_tp(one.message.header.type);
}

/// What a large message came in, in the order in which it came; nothing: it does not come, or not whole.
std::vector<SeenMessage> await_parts(Trial& t, std::size_t since, Duration within,
                                     const Trial::MessageIs& wanted) {
  if (!t.tester.receive(within,
                        [&] { return std::ranges::any_of(t.messages_since(since, wanted), is_last); })) {
    return {};
  }
  t.tester.receive(20ms, [] { return false; });  // what came twice, or later than the last
  auto parts = t.messages_since(since, wanted);
  // The next one may have begun.
  const auto last = std::ranges::find_if(parts, is_last);
  const auto next = std::find_if(last + 1, parts.end(), [](const SeenMessage& one) {
    const auto segment = someip::decode_tp(one.message);
    return segment && segment->header.offset == 0;
  });
  parts.erase(next, parts.end());
  return parts;
}

Bytes payload_of(const std::vector<SeenMessage>& parts) {
  Bytes payload;
  for (const SeenMessage& one : parts) {
    const auto segment = someip::decode_tp(one.message);
    const ByteView slice = segment ? segment->slice : one.message.payload;
    const std::size_t at = segment ? segment->header.offset : 0;
    payload.resize(std::max(payload.size(), at + slice.size()));
    std::ranges::copy(slice, payload.begin() + static_cast<std::ptrdiff_t>(at));
  }
  return payload;
}

/// Judges the answer to a large request: it is no error, and that of an echo has the same payload.
void judge_answer(Trial& t, const Bytes& payload, const std::vector<SeenMessage>& parts) {
  if (parts.empty()) {
    t.missing("no answer to a request in segments", "a response");
  }
  const SeenMessage& first = parts.front();
  t.equal("Return Code", someip::ReturnCode::ok, first.message.header.return_code, first.packet);
  if (!receiver(t).is_echo) {
    return;
  }
  const Bytes echo = payload_of(parts);
  t.equal("bytes of payload", payload.size(), echo.size(), first.packet);
  const auto [a, b] = std::ranges::mismatch(payload, echo);
  if (a != payload.end() && b != echo.end()) {
    t.different(fmt::format("byte {} of the payload", a - payload.begin()), hex({&*a, 1}), hex({&*b, 1}),
                first.packet);
  }
}

/// Sends something up to three times, until a large message has come whole.
/// @return its parts; none: it does not come.
std::vector<SeenMessage> ask_for_parts(Trial& t, const std::function<void()>& send, Duration within,
                                       const Trial::MessageIs& wanted) {
  std::size_t since = 0;
  const auto is_whole = [&] { return std::ranges::any_of(t.messages_since(since, wanted), is_last); };
  const auto send_anew = [&] {
    since = t.now();
    send();
  };
  return t.ask(send_anew, within, is_whole) ? await_parts(t, since, Duration{0}, wanted)
                                            : std::vector<SeenMessage>{};
}

/// The same, of the answer to a request in segments.
/// @param send  sends it with a Session ID that no other one has.
std::vector<SeenMessage> ask_in_segments(Trial& t, const std::function<Call(std::uint16_t session)>& send) {
  std::uint16_t session = 0x100;
  Call sent;
  const auto send_next = [&] {
    session = static_cast<std::uint16_t>(session + 0x10);
    sent = send(session);
  };
  return ask_for_parts(t, send_next, t.profile.timing.answer_within * 2,
                       [&](const SeenMessage& seen) { return Trial::is_answer_to(sent)(seen); });
}

void expect_answer(Trial& t, const Bytes& payload, const std::vector<Segment>& segments) {
  judge_answer(t, payload, ask_in_segments(t, [&](std::uint16_t session) {
                 return send_segments(t, segments, session);
               }));
}

/// A large message of the device: the answer to a large request that it echoes, a large response, or an
/// event.
struct Large {
  std::vector<SeenMessage> parts;
  std::optional<someip::SessionId> session{};  ///< that it has to have; nothing: of an event
};

Large large_message(Trial& t) {
  const Duration within = t.profile.timing.answer_within * 2;
  const auto& response = t.profile.service().large.response;
  const bool echoes = receiver(t).is_echo;
  // One with another Session ID is a segment, too: the port is this trial's own.
  const Trial::MessageIs answers = [](const SeenMessage& seen) {
    return seen.message.header.client == client &&
           someip::without_tp(seen.message.header.type) != someip::MessageType::notification;
  };
  Large large;
  if (echoes || response) {
    const Bytes payload = array_of(5000);
    Call call;
    std::uint16_t session = 0x100;
    const auto send = [&] {
      if (echoes) {
        call = send_segments(t, segments_of(payload), ++session);
      } else {
        call = t.call(response->method, response->payload);
        call.client = client;
        call = t.send(call);
      }
    };
    large.parts = ask_for_parts(t, send, within, answers);
    large.session = call.session;
    if (echoes) {
      judge_answer(t, payload, large.parts);
    }
  } else if (const auto source = large_event(t.profile)) {
    (void)t.acknowledged(t.subscribe(*source));
    large.parts = ask_for_parts(
        t, [&] { t.ask_for(*source); }, 2 * source->cycle + within, t.is_event(source->event));
  }
  if (large.parts.empty()) {
    t.missing("no large message comes, or not all of it", "a message in segments");
  }
  return large;
}

/// What is asked of the segments of a large message.
auto sent_in_segments(void (*judge)(Trial& t, const Large& large)) {
  return [judge](Trial& t) { judge(t, large_message(t)); };
}

/// Segments of a large request in another order, or changed, that have to be put together.
auto put_together(void (*change)(std::vector<Segment>& segments)) {
  return [change](Trial& t) {
    const Bytes payload = array_of(6000);
    std::vector<Segment> segments = segments_of(payload);
    change(segments);
    expect_answer(t, payload, segments);
  };
}

/// Segments that are no whole message: there must be no answer with success.
auto not_put_together(void (*change)(std::vector<Segment>& segments)) {
  return [change](Trial& t) {
    const Bytes payload = array_of(6000);
    std::vector<Segment> segments = segments_of(payload);
    change(segments);
    const std::size_t since = t.now();
    const Call call = send_segments(t, segments, 0x201);
    t.pass();
    for (const SeenMessage& seen : t.messages_since(since, Trial::is_answer_to(call))) {
      t.require(seen.message.header.return_code != someip::ReturnCode::ok, "answer", "none", "a response",
                seen.packet);
    }
  };
}

}  // namespace

void add_tp_cases(Cases& cases) {
  const Cases all{
      {.id = "tp.order.ascending",
       .title = "puts segments in ascending order together",
       .requirements = {"feat_req_someiptp_789", "feat_req_someiptp_783", "feat_req_someiptp_785"},
       .needs = Need::large_request,
       .run = put_together([](std::vector<Segment>&) {})},
      {.id = "tp.order.descending",
       .title = "puts segments in descending order together",
       .level = should,
       .requirements = {"feat_req_someiptp_820"},
       .needs = Need::large_request,
       .run = put_together([](std::vector<Segment>& segments) { std::ranges::reverse(segments); })},
      {.id = "tp.order.out-of-order",
       .title = "puts segments together that are up to three places off",
       .level = should,
       .requirements = {"feat_req_someiptp_790"},
       .needs = Need::large_request,
       .run = put_together([](std::vector<Segment>& segments) {
         std::rotate(segments.begin(), segments.begin() + 1, segments.begin() + 4);
       })},
      {.id = "tp.order.duplicates",
       .title = "puts segments together of which each comes twice",
       .level = should,
       .requirements = {"feat_req_someiptp_797"},
       .needs = Need::large_request,
       .run = put_together([](std::vector<Segment>& segments) {
         std::vector<Segment> twice;
         for (const Segment& one : segments) {
           if (&one != &segments.back()) {
             twice.push_back(one);
           }
           twice.push_back(one);
         }
         segments = std::move(twice);
       })},
      {.id = "tp.order.overlap-first-wins",
       .title = "keeps the bytes that came first where segments overlap",
       .level = should,
       .requirements = {"feat_req_someiptp_797"},
       .needs = Need::large_request,
       .run = put_together([](std::vector<Segment>& segments) {
         Segment other = segments[1];
         for (std::byte& one : other.slice) {
           one ^= std::byte{0xff};
         }
         segments.insert(segments.begin() + 2, other);
       })},
      {.id = "tp.reserved-ignored",
       .title = "does not care for reserved bits of segments",
       .requirements = {"feat_req_someiptp_769"},
       .needs = Need::large_request,
       .run =
           [](Trial& t) {
             const Bytes payload = array_of(4000);
             if (ask_in_segments(t, [&](std::uint16_t session) {
                   return send_segments(t, segments_of(payload), session, 7);
                 }).empty()) {
               t.missing("no answer to a request in segments with reserved bits", "a response");
             }
           }},
      {.id = "tp.interleaved-clients",
       .title = "puts two messages of two clients together whose segments alternate",
       .requirements = {"feat_req_someiptp_787", "feat_req_someiptp_803", "feat_req_someiptp_781"},
       .needs = Need::large_request,
       .run =
           [](Trial& t) {
             const Bytes payload = array_of(5000);
             const auto segments = segments_of(payload);
             const PortId other = t.tester.open_udp();
             const std::size_t since = t.now();
             Call call = t.call(receiver(t).method);
             call.type = someip::MessageType::tp_request;
             Call second = call;
             call.client = someip::ClientId{0x5a43};
             second.client = someip::ClientId{0x5a44};
             std::uint16_t session = 0x400;
             const auto send = [&] {
               call.session = second.session = someip::SessionId{++session};
               for (const Segment& one : segments) {
                 call.payload.clear();
                 append_u32(call.payload, someip::to_word({.offset = one.offset, .more = one.more}));
                 append(call.payload, one.slice);
                 second.payload = call.payload;
                 t.send(call);
                 t.send(second, t.udp_of(t.profile.service()), other);
               }
             };
             const auto is_answered = [&](const Call& one) {
               return std::ranges::any_of(t.messages_since(since, Trial::is_answer_to(one)), is_last);
             };
             if (!t.ask(send, t.profile.timing.answer_within * 2,
                        [&] { return is_answered(call) && is_answered(second); })) {
               const Call& open = is_answered(call) ? second : call;
               t.missing(
                   fmt::format(
                       "no answer to client {:#06x}, whose segments alternate with those of another one",
                       value(open.client)),
                   "a response to each client");
             }
           }},
      {.id = "tp.new-session",
       .title = "drops a message that is not whole when the next one begins",
       .requirements = {"feat_req_someiptp_793", "feat_req_someiptp_795"},
       .needs = Need::large_request,
       .run =
           [](Trial& t) {
             const Bytes payload = array_of(5000);
             auto segments = segments_of(payload);
             auto half = segments;
             half.pop_back();
             judge_answer(t, payload, ask_in_segments(t, [&](std::uint16_t session) {
                            send_segments(t, half, session);
                            return send_segments(t, segments, static_cast<std::uint16_t>(session + 1));
                          }));
           }},
      {.id = "tp.reject.missing-segment",
       .title = "does not deliver a message of which a segment is missing",
       .requirements = {"feat_req_someiptp_783", "feat_req_someiptp_796"},
       .needs = Need::large_request,
       .run = not_put_together([](std::vector<Segment>& segments) { segments.erase(segments.begin() + 1); })},
      {.id = "tp.reject.no-last",
       .title = "does not deliver a message without its last segment",
       .requirements = {"feat_req_someiptp_783", "feat_req_someiptp_770"},
       .needs = Need::large_request,
       .run = not_put_together([](std::vector<Segment>& segments) { segments.pop_back(); })},
      {.id = "tp.reject.unaligned",
       .title = "does not deliver a message with a segment that is no multiple of 16 bytes",
       .requirements = {"feat_req_someiptp_792", "feat_req_someiptp_772"},
       .needs = Need::large_request,
       .run = not_put_together([](std::vector<Segment>& segments) { segments[1].slice.resize(1385); })},
      {.id = "tp.response.payload",
       .title = "sends a large message in segments",
       .requirements = {"feat_req_someiptp_760", "feat_req_someiptp_767"},
       .needs = Need::large_message,
       .run = sent_in_segments([](Trial& t, const Large& large) {
         t.require(large.parts.size() > 1, "segments", "several", std::to_string(large.parts.size()),
                   large.parts.front().packet);
       })},
      {.id = "tp.response.flag",
       .title = "sets the TP flag in segments",
       .requirements = {"feat_req_someiptp_765", "feat_req_someip_761"},
       .needs = Need::large_message,
       .run = sent_in_segments([](Trial& t, const Large& large) {
         for (const SeenMessage& one : large.parts) {
           t.equal("TP flag", true, someip::is_tp(one.message.header.type), one.packet);
         }
       })},
      {.id = "tp.response.session",
       .title = "sends all segments with one Session ID",
       .requirements = {"feat_req_someiptp_763", "feat_req_someiptp_774"},
       .needs = Need::large_message,
       .run = sent_in_segments([](Trial& t, const Large& large) {
         const someip::SessionId session = large.session.value_or(large.parts.front().message.header.session);
         for (const SeenMessage& one : large.parts) {
           t.equal("Session ID", value(session), value(one.message.header.session), one.packet);
         }
       })},
      {.id = "tp.response.sizes",
       .title = "sends segments of one size, a multiple of 16 of 1392 bytes at most, but for the last",
       .requirements = {"feat_req_someiptp_772", "feat_req_someiptp_773", "feat_req_someiptp_778"},
       .needs = Need::large_message,
       .run = sent_in_segments([](Trial& t, const Large& large) {
         const auto first = someip::decode_tp(large.parts.front().message);
         for (const SeenMessage& one : large.parts) {
           const auto segment = someip::decode_tp(one.message);
           t.require(segment.has_value(), "segment", "a TP header and a multiple of 16 bytes", "another",
                     one.packet);
           if (segment && first && segment->header.more) {
             t.equal("bytes of a segment", first->slice.size(), segment->slice.size(), one.packet);
             t.require(segment->slice.size() <= segment_bytes, "bytes of a segment", "1392 at most",
                       std::to_string(segment->slice.size()), one.packet);
           }
         }
       })},
      {.id = "tp.response.last",
       .title = "clears the more-segments flag in the last segment alone",
       .requirements = {"feat_req_someiptp_770"},
       .needs = Need::large_message,
       .run = sent_in_segments([](Trial& t, const Large& large) {
         std::size_t last = 0;
         for (const SeenMessage& one : large.parts) {
           const auto segment = someip::decode_tp(one.message);
           last += segment && !segment->header.more ? 1U : 0U;
         }
         t.equal("last segments", std::size_t{1}, last, large.parts.back().packet);
       })},
      {.id = "tp.response.reserved",
       .title = "leaves reserved bits of segments 0",
       .requirements = {"feat_req_someiptp_769"},
       .needs = Need::large_message,
       .run = sent_in_segments([](Trial& t, const Large& large) {
         for (const SeenMessage& one : large.parts) {
           if (const auto segment = someip::decode_tp(one.message)) {
             t.equal("reserved bits", 0, segment->header.reserved, one.packet);
           }
         }
       })},
      {.id = "tp.response.once",
       .title = "sends each segment once, in ascending order",
       .requirements = {"feat_req_someiptp_777", "feat_req_someiptp_780"},
       .needs = Need::large_message,
       .run = sent_in_segments([](Trial& t, const Large& large) {
         std::size_t expected = 0;
         for (const SeenMessage& one : large.parts) {
           if (const auto segment = someip::decode_tp(one.message)) {
             t.equal("offset", expected, std::size_t{segment->header.offset}, one.packet);
             expected = segment->header.offset + segment->slice.size();
           }
         }
       })},
  };
  cases.insert(cases.end(), all.begin(), all.end());
}

}  // namespace trestle::conform
