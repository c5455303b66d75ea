#include "someip/core/call_table.hpp"

#include <gmock/gmock.h>

#include <map>
#include <set>
#include <vector>

#include "test/covers.hpp"

namespace trestle::someip::call_table_test {
namespace {
using namespace std::chrono_literals;
using test::covers;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

constexpr TimePoint start{1000s};
constexpr CallTarget server{{IpAddress::v4(10, 0, 0, 1), 30509}, Transport::udp};
constexpr CallTarget server_tcp{{IpAddress::v4(10, 0, 0, 1), 30509}, Transport::tcp};
constexpr CallTarget other{{IpAddress::v4(10, 0, 0, 2), 30509}, Transport::udp};
constexpr ServiceId service{0x1234};
constexpr MethodId method{0x0421};

class CallTableTest : public testing::Test {
 protected:
  StartedCall call(const CallTarget& target = server, Duration timeout = 100ms, TimePoint now = start) {
    const auto started = table.start(target, service, method, 1, timeout, now);
    EXPECT_TRUE(started);
    return started.value_or(StartedCall{});
  }
  /// The answer to a request.
  static Header answer(const Header& request, ReturnCode code = ReturnCode::ok,
                       MessageType type = MessageType::response) {
    Header header = request;
    header.type = type;
    header.return_code = code;
    return header;
  }
  AnswerDrop drop_of(const Header& header, const CallTarget& from = server) {
    const auto outcome = table.on_answer(from, header);
    EXPECT_FALSE(outcome);
    return outcome ? AnswerDrop{} : outcome.error();
  }
  std::vector<std::uint16_t> timed_out(TimePoint now) {
    std::vector<std::uint16_t> indices;
    table.on_time(now, [&](CallHandle one) { indices.push_back(one.index); });
    return indices;
  }

