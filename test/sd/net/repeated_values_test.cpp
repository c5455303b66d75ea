#include "sd/net/unproven_receivers.hpp"

#include <gtest/gtest.h>

namespace trestle::sd::repeated_values_test {
namespace {

using someip::MethodId;
using namespace std::chrono_literals;

constexpr TimePoint start{100s};
constexpr MethodId event{0x8001};
constexpr OfferHandle offer{0, 1};
constexpr std::uint32_t seed = 7;
IpAddress host(int number) {
  return IpAddress::v4(10, 0, static_cast<std::uint8_t>(number / 250),
                       static_cast<std::uint8_t>(number % 250));
}

TEST(RepeatedValues, GoToAnAddressSoManyTimesAndThenEveryTwoSeconds) {
  RepeatedValues values{4, seed};
  int sent = 0;
  for (Duration passed{}; passed < 10s; passed += 100ms) {  // a hundred Subscribes
    sent += values.take(host(1), offer, event, start + passed) ? 1 : 0;
  }
  EXPECT_EQ(sent, 4 + 4);
  EXPECT_FALSE(values.take(host(1), offer, event, start + 9'900ms));
  EXPECT_TRUE(values.take(host(1), offer, event, start + 100s));
}

TEST(RepeatedValues, AreCountedByAddressAndByValue) {
  RepeatedValues values{1, seed};
  EXPECT_TRUE(values.take(host(1), offer, event, start));
  EXPECT_FALSE(values.take(host(1), offer, event, start));
  EXPECT_TRUE(values.take(host(1), offer, MethodId{0x8002}, start));
  EXPECT_TRUE(values.take(host(1), OfferHandle{1, 1}, event, start));
  EXPECT_TRUE(values.take(host(2), offer, event, start));
}

TEST(RepeatedValues, AreNoMoreThoughOthersSubscribeMeanwhile) {
  RepeatedValues values{2, seed};
  int victim = 0;
  int others = 0;
  for (int i = 0; i < 10'000; ++i) {  // 129 others and the victim, in turn
    const TimePoint now = start + i * 1ms;
    if (i % 130 == 0) {
      victim += values.take(host(1), offer, event, now) ? 1 : 0;
    } else {
      others += values.take(host(1000 + i % 130), offer, event, now) ? 1 : 0;
    }
  }
  EXPECT_LE(victim, 2 + 5);
  EXPECT_LE(others, 129 * (2 + 5));
}

TEST(RepeatedValues, ReachNearlyEachOfManyThatComeOnce) {
  RepeatedValues values{8, seed};
  int reached = 0;
  for (int i = 0; i < 10'000; ++i) {
    reached += values.take(host(i), offer, event, start + i * 1ms) ? 1 : 0;
  }
  EXPECT_GE(reached, 9'990);
}

TEST(RepeatedValues, AreNeverSentWhereNoneMayBe) {
  RepeatedValues values{0, seed};
  EXPECT_FALSE(values.take(host(1), offer, event, start));
}

}  // namespace
}  // namespace trestle::sd::repeated_values_test
