#include "bridge/carry/runtime/loop_check.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <vector>

#include "bridge/carry/runtime/bridge_mark.hpp"
#include "test/bytes.hpp"

namespace trestle::carry::loop_check_test {
namespace {

using namespace std::chrono_literals;
using TimePoint = LoopCheck::TimePoint;
using test::hex;

/// A route under a LoopCheck, in virtual time.
class Route {
 public:
  /// At `now_`, after what is due.
  bool carry(std::uint64_t message, std::optional<std::uint64_t> from = 1) {
    judge();
    const bool carried = check_.may_carry(message, from, now_);
    ++(carried ? carried_ : dropped_);
    return carried;
  }
  void pass(std::chrono::nanoseconds time) { now_ += time; }
  void judge() {
    if (check_.deadline() && *check_.deadline() <= now_) {
      rings_ += check_.judge(now_) ? 1 : 0;
    }
  }

  LoopCheck check_;
  TimePoint now_{1h};
  int carried_ = 0;
  int dropped_ = 0;
  int rings_ = 0;
};

/// A ring around a route: what is carried comes back after `round`. Publishes `messages` in this order, one
/// every `period`, for a time.
///
/// @param first  who sends what is published; @param again  who brings back what went round.
/// @return how many messages come back in the last tenth of the time
int run_ring(Route& route, std::chrono::nanoseconds round, std::chrono::nanoseconds period, int messages,
             std::chrono::nanoseconds time, std::optional<std::uint64_t> first = 1,
             std::optional<std::uint64_t> again = 2) {
  int late = 0;
  std::deque<std::pair<TimePoint, std::uint64_t>> in_ring;
  const TimePoint begin = route.now_;
  int published = 0;
  while (route.now_ - begin < time) {
    while (published < messages && route.now_ - begin >= period * published) {
      const auto message = static_cast<std::uint64_t>(++published) * 0x1234'5678'9abcU;
      if (route.carry(message, first)) {
        in_ring.emplace_back(route.now_ + round, message);
      }
    }
    while (!in_ring.empty() && in_ring.front().first <= route.now_) {
      const auto message = in_ring.front().second;
      in_ring.pop_front();
      late += route.now_ - begin >= time * 9 / 10 ? 1 : 0;
      if (route.carry(message, again)) {
        in_ring.emplace_back(route.now_ + round, message);
      }
    }
    route.judge();
    route.pass(200us);
  }
  return late;
}

TEST(LoopCheck, EndsTheRoundsOfAMessageAndTellsOfThem) {
  for (const auto round : {300us, 1000us, 5000us}) {
    Route route;
    run_ring(route, round, 1s, 1, 5s);
    EXPECT_EQ(route.rings_, 1) << round.count();
    EXPECT_LE(route.carried_, 102);  // itself, and those before the trial
  }
}

TEST(LoopCheck, BoundsWhatARingCarriesForAsLongAsItIsThere) {
  Route route;
  run_ring(route, 1ms, 200ms, 100, 20s);
  EXPECT_GE(route.rings_, 10);
  // 100 published ones, and at most some ten rounds of each after the first.
  EXPECT_LE(route.carried_, 100 + 101 + 100 * 12);
}

TEST(LoopCheck, FindsARingOfManyMessages) {
  Route route;
  run_ring(route, 2ms, 10ms, 500, 5s);
  EXPECT_GE(route.rings_, 1);
  EXPECT_LE(route.carried_, 500 + 100 + 5 * 200);  // 200 a second at most go round
}

TEST(LoopCheck, EmptiesARingThatManyMessagesCameIntoAtOnce) {
  for (const bool known : {true, false}) {
    for (const auto& [messages, round] : {std::pair{20, 1ms},
                                          {20, 20ms},
                                          {200, 5ms},
                                          {200, 20ms},
                                          {200, 400ms},
                                          {2000, 100ms},
                                          {2000, 450ms},
                                          {6000, 450ms}}) {
      Route route;
      const auto first = known ? std::optional<std::uint64_t>{1} : std::nullopt;
      const auto again = known ? std::optional<std::uint64_t>{2} : std::nullopt;
      EXPECT_EQ(run_ring(route, round, 0ms, messages, 10s, first, again), 0)
          << messages << " messages, " << round.count() << " ms";
      EXPECT_GE(route.rings_, 1);
    }
  }
}

// Each round makes two of each message.
TEST(LoopCheck, EmptiesTwoRingsThatShareARoute) {
  Route route;
  std::deque<std::pair<TimePoint, std::uint64_t>> first;
  std::deque<std::pair<TimePoint, std::uint64_t>> second;
  const auto carry = [&](std::uint64_t message, std::uint64_t from) {
    if (route.carry(message, from)) {
      first.emplace_back(route.now_ + 3ms, message);
      second.emplace_back(route.now_ + 7ms, message);
    }
  };
  for (std::uint64_t message = 1; message <= 10; ++message) {
    carry(message, 1);
  }
  for (const TimePoint end = route.now_ + 5s; route.now_ < end; route.pass(200us)) {
    for (auto* const ring : {&first, &second}) {
      while (!ring->empty() && ring->front().first <= route.now_) {
        const auto message = ring->front().second;
        ring->pop_front();
        carry(message, ring == &first ? 2 : 3);
      }
    }
    route.judge();
  }
  EXPECT_GE(route.rings_, 1);
  EXPECT_LE(route.carried_, 300);
  EXPECT_TRUE(first.empty() && second.empty());
}

TEST(LoopCheck, BoundsARingThatMessagesComeIntoAllTheTime) {
  for (const auto period : {1ms, 3ms, 10ms}) {
    for (const auto round : {1ms, 20ms, 200ms}) {
      Route route;
      const int published = static_cast<int>(20s / period);
      run_ring(route, round, period, published, 20s);
      EXPECT_GE(route.rings_, 1) << period.count() << " " << round.count();
      EXPECT_LE(route.carried_ - published, 101 + 20 * 200) << period.count() << " " << round.count();
    }
  }
}

TEST(RecentMessages, KeepsThoseOfASecondUpToItsRoom) {
  RecentMessages recent;
  const TimePoint now{1h};
  std::uint64_t hash = 1;
  for (std::size_t i = 0; i < RecentMessages::most / 2; ++i) {
    EXPECT_FALSE(recent.note(hash += 0x9e37'79b9'7f4a'7c15U, 1, now));
  }
  std::size_t known = 0;
  for (std::size_t i = 0; i < RecentMessages::most / 2; ++i, hash -= 0x9e37'79b9'7f4a'7c15U) {
    known += recent.has(hash, now + 1s) ? 1U : 0U;
    EXPECT_FALSE(recent.has(hash, now + 1001ms));
  }
  EXPECT_GE(known, RecentMessages::most / 2 * 95 / 100);
  EXPECT_EQ(recent.room(), RecentMessages::most);
}

TEST(LoopCheck, DropsNothingOfWhoPublishesTheSameSeldom) {
  Route route;
  for (int i = 0; i < 10'000; ++i) {
    route.carry(1);
    route.carry(2);  // twice at once, as a person or two nodes would
    route.carry(2, 2);
    route.pass(40ms);
  }
  EXPECT_EQ(route.dropped_, 0);
  EXPECT_EQ(route.rings_, 0);
}

TEST(LoopCheck, LetsTwoWhoPublishTheSameOftenGoOnAfterOneTrial) {
  Route route;
  for (int i = 0; i < 60'000; ++i) {  // a minute, two nodes at 1 kHz
    route.carry(7);
    route.carry(7, 2);
    route.pass(1ms);
  }
  EXPECT_EQ(route.rings_, 0);
  EXPECT_LE(route.dropped_, 60);
}

TEST(LoopCheck, FindsARingBesideTwoWhoPublishTheSameOften) {
  Route route;
  for (int i = 0; i < 5'000; ++i) {
    route.carry(7);
    route.carry(7, 2);
    route.pass(5ms);
  }
  ASSERT_EQ(route.rings_, 0);
  run_ring(route, 300us, 1s, 1, 3s);
  EXPECT_GE(route.rings_, 1);
}

// One that waits for each message to arrive stops when it does not, as a ring does.
TEST(LoopCheck, NeverMindsASingleSender) {
  Route route;
  for (int i = 0; i < 60'000; ++i) {
    ASSERT_TRUE(route.carry(7));
    route.pass(100us);
  }
}

TEST(LoopCheck, NeverMindsMessagesThatDiffer) {
  Route route;
  for (std::uint64_t i = 1; i < 100'000; ++i) {
    ASSERT_TRUE(route.carry(i * 0x9e37'79b9'7f4a'7c15U));
    route.pass(10us);
  }
}

TEST(LoopCheck, ForgetsMessagesAfterASecond) {
  LoopCheck check;
  const TimePoint now{1h};
  EXPECT_FALSE(check.is_repeat(5, now));
  EXPECT_TRUE(check.may_carry(5, 1, now));
  EXPECT_TRUE(check.is_repeat(5, now + 1s));
  EXPECT_FALSE(check.is_repeat(5, now + 1001ms));
  EXPECT_FALSE(check.is_repeat(6, now));
}

TEST(MessageHash, DiffersWithLengthAndBothEnds) {
  std::vector<std::byte> message(5000);
  const auto before = message_hash(message);
  for (const std::size_t place : {0U, 127U, 4872U, 4999U}) {
    message[place] = std::byte{1};
    EXPECT_NE(message_hash(message), before) << place;
    message[place] = std::byte{0};
  }
  EXPECT_EQ(message_hash(message), before);
  for (std::size_t size = 0; size < 300; ++size) {
    EXPECT_NE(message_hash(std::span{message}.first(size)), message_hash(std::span{message}.first(size + 1)));
  }
}

TEST(LoopCheckOfCalls, NeedsFewFromWhereSomebodyCouldCloseARing) {
  for (const bool suspect : {false, true}) {
    LoopCheck check{limits_of_calls};
    TimePoint now{1h};
    int carried = 0;
    for (std::uint64_t i = 0; i < 1000; ++i) {
      carried += check.may_carry(5, suspect ? std::nullopt : std::optional{i}, now) ? 1 : 0;
      now += 100us;
    }
    EXPECT_EQ(carried, suspect ? 101 : 301);
  }
}

// Behind a bridge are all who are in its network.
TEST(LoopCheckOfBridges, CountsAllThatComesAgain) {
  LoopCheck check;
  auto now = LoopCheck::TimePoint{} + std::chrono::hours{1};
  int carried = 0;
  for (int i = 0; i < 500; ++i) {
    carried += check.may_carry(5, std::nullopt, now) ? 1 : 0;
    EXPECT_TRUE(check.may_carry(std::uint64_t{6} + 64 * static_cast<unsigned>(i), std::nullopt, now));
    now += std::chrono::milliseconds{1};
  }
  EXPECT_EQ(carried, 101) << "until it is on trial";
  EXPECT_TRUE(check.deadline().has_value());
}

// A route from SOME/IP whose event comes from a host where somebody reads its topic who is perhaps a bridge:
// nothing tells what he brings back from what he sends.
TEST(LoopCheckOfSuspects, EndsTheRoundsOfAMessageAndTellsOfThem) {
  for (const auto round : {300us, 1000us, 5000us}) {
    Route route;
    run_ring(route, round, 1s, 1, 5s, std::nullopt, std::nullopt);
    EXPECT_EQ(route.rings_, 1) << round.count();
    EXPECT_LE(route.carried_, 102);
  }
}

TEST(LoopCheckOfSuspects, BoundsWhatARingCarriesForAsLongAsItIsThere) {
  Route route;
  run_ring(route, 1ms, 100ms, 600, 60s, std::nullopt, std::nullopt);
  EXPECT_GE(route.rings_, 10);
  EXPECT_LE(route.carried_, 600 + 101 + 60 * 200);
}

TEST(LoopCheckOfSuspects, LetsAnHonestEventGoOnThatSaysTheSameOften) {
  for (const auto period : {500us, 1000us, 5000us, 9000us}) {
    Route route;
    int late = 0;  // dropped after the first minute
    for (auto time = 0us; time < 59min; time += period) {
      late += !route.carry(7, std::nullopt) && time >= 1min ? 1 : 0;
      route.pass(period);
    }
    EXPECT_EQ(route.rings_, 0) << period.count();
    EXPECT_LE(route.dropped_, std::max<std::int64_t>(10, 60ms / period)) << period.count();
    EXPECT_EQ(late, 0) << period.count();
  }
}

TEST(LoopCheckOfSuspects, DropsNothingOfWhatComesSeldomOrDiffers) {
  Route route;
  for (std::uint64_t i = 1; i < 100'000; ++i) {
    ASSERT_TRUE(route.carry(i * 0x9e37'79b9'7f4a'7c15U, std::nullopt));
    ASSERT_TRUE(i % 100 != 0 || route.carry(5, std::nullopt));  // 99 a second
    route.pass(101us);
  }
}

TEST(BridgeMark, IsReadAsItIsWritten) {
  const BridgeMark mark{true, IpAddress::v4(10, 0, 0, 2), someip::ServiceId{0x4101}, someip::InstanceId{1},
                        someip::MethodId{0x8001}};
  EXPECT_EQ(to_text(mark), "out,10.0.0.2,4101.0001.8001");
  EXPECT_EQ(parse_bridge_mark(to_text(mark)), mark);
  EXPECT_EQ(parse_bridge_mark(to_text(mark) + ",more"), mark);
  BridgeMark v6 = mark;
  v6.to_someip = false;
  v6.address = {{0xfe, 0x80, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1}, true};
  EXPECT_EQ(parse_bridge_mark(to_text(v6)), v6);
}

TEST(BridgeMark, SaysWhatItTakesFromOtherBridges) {
  BridgeMark out{true, IpAddress::v4(10, 0, 0, 2), someip::ServiceId{0x4101}, someip::InstanceId{1},
                 someip::MethodId{0x8001}};
  BridgeMark in{false, IpAddress::v4(10, 0, 0, 1), someip::ServiceId{0x1234}, someip::InstanceId{1},
                someip::MethodId{0x8001}};
  EXPECT_FALSE(goes_on(out, to_text(in)) || goes_on(in, to_text(out)));
  out.from = {IpAddress::v4(10, 0, 0, 5), IpAddress::v4(10, 0, 0, 1)};
  EXPECT_EQ(to_text(out), "out,10.0.0.2,4101.0001.8001,10.0.0.5+10.0.0.1");
  EXPECT_EQ(parse_bridge_mark(to_text(out)), out);
  EXPECT_TRUE(goes_on(out, to_text(in)) && goes_on(in, to_text(out)));
  in.address = IpAddress::v4(10, 0, 0, 3);
  EXPECT_FALSE(goes_on(out, to_text(in)) || goes_on(in, to_text(out)));
  out.from.assign(8, IpAddress{{0xfe, 0x80, 0x12, 0x34, 0x12, 0x34, 0x12, 0x34, 0x12, 0x34, 0x12, 0x34, 0x12,
                                0x34, 0x12, 0x34},
                               true});
  out.address = out.from[0];
  EXPECT_LE(to_text(out).size(), dds::max_bridge_text);
  EXPECT_FALSE(goes_on(out, "another version's"));
}

TEST(BridgeMark, IsNothingElse) {
  for (const char* text :
       {"", "out", "out,,", "up,10.0.0.2,4101.0001.8001", "out,10.0.0,4101.0001.8001",
        "out,10.0.0.2,4101.0001", "out,10.0.0.2,4101.1.8001", "out,10.0.0.2,4101.0001.800g"}) {
    EXPECT_EQ(parse_bridge_mark(text), std::nullopt) << text;
  }
}

}  // namespace
}  // namespace trestle::carry::loop_check_test
