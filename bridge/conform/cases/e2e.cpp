#include <algorithm>
#include <array>

#include "bridge/conform/cases/all_cases.hpp"
#include "bridge/conform/protection.hpp"
#include "bridge/conform/trial.hpp"

namespace trestle::conform {
namespace {

using enum Level;

/// What the profile says of a method, or of an event, with this E2E profile.
const E2eProtection& protection_of(Trial& t, E2eProfile profile, bool event) {
  const auto& all = t.profile.service().e2e;
  const auto found = std::ranges::find_if(
      all, [&](const E2eProtection& one) { return one.profile == profile && is_of_event(one) == event; });
  if (found == all.end()) {
    t.unsupported(fmt::format("no {} with E2E profile {}", event ? "event" : "method", to_string(profile)));
  }
  return *found;
}

/// Ends the case when a message of the device is too short for its protection.
void has_room(Trial& t, const E2eProtection& how, const SeenMessage& seen, const char* what) {
  const std::size_t least = e2e_header_bytes(how.profile);
  if (seen.message.payload.size() < least) {
    t.fail(fmt::format("the {} has no room for the E2E header", what),
           fmt::format("at least {} bytes of payload", least), std::to_string(seen.message.payload.size()),
           seen.packet);
  }
}

/// With the counter that it has, the header is the only right one.
void has_right_header(Trial& t, const E2eProtection& how, const SeenMessage& seen, bool response) {
  const ByteView payload = seen.message.payload;
  const std::size_t header = e2e_header_bytes(how.profile);
  const Bytes expected = protect(how, protected_header(seen.message.header), payload.subspan(header),
                                 e2e_counter_of(how.profile, payload), response);
  t.equal("E2E header", hex(ByteView{expected}.first(header)), hex(payload.first(header)), seen.packet);
}

/// A receiver may need some good messages before it believes the counter.
constexpr int begin_within = 8;

const Bytes& content() {
  static const Bytes four = bytes({0x12, 0x34, 0x56, 0x78});
  return four;
}

/// A client of a method with protection.
class Talk {
 public:
  Talk(Trial& trial, E2eProfile profile) : t_{trial}, how_{protection_of(trial, profile, false)} {}

  [[nodiscard]] const E2eProtection& how() const { return how_; }
  /// The next request; `spoil` may change its payload.
  [[nodiscard]] Call request(void (*spoil)(Bytes& payload) = nullptr) {
    count();
    return with_counter(how_, spoil);
  }
  /// With the counter of the one before.
  [[nodiscard]] Call repeated() { return with_counter(how_, nullptr); }
  /// The next request, as a sender protects it that has another Data ID.
  [[nodiscard]] Call foreign() {
    E2eProtection other = how_;
    other.data_id ^= 1U;
    for (std::byte& one : other.data_ids) {
      one ^= std::byte{0x55};
    }
    count();
    return with_counter(other, nullptr);
  }
  /// A request that is answered with E_OK, and a payload that is long enough; ends the case when none is.
  SeenMessage good_answer() {
    SeenMessage last;
    for (int count = 0; count < begin_within; ++count) {
      last = t_.answer_to(request());
      if (last.message.header.return_code == someip::ReturnCode::ok) {
        has_room(t_, how_, last, "response");
        return last;
      }
    }
    const auto code = static_cast<unsigned>(last.message.header.return_code);
    t_.fail(fmt::format("protected requests are answered with code {:#04x}", code),
            "a response with code 0x00", fmt::format("one with code {:#04x}", code), last.packet);
  }

 private:
  void count() { counter_ = (counter_ + 1) % e2e_counter_end(how_.profile); }
  Call with_counter(const E2eProtection& how, void (*spoil)(Bytes& payload)) {
    Call call = t_.call(how_.id);
    call.client = someip::ClientId{0x5a61};
    call.session = someip::SessionId{++session_};
    const Bytes whole = call.encode();
    call.payload =
        protect(how, ByteView{whole}.subspan(8), content(), static_cast<std::uint32_t>(counter_), false);
    if (spoil != nullptr) {
      spoil(call.payload);
    }
    return call;
  }

