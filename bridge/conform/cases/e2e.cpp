#include <algorithm>
#include <array>

#include "bridge/conform/cases/all_cases.hpp"
#include "bridge/conform/protection.hpp"
#include "bridge/conform/trial.hpp"

namespace trestle::conform {
namespace {

using enum Level;

/// A receiver may need some good messages before it believes the counter.
constexpr int begin_within = 8;

const Bytes& content() {
  static const Bytes four = bytes({0x12, 0x34, 0x56, 0x78});
  return four;
}

/// A client of a method with protection.
class Talk {
 public:
  Talk(Trial& trial, E2eProfile profile) : t_{trial}, how_{method_of(trial, profile)} {}

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
        if (last.message.payload.size() < e2e_header_bytes(how_.profile)) {
          t_.fail("the response has no room for the E2E header",
                  fmt::format("at least {} bytes of payload", e2e_header_bytes(how_.profile)),
                  std::to_string(last.message.payload.size()), last.packet);
        }
        return last;
      }
    }
    const auto code = static_cast<unsigned>(last.message.header.return_code);
    t_.fail(fmt::format("protected requests are answered with code {:#04x}", code),
            "a response with code 0x00", fmt::format("one with code {:#04x}", code), last.packet);
  }

 private:
  static const E2eProtection& method_of(Trial& t, E2eProfile profile) {
    const auto& all = t.profile.service().e2e;
    const auto found = std::ranges::find(all, profile, &E2eProtection::profile);
    if (found == all.end()) {
      t.unsupported(fmt::format("no method with E2E profile {}", to_string(profile)));
    }
    return *found;
  }

  void count() { counter_ = (counter_ + 1) % e2e_counter_end(how_.profile); }
  Call with_counter(const E2eProtection& how, void (*spoil)(Bytes& payload)) {
    Call call = t_.call(how_.method);
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
  const E2eProfile profile = talk.how().profile;
  const ByteView payload = seen.message.payload;
  const std::size_t header = e2e_header_bytes(profile);
  t.equal("payload behind the E2E header", hex(content()), hex(payload.subspan(header)), seen.packet);
  const Bytes expected = protect(talk.how(), protected_header(seen.message.header), payload.subspan(header),
                                 e2e_counter_of(profile, payload), true);
  t.equal("E2E header", hex(ByteView{expected}.first(header)), hex(payload.first(header)), seen.packet);
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

struct Kind {
  const char* name;
  const char* title;
  void (*run)(Trial& t, Talk& talk);
};

}  // namespace

void add_e2e_cases(Cases& cases) {
  using enum E2eProfile;
  constexpr std::array kinds{
      Kind{"response", "protects its responses: header between Return Code and payload, CRC over all",
           response},
      Kind{"counter", "counts its protected responses", counter},
      Kind{"wrong-crc", "does not serve a request whose CRC does not fit", wrong_crc},
      Kind{"wrong-data-id", "does not serve a request that is protected with another Data ID", wrong_data_id},
      Kind{"repeated", "does not serve a protected request that comes again", repeated},
      Kind{"too-short", "does not serve a request that is too short for its protection", too_short}};
  for (const E2eProfile profile : {p1, p2, p4, p4m, p5, p6, p7, p7m, p8, p8m, p11, p22, p44, p44m}) {
    for (const Kind& kind : kinds) {
      cases.push_back({.id = fmt::format("e2e.profile{}.{}", to_string(profile), kind.name),
                       .title = kind.title,
                       .requirements = {"feat_req_someip_102", "feat_req_someip_103"},
                       .needs = Need::e2e,
                       .budget = std::chrono::seconds{30},
                       .run = [profile, run = kind.run](Trial& t) {
                         Talk talk{t, profile};
                         run(t, talk);
                       }});
    }
  }
}

}  // namespace trestle::conform