  std::array<CallSlot, 4> slots;
  CallTable table{slots, ClientId{0x0102}};
};

TEST(AnswerDrop, HasTheNameOfTheEnumerator) {
  EXPECT_STREQ(to_string(AnswerDrop::not_an_answer), "not_an_answer");
  EXPECT_STREQ(to_string(AnswerDrop::wrong_version), "wrong_version");
  EXPECT_STREQ(to_string(AnswerDrop::unknown), "unknown");
  EXPECT_STREQ(to_string(AnswerDrop::late), "late");
  EXPECT_STREQ(to_string(AnswerDrop::after_cancel), "after_cancel");
  EXPECT_STREQ(to_string(AnswerDrop::duplicate), "duplicate");
  EXPECT_STREQ(to_string(AnswerDrop::foreign_sender), "foreign_sender");
}

TEST_F(CallTableTest, MakesTheHeaderOfTheRequest) {
  covers({"feat_req_someip_329", "feat_req_someip_669", "feat_req_someip_649"});
  EXPECT_EQ(call().header, (Header{.service = service,
                                   .method = method,
                                   .client = ClientId{0x0102},
                                   .session = SessionId{1},
                                   .interface_version = 1,
                                   .type = MessageType::request}));
  EXPECT_EQ(call().header.session, SessionId{2});
  EXPECT_EQ(table.size(), 2U);
}

TEST_F(CallTableTest, FindsTheCallOfEachAnswerInAnyOrder) {
  covers({"feat_req_someip_79", "feat_req_someip_88"});
  const StartedCall a = call();
  const StartedCall b = call();
  const StartedCall c = call();
  EXPECT_EQ(table.on_answer(server, answer(b.header))->call, b.call);
  EXPECT_EQ(table.on_answer(server, answer(c.header))->call, c.call);
  EXPECT_EQ(table.on_answer(server, answer(a.header))->call, a.call);
  EXPECT_EQ(table.size(), 0U);
  EXPECT_FALSE(table.deadline());
  EXPECT_EQ(table.counters(), (CallCounters{.started = 3, .answered = 3}));
}

TEST_F(CallTableTest, TakesErrorsInBothMessageTypes) {
  covers({"feat_req_someip_107"});
  const auto code = [this](ReturnCode sent, MessageType type) {
    return table.on_answer(server, answer(call().header, sent, type))->code;
  };
  EXPECT_EQ(code(ReturnCode::ok, MessageType::response), ReturnCode::ok);
  EXPECT_EQ(code(ReturnCode::unknown_method, MessageType::response), ReturnCode::unknown_method);
  EXPECT_EQ(code(ReturnCode::unknown_method, MessageType::error), ReturnCode::unknown_method);
  EXPECT_EQ(code(ReturnCode{0x3f}, MessageType::error), ReturnCode{0x3f});
  EXPECT_EQ(code(ReturnCode::ok, MessageType::error), ReturnCode::not_ok);
  EXPECT_EQ(table.counters(), (CallCounters{.started = 5, .answered = 5, .errors = 4}));
}

TEST_F(CallTableTest, DropsWhatAnswersNoCall) {
  covers({"feat_req_someip_718"});
  const StartedCall one = call();
  const auto changed = [&](auto change) {
    Header header = answer(one.header);
    change(header);
    return header;
  };
  EXPECT_EQ(drop_of(changed([](Header& h) { h.service = ServiceId{0x1235}; })), AnswerDrop::unknown);
  EXPECT_EQ(drop_of(changed([](Header& h) { h.method = MethodId{0x0422}; })), AnswerDrop::unknown);
  EXPECT_EQ(drop_of(changed([](Header& h) { h.client = ClientId{0x0103}; })), AnswerDrop::unknown);
  EXPECT_EQ(drop_of(changed([](Header& h) { h.session = SessionId{2}; })), AnswerDrop::unknown);
  EXPECT_EQ(drop_of(changed([](Header& h) { h.session = SessionId{5}; })), AnswerDrop::unknown)
      << "of the same slot";
  EXPECT_EQ(drop_of(changed([](Header& h) { h.session = SessionId{0}; })), AnswerDrop::unknown);
  EXPECT_EQ(drop_of(changed([](Header& h) { h.interface_version = 2; })), AnswerDrop::wrong_version);
  EXPECT_EQ(drop_of(changed([](Header& h) { h.protocol = 2; })), AnswerDrop::wrong_version);
  for (const int type : {0x00, 0x01, 0x02, 0x40, 0xc0, 0xa0, 0x55}) {
    EXPECT_EQ(drop_of(changed([&](Header& h) { h.type = static_cast<MessageType>(type); })),
              AnswerDrop::not_an_answer);
  }
  EXPECT_EQ(table.size(), 1U) << "the call still waits";
  EXPECT_TRUE(table.on_answer(server, answer(one.header)));
}

TEST_F(CallTableTest, TakesAnswersOnlyFromWhereTheCallWent) {
  covers({"feat_req_someip_49"});
  const StartedCall one = call();
  EXPECT_EQ(drop_of(answer(one.header), other), AnswerDrop::foreign_sender);
  EXPECT_EQ(drop_of(answer(one.header), server_tcp), AnswerDrop::foreign_sender);
  EXPECT_TRUE(table.on_answer(server, answer(one.header)));
}

TEST_F(CallTableTest, AwaitsSegmentsOfJustTheAnswersThatWouldEndACall) {
  const Header good = answer(call().header);
  Header segment = good;
  segment.type = static_cast<MessageType>(0xa0);
  EXPECT_TRUE(table.awaits(server, good));
  EXPECT_TRUE(table.awaits(server, segment));
  segment.type = static_cast<MessageType>(0xa1);  // an error
  EXPECT_TRUE(table.awaits(server, segment));
  EXPECT_FALSE(table.awaits(other, good));
  EXPECT_FALSE(table.awaits(server_tcp, good));
  const auto changed = [&](const auto& change) {
    Header header = good;
    change(header);
    return header;
  };
  for (const Header& header : {
           changed([](Header& h) { h.type = MessageType::notification; }),
           changed([](Header& h) { h.service = ServiceId{1}; }),
           changed([](Header& h) { h.method = MethodId{1}; }),
           changed([](Header& h) { h.client = ClientId{1}; }),
           changed([](Header& h) { h.session = SessionId{2}; }),
           changed([](Header& h) { h.interface_version = 2; }),
           changed([](Header& h) { h.protocol = 2; }),
       }) {
    EXPECT_FALSE(table.awaits(server, header));
  }
  ASSERT_TRUE(table.on_answer(server, good));
  EXPECT_FALSE(table.awaits(server, good));
  EXPECT_EQ(table.counters(), (CallCounters{.started = 1, .answered = 1}));
}

TEST_F(CallTableTest, TellsAnswersThatComeTwiceOrTooLate) {
  const StartedCall answered = call();
  const StartedCall late = call();
  const StartedCall cancelled = call(server, 200ms);
  EXPECT_TRUE(table.on_answer(server, answer(answered.header)));
  EXPECT_TRUE(table.cancel(cancelled.call));
  EXPECT_THAT(timed_out(start + 100ms), ElementsAre(late.call.index));
  EXPECT_EQ(drop_of(answer(answered.header)), AnswerDrop::duplicate);
  EXPECT_EQ(drop_of(answer(late.header)), AnswerDrop::late);
  EXPECT_EQ(drop_of(answer(cancelled.header)), AnswerDrop::after_cancel);
  CallCounters expected{.started = 3, .answered = 1, .timed_out = 1, .cancelled = 1};
  for (const AnswerDrop reason : {AnswerDrop::duplicate, AnswerDrop::late, AnswerDrop::after_cancel}) {
    expected.drops[static_cast<std::size_t>(reason)] = 1;
    EXPECT_STRNE(to_string(reason), "unknown reason");
  }
  EXPECT_EQ(table.counters(), expected);
}

TEST_F(CallTableTest, EndsCallsWhenTheirTimeIsOver) {
  covers({"feat_req_someip_436"});
  EXPECT_FALSE(table.deadline());
  const StartedCall slow = call(server, 300ms);
  const StartedCall quick = call(server, 100ms);
  EXPECT_EQ(table.deadline(), start + 100ms);
  EXPECT_THAT(timed_out(start + 99999us), IsEmpty());
  EXPECT_THAT(timed_out(start + 100ms), ElementsAre(quick.call.index));
  EXPECT_EQ(table.deadline(), start + 300ms);
  EXPECT_THAT(timed_out(start + 100ms), IsEmpty());
  EXPECT_THAT(timed_out(start + 1h), ElementsAre(slow.call.index));
  EXPECT_FALSE(table.deadline());
  EXPECT_EQ(table.counters().timed_out, 2U);
}

TEST_F(CallTableTest, WaitsForeverWhenAsked) {
  const StartedCall patient = call(server, Duration::max());
  EXPECT_FALSE(table.deadline());
  EXPECT_THAT(timed_out(start + 10000h), IsEmpty());
  EXPECT_TRUE(table.on_answer(server, answer(patient.header)));
}

TEST_F(CallTableTest, LetsTheEndOfACallStartTheNext) {
  static_cast<void>(call());
  static_cast<void>(call());
  int ended = 0;
  table.on_time(start + 100ms, [&](CallHandle) {
    ++ended;
    static_cast<void>(call(server, 50ms, start + 100ms));
  });
  EXPECT_EQ(ended, 2);
  EXPECT_EQ(table.size(), 2U);
  EXPECT_EQ(table.deadline(), start + 150ms);
}

TEST_F(CallTableTest, EndsTheCallsOfALostConnectionAsTimedOut) {
  covers({"feat_req_someip_326"});
  const StartedCall a = call(server_tcp);
  const StartedCall over_udp = call(server, 70ms);
  const StartedCall b = call(server_tcp);
  std::vector<std::uint16_t> ended;
  table.connection_lost(server_tcp, [&](CallHandle one) {
    ended.push_back(one.index);
    if (ended.size() == 1) {
      static_cast<void>(call(server_tcp));  // over the next connection
    }
  });
  EXPECT_THAT(ended, UnorderedElementsAre(a.call.index, b.call.index));
  EXPECT_EQ(table.size(), 2U);
  EXPECT_EQ(table.deadline(), start + 70ms);
  EXPECT_TRUE(table.on_answer(server, answer(over_udp.header)));
  EXPECT_EQ(drop_of(answer(b.header), server_tcp), AnswerDrop::late);
}

TEST_F(CallTableTest, RefusesCallsBeyondItsCapacity) {
  const StartedCall first = call();
  static_cast<void>(call());
  static_cast<void>(call());
  static_cast<void>(call());
  EXPECT_FALSE(table.start(server, service, method, 1, 100ms, start));
  EXPECT_EQ(table.counters().refused, 1U);
  EXPECT_TRUE(table.cancel(first.call));
  EXPECT_EQ(call().header.session, SessionId{5}) << "refusing took no session id";
}

TEST_F(CallTableTest, KnowsTheHandlesOfEndedCallsNoMore) {
  const StartedCall first = call();
  EXPECT_TRUE(table.cancel(first.call));
  EXPECT_FALSE(table.cancel(first.call));
  for (int i = 0; i < 4; ++i) {
    static_cast<void>(call());
  }
  EXPECT_FALSE(table.cancel(first.call)) << "its slot is another call's now";
  EXPECT_FALSE(table.cancel({.index = 4, .generation = 1}));
  EXPECT_FALSE(table.cancel({}));
  EXPECT_EQ(table.size(), 4U);
}

TEST_F(CallTableTest, SkipsTheSessionsOfOutstandingCallsAndZero) {
  covers({"feat_req_someip_677", "feat_req_someip_79"});
  CallTable near_wrap{slots, ClientId{1}, SessionId{0xfffe}};
  const auto next = [&] { return near_wrap.start(server, service, method, 1, 1h, start)->header.session; };
  EXPECT_EQ(next(), SessionId{0xfffe});
  EXPECT_EQ(next(), SessionId{0xffff});
  EXPECT_EQ(next(), SessionId{1});
  // 0xfffe, 0xffff and 1 are outstanding, in the slots 2, 3 and 1: only 4, 8, ... are left.
  EXPECT_EQ(next(), SessionId{4});
  // Once around all session ids, with these four outstanding, but for one slot.
  const Header fourth{.service = service,
                      .method = method,
                      .client = ClientId{1},
                      .session = SessionId{4},
                      .interface_version = 1,
                      .type = MessageType::response};
  EXPECT_TRUE(near_wrap.on_answer(server, fourth));
  std::set<SessionId> seen;
  for (int i = 0; i < 0x10000 / 4; ++i) {
    const auto started = near_wrap.start(server, service, method, 1, 1h, start);
    ASSERT_TRUE(started);
    const SessionId session = started->header.session;
    ASSERT_NE(session, SessionId{0});
    ASSERT_NE(session, SessionId{1});
    ASSERT_NE(session, SessionId{0xfffe});
    ASSERT_NE(session, SessionId{0xffff});
    seen.insert(session);
    ASSERT_TRUE(near_wrap.cancel(started->call));
  }
  EXPECT_EQ(seen.size(), 0x10000U / 4 - 1) << "every session of the free slot, the first one twice";
}

// Against a model: random starts, answers, cancels and time, over several rounds of all session ids.
TEST(CallTable, EndsEachCallExactlyOnce) {
  std::array<CallSlot, 7> slots;
  CallTable table{slots, ClientId{9}};
  std::map<std::uint16_t, StartedCall> open;  // by session
  std::map<std::uint16_t, TimePoint> deadlines;
  std::uint64_t state = 1;
  const auto random = [&state](std::uint64_t below) {
    state = state * 6364136223846793005U + 1442695040888963407U;
    return (state >> 33U) % below;
  };
  TimePoint now = start;
  std::uint64_t ended = 0;
  for (int step = 0; step < 300000; ++step) {
    const auto any = [&] {
      return std::next(open.begin(), static_cast<std::ptrdiff_t>(random(open.size())));
    };
    switch (random(4)) {
      case 0:
      case 1: {
        const Duration timeout = std::chrono::milliseconds{1 + random(50)};
        const auto started = table.start(server, service, method, 1, timeout, now);
        ASSERT_EQ(started.has_value(), open.size() < slots.size());
        if (started) {
          const std::uint16_t session = value(started->header.session);
          ASSERT_TRUE(open.emplace(session, *started).second) << "an id that is in use";
          deadlines[session] = now + timeout;
        }
        break;
      }
      case 2:
        if (!open.empty()) {
          const auto one = any();
          Header header = one->second.header;
          header.type = MessageType::response;
          ASSERT_EQ(table.on_answer(server, header)->call, one->second.call);
          ASSERT_FALSE(table.on_answer(server, header));
          open.erase(one);
          ++ended;
        }
        break;
      default:
        now += std::chrono::milliseconds{random(20)};
        table.on_time(now, [&](CallHandle call) {
          const auto one = std::find_if(open.begin(), open.end(),
                                        [&](const auto& entry) { return entry.second.call == call; });
          ASSERT_NE(one, open.end());
          ASSERT_LE(deadlines[one->first], now);
          open.erase(one);
          ++ended;
        });
        for (const auto& [session, one] : open) {
          ASSERT_GT(deadlines[session], now) << "should have timed out";
        }
    }
    ASSERT_EQ(table.size(), open.size());
    ASSERT_EQ(table.deadline().has_value(), !open.empty());
  }
  EXPECT_EQ(table.counters().started, ended + open.size());
  EXPECT_GT(table.counters().started, 100000U);
}

}  // namespace
}  // namespace trestle::someip::call_table_test