  Trial& t_;
  E2eProtection how_;
  std::uint64_t counter_ = 0;
  std::uint16_t session_ = 0;
};

void response(Trial& t, Talk& talk) {
  const SeenMessage seen = talk.good_answer();
  const std::size_t header = e2e_header_bytes(talk.how().profile);
  t.equal("payload behind the E2E header", hex(content()), hex(seen.message.payload.subspan(header)),
          seen.packet);
  has_right_header(t, talk.how(), seen, true);
}

void counter(Trial& t, Talk& talk) {
  const E2eProfile profile = talk.how().profile;
  const SeenMessage first = talk.good_answer();
  const SeenMessage second = talk.good_answer();
  const std::uint64_t expected =
      (std::uint64_t{e2e_counter_of(profile, first.message.payload)} + 1) % e2e_counter_end(profile);
  t.equal("counter", expected, std::uint64_t{e2e_counter_of(profile, second.message.payload)}, second.packet);
}

void wrong_crc(Trial& t, Talk& talk) {
  talk.good_answer();
  t.not_served(talk.request([](Bytes& payload) { payload.back() ^= std::byte{1}; }));
  talk.good_answer();
}

void wrong_data_id(Trial& t, Talk& talk) {
  talk.good_answer();
  t.not_served(talk.foreign());
  talk.good_answer();
}

void repeated(Trial& t, Talk& talk) {
  talk.good_answer();
  // The check of a profile tells that the counter is repeated. What becomes of the data then, the standard
  // leaves to the caller of the check; even its state machine stays in VALID.
  for (const SeenMessage& seen : t.answers_once_passed(talk.repeated())) {
    if (seen.message.header.type == someip::MessageType::response &&
        seen.message.header.return_code == someip::ReturnCode::ok) {
      t.nonstrict("it is served, which E2E protection leaves to the device");
    }
  }
  // But what comes after it is good again.
  talk.good_answer();
}

void too_short(Trial& t, Talk& talk) {
  talk.good_answer();
  t.not_served(talk.request([](Bytes& payload) { payload.resize(1); }));
  talk.good_answer();
}

/// A subscriber of an event with protection.
class Listener {
 public:
  Listener(Trial& trial, E2eProfile profile)
      : t_{trial},
        how_{protection_of(trial, profile, true)},
        // A profile without it is refused when it is read.
        source_{*event_source(trial.profile.service(), how_.id)} {
    t_.acknowledged(t_.subscribe(source_));
  }

  [[nodiscard]] const E2eProtection& how() const { return how_; }
  /// The next one; ends the case when it does not come, or is too short for its protection.
  SeenMessage next() {
    SeenMessage seen = t_.event(source_, t_.tester.local(t_.udp()));
    has_room(t_, how_, seen, "event");
    return seen;
  }
  [[nodiscard]] std::uint64_t counter_of(const SeenMessage& seen) const {
    return e2e_counter_of(how_.profile, seen.message.payload);
  }
  /// Somebody else subscribes, too.
  void add_subscriber() {
    const Endpoint other = t_.tester.local(t_.tester.open_udp());
    t_.acknowledged(
        t_.subscribe(t_.profile.service(), source_.group, {endpoint_option(other, Transport::udp)}));
  }

