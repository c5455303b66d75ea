#include <string_view>

#include "bridge/conform/cases/all_cases.hpp"
#include "bridge/conform/trial.hpp"

namespace trestle::conform {
namespace {

using namespace std::chrono_literals;
using enum Level;

constexpr auto utf8_bom = {0xefU, 0xbbU, 0xbfU};
constexpr auto utf16_bom = {0xfeU, 0xffU};

/// A payload for a method of the Enhanced Testability Service, and what has to come back: a row of the tables
/// below.
struct Row {
  const char* name;
  const char* title;
  std::vector<RequirementId> requirements;
  std::vector<Tc8Id> tc8;
  std::uint16_t method;
  Bytes payload;
  Bytes expected;  ///< of an echo: empty is the payload as it was
};

/// The payload has to come back.
Case echoed(const Row& row) {
  return {.id = std::string{"ets.echo."} + row.name,
          .title = row.title,
          .requirements = row.requirements,
          .tc8 = row.tc8,
          .needs = Need::ets | Need::udp,
          .run = [method = row.method, payload = row.payload,
                  expected = row.expected.empty() ? row.payload : row.expected](Trial& t) {
            const SeenMessage seen = t.good_answer_to(t.call(someip::MethodId{method}, payload));
            t.equal("payload", hex(expected), hex(seen.message.payload), seen.packet);
          }};
}

/// There must be no answer with success.
Case rejected(const Row& row) {
  return {.id = std::string{"ets.reject."} + row.name,
          .title = row.title,
          .requirements = row.requirements,
          .tc8 = row.tc8,
          .needs = Need::ets | Need::udp,
          .run = [method = row.method, payload = row.payload](Trial& t) {
            t.not_served(t.call(someip::MethodId{method}, payload));
          }};
}

/// Any answer is right, and the device has to survive.
Case survived(const Row& row) {
  return {.id = std::string{"ets.survive."} + row.name,
          .title = row.title,
          .requirements = row.requirements,
          .tc8 = row.tc8,
          .needs = Need::ets | Need::udp,
          .run = [method = row.method, payload = row.payload](Trial& t) {
            t.answer_to(t.call(someip::MethodId{method}, payload));
          }};
}

Bytes joined(std::initializer_list<Bytes> parts) {
  Bytes all;
  for (const Bytes& part : parts) {
    append(all, part);
  }
  return all;
}

Bytes length32(std::size_t length) {
  Bytes all;
  append_u32(all, static_cast<std::uint32_t>(length));
  return all;
}

Bytes ascii(std::string_view text) {
  Bytes all;
  for (const char c : text) {
    append_u8(all, static_cast<std::uint8_t>(c));
  }
  return all;
}

Bytes ascii16(std::string_view text) {
  Bytes all;
  for (const char c : text) {
    append_u16(all, static_cast<std::uint16_t>(c));
  }
  return all;
}

/// BOM, text, terminator.
Bytes utf8(std::string_view text) {
  return joined({bytes(utf8_bom), ascii(text), bytes({0})});
}
Bytes utf16(std::string_view text) {
  return joined({bytes(utf16_bom), ascii16(text), bytes({0, 0})});
}

Bytes with_length(const Bytes& contents, std::ptrdiff_t more = 0) {
  return joined(
      {length32(static_cast<std::size_t>(static_cast<std::ptrdiff_t>(contents.size()) + more)), contents});
}

Bytes padded(Bytes contents, std::size_t size) {
  contents.resize(size);
  return contents;
}

Bytes changed(Bytes contents, std::size_t at, unsigned value) {
  contents[at] = static_cast<std::byte>(value);
  return contents;
}

std::vector<Row> echoes() {
  return {
      {"uint8", "echoes a uint8", {"feat_req_someip_682"}, {"SOMEIP_ETS_027"}, 0x08, bytes({0x2a}), {}},
      {"int8", "echoes an int8", {"feat_req_someip_682"}, {"SOMEIP_ETS_021"}, 0x0e, bytes({0xd6}), {}},
      {"float64",
       "echoes a float64",
       {"feat_req_someip_682"},
       {"SOMEIP_ETS_019"},
       0x12,
       bytes({0x40, 0x09, 0x21, 0xfb, 0x54, 0x44, 0x2d, 0x18}),
       {}},
      {"enumeration",
       "echoes an enumeration of one byte",
       {"feat_req_someip_799"},
       {"SOMEIP_ETS_009"},
       0x17,
       bytes({0x03}),
       {}},
      {"surplus-bytes",
       "echoes a uint8 and ignores what is behind it",
       {"feat_req_someip_168", "feat_req_someipcompat_1198"},
       {},
       0x08,
       bytes({0x2a, 1, 2, 3}),
       bytes({0x2a})},
      {"array",
       "echoes an array of any size",
       {"feat_req_someip_254", "feat_req_someip_257"},
       {"SOMEIP_ETS_028"},
       0x09,
       bytes({0, 0, 0, 3, 1, 2, 3}),
       {}},
      {"array-empty",
       "echoes an empty array",
       {"feat_req_someip_254"},
       {"SOMEIP_ETS_067"},
       0x09,
       bytes({0, 0, 0, 0}),
       {}},
      {"array-length-8",
       "echoes an array with a length field of 8 bits",
       {"feat_req_someip_621"},
       {"SOMEIP_ETS_031"},
       0x3e,
       bytes({3, 7, 8, 9}),
       {}},
      {"array-length-16",
       "echoes an array with a length field of 16 bits",
       {"feat_req_someip_621"},
       {"SOMEIP_ETS_029"},
       0x3f,
       bytes({0, 3, 7, 8, 9}),
       {}},
      {"array-two-dimensions",
       "echoes an array of arrays",
       {"feat_req_someip_259"},
       {"SOMEIP_ETS_030"},
       0x35,
       bytes({0, 0, 0, 12, 0, 0, 0, 2, 1, 2, 0, 0, 0, 2, 3, 4}),
       {}},
      {"array-static",
       "echoes an array of five bytes without length field",
       {"feat_req_someip_241", "feat_req_someip_243"},
       {"SOMEIP_ETS_022"},
       0x36,
       bytes({9, 8, 7, 6, 5}),
       {}},
      {"array-within-limits",
       "echoes an array of three to five elements",
       {"feat_req_someip_254"},
       {"SOMEIP_ETS_032"},
       0x37,
       bytes({0, 0, 0, 4, 1, 2, 3, 4}),
       {}},
      {"e2e-shaped",
       "echoes a struct that has the shape of end-to-end protection",
       {"feat_req_someip_230", "feat_req_someip_575", "feat_req_someip_602"},
       {"SOMEIP_ETS_034"},
       0x0b,
       bytes({0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 4, 5}),
       {}},
      {"union",
       "echoes a union with a uint8",
       {"feat_req_someip_263", "feat_req_someip_264", "feat_req_someip_566", "feat_req_someip_565",
        "feat_req_someip_573", "feat_req_someip_675"},
       {"SOMEIP_ETS_038"},
       0x19,
       bytes({0, 0, 0, 1, 0, 0, 0, 1, 0x55}),
       {}},
      {"union-padding",
       "echoes the value of a union, and drops the padding behind it",
       {"feat_req_someip_274"},
       {},
       0x19,
       bytes({0, 0, 0, 4, 0, 0, 0, 1, 0x55, 0, 0, 0}),
       bytes({0, 0, 0, 1, 0, 0, 0, 1, 0x55})},
      {"byte-order",
       "reads and writes numbers in big endian",
       {"feat_req_someip_42"},
       {"SOMEIP_ETS_005"},
       0x1f,
       bytes({0x01, 0x02, 0x03}),
       bytes({0x00, 0x00, 0x02, 0x04})},
      {"common-types",
       "gives values of the basic types back in reverse order",
       {"feat_req_someip_172", "feat_req_someip_682", "feat_req_someip_169", "feat_req_someip_652",
        "feat_req_someip_574"},
       {"SOMEIP_ETS_008"},
       0x23,
       bytes({1,    2,    0,    3, 0, 0,    0,    4, 0xfb, 0xff, 0xfa, 0xff, 0xff, 0xff,
              0xf9, 0x40, 0x20, 0, 0, 0x40, 0x04, 0, 0,    0,    0,    0,    0}),
       bytes({0x40, 0x04, 0,    0,    0,    0, 0, 0, 0x40, 0x20, 0, 0, 0xff, 0xff,
              0xff, 0xf9, 0xff, 0xfa, 0xfb, 0, 0, 0, 4,    0,    3, 2, 1})},
      {"bool-upper-bits",
       "takes the lowest bit of a bool, and sends the others 0",
       {"feat_req_someip_817"},
       {},
       0x23,
       bytes({0xff, 2,    0,    3, 0, 0,    0,    4, 0xfb, 0xff, 0xfa, 0xff, 0xff, 0xff,
              0xf9, 0x40, 0x20, 0, 0, 0x40, 0x04, 0, 0,    0,    0,    0,    0}),
       bytes({0x40, 0x04, 0,    0,    0,    0, 0, 0, 0x40, 0x20, 0, 0, 0xff, 0xff,
              0xff, 0xf9, 0xff, 0xfa, 0xfb, 0, 0, 0, 4,    0,    3, 2, 1})},
      {"bitfields",
       "gives the bits of three integers back in reverse order",
       {"feat_req_someip_689"},
       {"SOMEIP_ETS_007"},
       0x41,
       bytes({0x01, 0x00, 0x03, 0x00, 0x00, 0x00, 0x07}),
       bytes({0x80, 0xc0, 0x00, 0xe0, 0x00, 0x00, 0x00})},
      {"utf8",
       "echoes a UTF-8 string of any length",
       {"feat_req_someip_234", "feat_req_someip_662", "feat_req_someip_687", "feat_req_someip_581",
        "feat_req_someip_562", "feat_req_someip_238"},
       {"SOMEIP_ETS_048"},
       0x15,
       with_length(utf8("hello")),
       {}},
      {"utf8-empty",
       "echoes an empty UTF-8 string",
       {"feat_req_someip_662", "feat_req_someip_800"},
       {},
       0x15,
       with_length(utf8("")),
       {}},
      {"utf8-fixed",
       "echoes a UTF-8 string in 64 bytes",
       {"feat_req_someip_233"},
       {"SOMEIP_ETS_053"},
       0x13,
       padded(utf8("hello"), 64),
       {}},
      {"utf16",
       "echoes a UTF-16 string of any length",
       {"feat_req_someip_234", "feat_req_someip_639", "feat_req_someip_238"},
       {"SOMEIP_ETS_039"},
       0x16,
       with_length(utf16("hello")),
       {}},
      {"utf16-odd-tail",
       "drops a byte behind the terminator of a UTF-16 string",
       {"feat_req_someip_641", "feat_req_someip_642"},
       {"SOMEIP_ETS_044"},
       0x16,
       with_length(joined({utf16("hello"), bytes({0x7f})})),
       with_length(utf16("hello"))},
      {"utf16-fixed",
       "echoes a UTF-16 string in 64 bytes",
       {"feat_req_someip_233"},
       {"SOMEIP_ETS_046"},
       0x14,
       padded(utf16("hello"), 64),
       {}},
      {"utf16-fixed-longer",
       "echoes the 64 bytes of a UTF-16 string that is followed by another byte",
       {"feat_req_someip_168"},
       {"SOMEIP_ETS_047"},
       0x14,
       padded(utf16("hello"), 65),
       padded(utf16("hello"), 64)},
  };
}

std::vector<Row> rejects() {
  return {
      {"array-length-long",
       "does not serve an array whose length is beyond the payload",
       {"feat_req_someip_254"},
       {"SOMEIP_ETS_002"},
       0x09,
       bytes({0, 0, 0, 9, 1, 2, 3}),
       {}},
      {"array-below-minimum",
       "does not serve an array with too few elements",
       {"feat_req_someip_254"},
       {"SOMEIP_ETS_033"},
       0x37,
       bytes({0, 0, 0, 1, 1}),
       {}},
      {"empty",
       "does not serve an echo without payload",
       {"feat_req_someip_718"},
       {"SOMEIP_ETS_003"},
       0x08,
       {},
       {}},
      {"union-message-long",
       "does not serve a union whose length is beyond the payload",
       {"feat_req_someip_272"},
       {"SOMEIP_ETS_071", "SOMEIP_ETS_070"},
       0x19,
       bytes({0, 0, 0, 9, 0, 0, 0, 1, 0x55}),
       {}},
      {"union-length-zero",
       "does not serve a union with length 0",
       {"feat_req_someip_272"},
       {"SOMEIP_ETS_072"},
       0x19,
       bytes({0, 0, 0, 0, 0, 0, 0, 1, 0x55}),
       {}},
      {"utf8-length-long",
       "does not serve a UTF-8 string whose length is beyond the payload",
       {"feat_req_someip_237"},
       {"SOMEIP_ETS_049"},
       0x15,
       with_length(utf8("hello"), 5),
       {}},
      {"utf8-length-short",
       "does not serve a UTF-8 string whose length cuts it",
       {"feat_req_someip_687"},
       {"SOMEIP_ETS_051"},
       0x15,
       with_length(utf8("hello"), -3),
       {}},
      {"utf8-bom",
       "does not serve a UTF-8 string with a wrong BOM",
       {"feat_req_someip_666"},
       {"SOMEIP_ETS_052"},
       0x15,
       changed(with_length(utf8("hello")), 5, 0xba),
       {}},
      {"utf8-no-terminator",
       "does not serve a UTF-8 string without terminator",
       {"feat_req_someip_687"},
       {},
       0x15,
       with_length(joined({bytes(utf8_bom), ascii("hello")})),
       {}},
      {"utf8-invalid",
       "does not serve a string that is not valid UTF-8",
       {"feat_req_someip_234"},
       {},
       0x15,
       with_length(joined({bytes(utf8_bom), bytes({0xc3, 0x28, 0})})),
       {}},
      {"utf8-fixed-short",
       "does not serve a UTF-8 string of 63 bytes in place of 64",
       {"feat_req_someip_233"},
       {"SOMEIP_ETS_066"},
       0x13,
       padded(utf8("hello"), 63),
       {}},
      {"utf16-length-long",
       "does not serve a UTF-16 string whose length is beyond the payload",
       {"feat_req_someip_237"},
       {"SOMEIP_ETS_040"},
       0x16,
       with_length(utf16("hello"), 6),
       {}},
      {"utf16-length-short",
       "does not serve a UTF-16 string whose length cuts it",
       {"feat_req_someip_639"},
       {"SOMEIP_ETS_042"},
       0x16,
       with_length(utf16("hello"), -4),
       {}},
      {"utf16-odd-before-end",
       "does not serve a UTF-16 string with an odd byte before its terminator",
       {"feat_req_someip_640", "feat_req_someip_641"},
       {"SOMEIP_ETS_043"},
       0x16,
       with_length(joined({bytes(utf16_bom), ascii16("hello"), bytes({0x41, 0, 0})})),
       {}},
      {"utf16-bom",
       "does not serve a UTF-16 string with the BOM of the other byte order",
       {"feat_req_someip_666"},
       {"SOMEIP_ETS_045"},
       0x16,
       with_length(joined({bytes({0xff, 0xfe}), ascii16("hello"), bytes({0, 0})})),
       {}},
      {"utf16-fixed-short",
       "does not serve a UTF-16 string of 63 bytes in place of 64",
       {"feat_req_someip_233"},
       {"SOMEIP_ETS_064"},
       0x14,
       padded(utf16("hello"), 63),
       {}},
  };
}

std::vector<Row> survivals() {
  return {
      {"union-unknown-type",
       "answers a union of unknown type somehow",
       {"feat_req_someip_273"},
       {"SOMEIP_ETS_073"},
       0x19,
       bytes({0, 0, 0, 1, 0, 0, 0, 0x63, 0x55}),
       {}},
      {"utf8-fixed-long",
       "answers a UTF-8 string of 65 bytes in place of 64 somehow",
       {"feat_req_someip_168"},
       {"SOMEIP_ETS_065"},
       0x13,
       padded(utf8("hello"), 65),
       {}},
      {"utf16-fixed-long",
       "answers a UTF-16 string of 65 bytes in place of 64 somehow",
       {"feat_req_someip_168"},
       {"SOMEIP_ETS_063"},
       0x14,
       padded(utf16("hello"), 65),
       {}},
  };
}

/// A good string, and then a bad one.
auto good_then_bad(std::uint16_t method, Bytes good, Bytes bad) {
  return [=](Trial& t) {
    const SeenMessage seen = t.good_answer_to(t.call(someip::MethodId{method}, good));
    t.equal("payload", hex(good), hex(seen.message.payload), seen.packet);
    t.not_served(t.call(someip::MethodId{method}, bad));
  };
}

/// Gets, sets and gets a field.
auto field_kept(std::uint16_t getter, Bytes value) {
  return [=](Trial& t) {
    t.good_answer_to(t.call(someip::MethodId{getter}));
    t.good_answer_to(t.call(someip::MethodId{static_cast<std::uint16_t>(getter + 1)}, value));
    const SeenMessage seen = t.good_answer_to(t.call(someip::MethodId{getter}));
    t.equal("value", hex(value), hex(seen.message.payload), seen.packet);
  };
}

void fire(Trial& t, std::uint16_t method) {
  Call call = t.call(someip::MethodId{method});
  call.type = someip::MessageType::request_no_return;
  t.send(call);
}

/// Suspends the service, and waits until it is back. Ends the case when it does not go, or does not come
/// back.
SeenEntry suspended(Trial& t) {
  if (!t.asked_for([&] { fire(t, 0x02); },
                   [&](const SeenEntry& seen) {
                     return seen.entry.kind() == sd::EntryKind::stop_offer_service &&
                            seen.entry.service == t.profile.service().service &&
                            seen.entry.instance == t.profile.service().instance;
                   })) {
    t.missing("no StopOfferService after suspendInterface", "a StopOfferService");
  }
  const auto offer = t.await_entry(t.tester.packets().size(), t.profile.timing.ready_within,
                                   Trial::is_offer(t.profile.service()));
  if (!offer) {
    t.missing("the service is not offered again after suspendInterface", "an OfferService");
  }
  return *offer;
}

}  // namespace

void add_ets_echo_cases(Cases& cases) {
  for (const Row& row : echoes()) {
    cases.push_back(echoed(row));
  }
  for (const Row& row : rejects()) {
    cases.push_back(rejected(row));
  }
  for (const Row& row : survivals()) {
    cases.push_back(survived(row));
  }
  const Need ets = Need::ets | Need::udp;
  const Cases more{
      {.id = "ets.reject.utf8-second",
       .title = "echoes a good UTF-8 string, and does not serve a cut one after it",
       .requirements = {"feat_req_someip_237"},
       .tc8 = {"SOMEIP_ETS_050"},
       .needs = ets,
       .run = good_then_bad(0x15, with_length(utf8("hello")), with_length(utf8("hello"), 4))},
      {.id = "ets.reject.utf16-second",
       .title = "echoes a good UTF-16 string, and does not serve a cut one after it",
       .requirements = {"feat_req_someip_237"},
       .tc8 = {"SOMEIP_ETS_041"},
       .needs = ets,
       .run = good_then_bad(0x16, with_length(utf16("hello")), with_length(utf16("hello"), 4))},
      {.id = "ets.field.uint8",
       .title = "keeps the value of TestFieldUINT8",
       .requirements = {"feat_req_someip_633", "feat_req_someip_634"},
       .tc8 = {"SOMEIP_ETS_166"},
       .needs = ets,
       .run = field_kept(0x26, bytes({0x42}))},
      {.id = "ets.field.array",
       .title = "keeps the value of TestFieldUINT8Array",
       .requirements = {"feat_req_someip_633", "feat_req_someip_634"},
       .tc8 = {"SOMEIP_ETS_167"},
       .needs = ets,
       .run = field_kept(0x28, bytes({0, 0, 0, 4, 9, 8, 7, 6}))},
      {.id = "ets.field.interface-version",
       .title = "answers the getter of its interface version",
       .requirements = {"feat_req_someip_633"},
       .tc8 = {"SOMEIP_ETS_122"},
       .needs = ets,
       .run = [](Trial& t) { t.answer_to(t.call(someip::MethodId{0x25})); }},
      {.id = "ets.reset",
       .title = "forgets values of fields when it is reset",
       .requirements = {"feat_req_someip_633"},
       .tc8 = {"SOMEIP_ETS_146"},
       .needs = ets,
       .run =
           [](Trial& t) {
             const SeenMessage set = t.good_answer_to(t.call(someip::MethodId{0x27}, bytes({0x77})));
             t.equal("value that was set", std::string{"77"}, hex(set.message.payload), set.packet);
             const SeenMessage before = t.good_answer_to(t.call(someip::MethodId{0x26}));
             t.equal("value before", std::string{"77"}, hex(before.message.payload), before.packet);
             fire(t, 0x01);
             const SeenMessage seen = t.good_answer_to(t.call(someip::MethodId{0x26}));
             t.require(hex(seen.message.payload) != "77", "value after the reset", "another",
                       "the one that was set", seen.packet);
           }},
      {.id = "ets.suspend.comes-back",
       .title = "withdraws its offer when it is suspended, and offers the same endpoints later",
       .requirements = {"feat_req_someipsd_820", "feat_req_someipsd_261", "feat_req_someipsd_22"},
       .tc8 = {"SOMEIP_ETS_089"},
       .needs = ets,
       .run =
           [](Trial& t) {
             const auto before = t.offer().endpoints();
             const SeenEntry offer = suspended(t);
             t.equal("endpoints", true, before == offer.endpoints(), offer.packet);
           }},
      {.id = "ets.suspend.field-is-kept",
       .title = "answers getters again after it was suspended",
       .requirements = {"feat_req_someipsd_820", "feat_req_someip_633"},
       .tc8 = {"SOMEIP_ETS_164"},
       .needs = ets,
       .run =
           [](Trial& t) {
             t.good_answer_to(t.call(someip::MethodId{0x27}, bytes({0x78})));
             suspended(t);
             t.good_answer_to(t.call(someip::MethodId{0x26}));
           }},
      {.id = "ets.suspend.ends-subscriptions",
       .title = "sends no events any more to those who subscribed before it was suspended",
       .requirements = {"feat_req_someipsd_830"},
       .needs = ets | Need::event,
       .run =
           [](Trial& t) {
             const EventSource source = t.source();
             t.acknowledged(t.subscribe(source));
             t.event(source);
             suspended(t);
             for (const SeenMessage& seen : t.all_events(source)) {
               t.different("event", "none, as StopOfferService ended the subscription", "one", seen.packet);
               return;
             }
           }},
      {.id = "ets.suspend.tcp-stays",
       .title = "leaves it to its clients to close TCP connections when it is suspended",
       .requirements = {"feat_req_someip_680"},
       .tc8 = {"SOMEIP_ETS_037"},
       .needs = ets | Need::tcp,
       .run =
           [](Trial& t) {
             Call call = t.call(someip::MethodId{0x0a}, bytes({1}));
             call.transport = Transport::tcp;
             t.good_answer_to(call);
             const PortId connection = t.tcp();
             suspended(t);
             t.equal("connection", std::string{"open"},
                     std::string{t.tester.is_closed(connection) ? "closed by the device" : "open"}, nullptr);
           }},
  };
  cases.insert(cases.end(), more.begin(), more.end());
}

}  // namespace trestle::conform
