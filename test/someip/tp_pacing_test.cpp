#include "someip/core/tp_pacing.hpp"

#include <gmock/gmock.h>

#include <vector>

#include "test/covers.hpp"

namespace trestle::someip::tp_pacing_test {
namespace {
using test::covers;
using testing::ElementsAre;
using namespace std::chrono_literals;

constexpr TimePoint start{1000s};

TEST(TpPacing, FillsAQuarterOfWhatTheReceiverTells) {
  covers({"feat_req_someiptp_801"});
  // Twice the bytes asked for are there, and a segment is charged 2304: 2 * 8 MiB / 4 / 2304.
  EXPECT_EQ(burst_into(8U << 20U), 1820U);
  EXPECT_EQ(burst_into(106'496), 23U);
  EXPECT_EQ(burst_into(330'000), 71U);
  EXPECT_EQ(burst_into(0), std::nullopt) << "nothing told";
  EXPECT_EQ(burst_into(212'991), 46U);
  EXPECT_EQ(burst_into(212'992), std::nullopt) << "46 each 500 us are less than who tells nothing gets";
  EXPECT_EQ(burst_into(1), 4U) << "however little is told";
  EXPECT_EQ(burst_into(1, 32), 32U);
  EXPECT_EQ(burst_into(0xffff'ffff), 4096U) << "whatever is told";
}

// What may leave at these times, if as much leaves each time.
std::vector<std::size_t> rooms(PaceWindow window, const TpPacing& pacing,
                               std::initializer_list<Duration> at) {
  std::vector<std::size_t> result;
  for (const Duration time : at) {
    result.push_back(window.room(pacing, start + time));
    window.sent(result.back());
  }
  return result;
}

TEST(PaceWindow, LetsABurstLeaveInEachSeparation) {
  covers({"feat_req_someiptp_801"});
  const TpPacing pacing{.burst = 10, .separation = 500us};
  EXPECT_THAT(rooms({}, pacing, {0us, 1us, 499us, 500us, 999us, 1000us}), ElementsAre(10, 0, 0, 10, 0, 10));
}

TEST(PaceWindow, LetsPiecesLeaveForAReceiverThatDoesNotTell) {
  covers({"feat_req_someiptp_801"});
  EXPECT_THAT(rooms({}, {}, {0us, 99us, 100us, 199us, 200us, 300us}), ElementsAre(48, 0, 0, 0, 11, 11));
  EXPECT_THAT(rooms({}, {.separation = 1ms}, {0us, 399us, 400us, 600us}), ElementsAre(48, 0, 11, 11));
  // A late timer costs nothing, and no time earns more than the first burst.
  EXPECT_THAT(rooms({}, {}, {0us, 260us, 300us, 490us, 500us}), ElementsAre(48, 11, 11, 11, 11));
  EXPECT_THAT(rooms({}, {}, {0us, 399us, 400us}), ElementsAre(48, 22, 11));
  EXPECT_THAT(rooms({}, {}, {0us, 1s, 1s + 199us, 1s + 300us}), ElementsAre(48, 48, 0, 22));
  // The first burst may leave in parts.
  PaceWindow parts;
  EXPECT_EQ(parts.room({}, start), 48U);
  parts.sent(46);
  EXPECT_EQ(parts.room({}, start), 2U);
  parts.sent(2);
  EXPECT_EQ(parts.room({}, start + 100us), 0U);
  EXPECT_EQ(parts.room({}, start + 200us), 11U);
  // Behind a message with a larger burst it waits as after its own.
  PaceWindow window;
  window.sent(window.room({.burst = 1000}, start));
  EXPECT_EQ(window.room({}, start + 100us), 0U);
  EXPECT_EQ(window.room({}, start + 200us), 11U);
}

TEST(TpPacing, TakesTheLesserOfTwoBursts) {
  EXPECT_EQ(lesser_burst(30, 40), 30U);
  EXPECT_EQ(lesser_burst(40, 30), 30U);
  EXPECT_EQ(lesser_burst(32, std::nullopt), 32U);
  EXPECT_EQ(lesser_burst(std::nullopt, 32), 32U);
  EXPECT_EQ(lesser_burst(1820, std::nullopt), std::nullopt);
  EXPECT_EQ(lesser_burst(std::nullopt, std::nullopt), std::nullopt);
}

TEST(PaceWindow, DoesNotSlowTheStreamDownWhenATimerIsLate) {
  EXPECT_THAT(rooms({}, {.burst = 10, .separation = 500us}, {0us, 560us, 999us, 1000us}),
              ElementsAre(10, 10, 0, 10));
}

TEST(PaceWindow, DoesNotMakeUpForAPause) {
  EXPECT_THAT(rooms({}, {.burst = 10, .separation = 500us}, {0us, 10ms, 10ms + 1us, 10ms + 499us}),
              ElementsAre(10, 10, 0, 0));
}

TEST(PaceWindow, CountsWhatLeavesInBetween) {
  const TpPacing pacing{.burst = 10, .separation = 500us};
  PaceWindow window;
  EXPECT_EQ(window.room(pacing, start), 10U);
  window.sent(4);
  EXPECT_EQ(window.room(pacing, start + 100us), 6U);
  window.sent(6);
  EXPECT_EQ(window.room(pacing, start + 200us), 0U);
  EXPECT_EQ(window.resume(pacing), start + 500us);
  // Another message may have another burst, and finds the window as it is.
  EXPECT_EQ(window.room({.burst = 12, .separation = 500us}, start + 200us), 2U);
  EXPECT_EQ(window.room({.burst = 1, .separation = 500us}, start + 200us), 0U);
}

TEST(PaceWindow, HasNoPausesWithoutSeparation) {
  EXPECT_THAT(rooms({}, {.burst = 10, .separation = 0us}, {0us, 0us, 0us}), ElementsAre(10, 10, 10));
}

TEST(PaceWindow, WaitsForeverIfToldSo) {
  const TpPacing pacing{.burst = 1, .separation = Duration::max()};
  PaceWindow window;
  window.sent(window.room(pacing, start));
  EXPECT_EQ(window.room(pacing, start + 24h), 0U);
  EXPECT_EQ(window.resume(pacing), TimePoint::max());
  // Also behind a message that was told otherwise.
  PaceWindow used;
  used.sent(used.room({.burst = 1, .separation = 1ms}, start));
  EXPECT_EQ(used.resume(pacing), TimePoint::max());
  EXPECT_EQ(used.room(pacing, start + 24h), 0U);
}

// A receiver as Linux has it: twice the bytes asked for, 2304 of them charged for each segment. What is read
// is given back only when that makes a quarter of the whole, or nothing is left.
class Receiver {
 public:
  /// @param reads  a segment in this time.
  Receiver(std::size_t asked_bytes, Duration reads) : room_{2 * asked_bytes}, reads_{reads} {}
  /// One that has asked for nothing.
  static Receiver untuned(Duration reads) { return {212'992 / 2, reads}; }

  void arrive(std::size_t segments, TimePoint now) {
    read_until(now);
    if (waiting_ == 0) {
      next_read_ = now + reads_;
    }
    for (; segments > 0; --segments) {
      if (charged_ + 2304 > room_) {
        ++lost;
      } else {
        charged_ += 2304;
        ++waiting_;
      }
    }
  }

  std::size_t lost = 0;

 private:
  void read_until(TimePoint now) {
    for (; waiting_ > 0 && next_read_ <= now; next_read_ += reads_) {
      --waiting_;
      unreturned_ += 2304;
      if (unreturned_ > room_ / 4 || waiting_ == 0) {
        charged_ -= unreturned_;
        unreturned_ = 0;
      }
    }
  }

  std::size_t room_;
  Duration reads_;
  TimePoint next_read_{};
  std::size_t waiting_ = 0;
  std::size_t charged_ = 0;
  std::size_t unreturned_ = 0;
};

struct Sent {
  std::size_t lost = 0;
  std::size_t largest_burst = 0;
  Duration time{};
};

// So many messages of so many segments, one behind the other.
Sent send(Receiver receiver, const TpPacing& pacing, std::size_t messages, std::size_t segments) {
  PaceWindow window;
  Sent result;
  TimePoint now = start;
  for (std::size_t left = messages * segments; left > 0;) {
    const std::size_t burst = std::min(window.room(pacing, now), left);
    if (burst == 0) {
      now = window.resume(pacing) + 60us;  // which a timer is late
      continue;
    }
    receiver.arrive(burst, now);
    window.sent(burst);
    left -= burst;
    result.largest_burst = std::max(result.largest_burst, burst);
  }
  result.lost = receiver.lost;
  result.time = now - start;
  return result;
}

// By a sender that knows `told` bytes.
Sent send(Receiver receiver, std::size_t told, std::size_t messages, std::size_t segments) {
  return send(receiver, TpPacing{.burst = burst_into(told)}, messages, segments);
}

TEST(TpPacing, LosesNothingAtASlowReceiverWithASmallBuffer) {
  covers({"feat_req_someiptp_801"});
  // 64 KB, 14 segments each 500 us, and a reader that needs 30 us for each: 100 messages of 100 KB.
  const Sent paced = send({65'536, 30us}, 65'536, 100, 72);
  EXPECT_EQ(paced.lost, 0U);
  EXPECT_EQ(paced.largest_burst, 14U);
  // The same receiver, if it does not tell: that is more than it can take.
  EXPECT_GT(send({65'536, 30us}, 0, 100, 72).lost, 1000U);
}

TEST(TpPacing, LosesNothingAtAReceiverThatNobodyTuned) {
  covers({"feat_req_someiptp_801"});
  // It reads 160 MB/s: 1000 messages of 1 MB, and 250 of 4 MB.
  EXPECT_EQ(send(Receiver::untuned(8700ns), 0, 1000, 754).lost, 0U);
  EXPECT_EQ(send(Receiver::untuned(8700ns), 0, 250, 3014).lost, 0U);
  EXPECT_GT(send(Receiver::untuned(9500ns), 0, 250, 3014).lost, 0U) << "146 MB/s are less than are sent";
  EXPECT_LT(send(Receiver::untuned(8700ns), 0, 1, 754).time, 6700us);
  EXPECT_LT(send(Receiver::untuned(8700ns), 0, 1, 3014).time, 27'200us);
}

TEST(TpPacing, SendsLargeBurstsToAReceiverWithALargeBuffer) {
  // 8 MiB; a message of 1 MB leaves at once, and ten of 4 MB fast.
  EXPECT_EQ(send({8U << 20U, 200ns}, 8U << 20U, 1, 754).time, 0us);
  const Sent large = send({8U << 20U, 200ns}, 8U << 20U, 10, 3014);
  EXPECT_EQ(large.lost, 0U);
  EXPECT_EQ(large.largest_burst, 1820U);
  EXPECT_LT(large.time, 10ms);
  // If it does not tell, they take a fifth of a second.
  EXPECT_GT(send({8U << 20U, 200ns}, 0, 10, 3014).time, 200ms);
}

}  // namespace
}  // namespace trestle::someip::tp_pacing_test