 private:
  Trial& t_;
  E2eProtection how_;
  EventSource source_;
};

void event_header(Trial& t, Listener& listener) {
  has_right_header(t, listener.how(), listener.next(), false);
}

/// That an event counts on by one from the one before. Where one got lost between the two, the next one does.
void event_counter(Trial& t, Listener& listener) {
  std::uint64_t before = listener.counter_of(listener.next());
  for (int round = 1;; ++round) {
    const SeenMessage seen = listener.next();
    const std::uint64_t expected = (before + 1) % e2e_counter_end(listener.how().profile);
    const std::uint64_t counter = listener.counter_of(seen);
    if (counter == expected) {
      return;
    }
    if (round == 3) {
      t.equal("counter", expected, counter, seen.packet);
      return;
    }
    before = counter;
  }
}

void event_for_two(Trial& t, Listener& listener) {
  listener.add_subscriber();
  event_counter(t, listener);
}

void event_wrap(Trial& t, Listener& listener) {
  const std::uint64_t end = e2e_counter_end(listener.how().profile);
  SeenMessage seen = listener.next();
  // Twice, as the one with 0 may get lost.
  for (std::uint64_t count = 0; count < 2 * end; ++count) {
    const std::uint64_t before = listener.counter_of(seen);
    seen = listener.next();
    const std::uint64_t counter = listener.counter_of(seen);
    t.require(counter < end, "counter", fmt::format("{} at most", end - 1), std::to_string(counter),
              seen.packet);
    if (counter == 0 && before != 0) {
      return;
    }
  }
  t.fail("the counter does not begin again", fmt::format("0 once in {} events", end),
         std::to_string(listener.counter_of(seen)), seen.packet);
}

template <typename Peer>
struct Kind {
  const char* name;
  const char* title;
  void (*run)(Trial& t, Peer& peer);
};

/// One case, which talks to the device as a Talk or a Listener.
template <typename Peer>
Case case_of(const Kind<Peer>& kind, E2eProfile profile, Need needs) {
  return {.id = fmt::format("e2e.profile{}.{}", to_string(profile), kind.name),
          .title = kind.title,
          .requirements = {"feat_req_someip_102", "feat_req_someip_103"},
          .needs = needs,
          .budget = std::chrono::seconds{30},
          .run = [profile, run = kind.run](Trial& t) {
            Peer peer{t, profile};
            run(t, peer);
          }};
}

}  // namespace

void add_e2e_cases(Cases& cases) {
  using enum E2eProfile;
  constexpr std::array of_methods{
      Kind<Talk>{"response", "protects its responses: header between Return Code and payload, CRC over all",
                 response},
      Kind<Talk>{"counter", "counts its protected responses", counter},
      Kind<Talk>{"wrong-crc", "does not serve a request whose CRC does not fit", wrong_crc},
      Kind<Talk>{"wrong-data-id", "does not serve a request that is protected with another Data ID",
                 wrong_data_id},
      Kind<Talk>{"repeated", "does not serve a protected request that comes again", repeated},
      Kind<Talk>{"too-short", "does not serve a request that is too short for its protection", too_short}};
  constexpr std::array of_events{
      Kind<Listener>{"event", "protects its events: header between Return Code and payload, CRC over all",
                     event_header},
      Kind<Listener>{"event-counter", "counts its protected events", event_counter},
      Kind<Listener>{"event-for-two", "counts a protected event once, however many have subscribed to it",
                     event_for_two}};
  constexpr Kind<Listener> wraps{
      "event-wrap", "begins with 0 again when it has counted protected events to the end", event_wrap};
  for (const E2eProfile profile : {p1, p2, p4, p4m, p5, p6, p7, p7m, p8, p8m, p11, p22, p44, p44m}) {
    for (const auto& kind : of_methods) {
      cases.push_back(case_of(kind, profile, Need::e2e));
    }
    if (is_for_methods_alone(profile)) {
      continue;
    }
    for (const auto& kind : of_events) {
      cases.push_back(case_of(kind, profile, Need::e2e_event));
    }
    // Of those with four bits: to see the end of the others takes long.
    if (e2e_counter_end(profile) <= 16) {
      cases.push_back(case_of(wraps, profile, Need::e2e_event));
      cases.back().budget = std::chrono::minutes{2};
    }
  }
}

}  // namespace trestle::conform
