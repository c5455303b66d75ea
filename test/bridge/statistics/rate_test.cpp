#include "bridge/statistics/rate.hpp"

#include <gmock/gmock.h>

namespace trestle::statistics {
namespace {

using namespace std::chrono_literals;

constexpr Rate::TimePoint start{1h};

/// Notes one of 100 bytes each `period`, until `end`.
void come(Rate& rate, Rate::TimePoint from, Rate::TimePoint end, std::chrono::nanoseconds period) {
  for (Rate::TimePoint now = from; now < end; now += period) {
    rate.note(now, 100);
  }
}

TEST(Rate, IsNoneAtFirstAndOfASingleOne) {
  Rate rate;
  EXPECT_EQ(rate.at(start).count, 0);
  rate.note(start, 100);
  EXPECT_EQ(rate.at(start).count, 0);
  EXPECT_EQ(rate.at(start + 1s).count, 0);
}

TEST(Rate, IsRightAtAnyTime) {
  for (const auto period : {1us * 500, 10'000us, 100'000us}) {
    for (const auto length : {2000ms, 3100ms, 7777ms, 60'050ms}) {
      Rate rate;
      come(rate, start, start + length, period);
      const double wanted = 1s / std::chrono::duration<double>{period};
      EXPECT_NEAR(rate.at(start + length).count, wanted, wanted * 0.03) << period.count() << length.count();
      EXPECT_NEAR(rate.at(start + length).bytes, wanted * 100, wanted * 3);
    }
  }
}

TEST(Rate, FollowsAChange) {
  Rate rate;
  come(rate, start, start + 10s, 1ms);
  come(rate, start + 10s, start + 15s, 100ms);
  EXPECT_NEAR(rate.at(start + 15s).count, 10, 0.5);
}

TEST(Rate, FallsToNoneWhenNothingComes) {
  Rate rate;
  come(rate, start, start + 10s, 10ms);
  EXPECT_LT(rate.at(start + 11s).count, 90);
  EXPECT_GT(rate.at(start + 11s).count, 0);
  EXPECT_EQ(rate.at(start + 14s).count, 0);
  rate.note(start + 60s, 100);
  EXPECT_EQ(rate.at(start + 61s).count, 0) << "what was long before does not count";
}

}  // namespace
}  // namespace trestle::statistics
