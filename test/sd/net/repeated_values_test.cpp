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
constexpr std::size_t large = 1'000'000;
IpAddress host(int number) {
  return IpAddress::v4(10, 0, static_cast<std::uint8_t>(number / 250),
                       static_cast<std::uint8_t>(number % 250));
}

TEST(RepeatedValues, GoToAnAddressSoManyTimesAndThenEveryTwoSeconds) {
  RepeatedValues values{4, seed};
  int sent = 0;
  for (Duration passed{}; passed < 10s; passed += 100ms) {  // a hundred Subscribes
    sent += values.take(host(1), offer, event, large, start + passed) ? 1 : 0;
  }
  EXPECT_EQ(sent, 4 + 4);
  EXPECT_FALSE(values.take(host(1), offer, event, large, start + 9'900ms));
  EXPECT_TRUE(values.take(host(1), offer, event, large, start + 100s));
}

TEST(RepeatedValues, GoMoreOftenInOneDatagramTheSmallerTheyAre) {
  const auto in_ten_seconds = [](std::size_t bytes) {
    RepeatedValues values{8, seed};
    int sent = 0;
    for (Duration passed{}; passed < 10s; passed += 1ms) {
      sent += values.take(host(1), offer, event, bytes, start + passed) ? 1 : 0;
    }
    return sent;
  };
  EXPECT_EQ(in_ten_seconds(1400), 40 + 24);
  EXPECT_GT(in_ten_seconds(4), 1000) << "a tester may subscribe to it again and again";
  EXPECT_EQ(in_ten_seconds(1401), 8 + 4);
}

TEST(RepeatedValues, AreCountedByAddressAndByValue) {
  RepeatedValues values{1, seed};
  EXPECT_TRUE(values.take(host(1), offer, event, large, start));
  EXPECT_FALSE(values.take(host(1), offer, event, large, start));
  EXPECT_TRUE(values.take(host(1), offer, MethodId{0x8002}, large, start));
  EXPECT_TRUE(values.take(host(1), OfferHandle{1, 1}, event, large, start));
  EXPECT_TRUE(values.take(host(2), offer, event, large, start));
}

TEST(RepeatedValues, AreNoMoreThoughOthersSubscribeMeanwhile) {
  RepeatedValues values{2, seed};
  int victim = 0;
  int others = 0;
  for (int i = 0; i < 10'000; ++i) {  // 129 others and the victim, in turn
    const TimePoint now = start + i * 1ms;
    if (i % 130 == 0) {
      victim += values.take(host(1), offer, event, large, now) ? 1 : 0;
    } else {
      others += values.take(host(1000 + i % 130), offer, event, large, now) ? 1 : 0;
    }
  }
  EXPECT_LE(victim, 2 + 5);
  EXPECT_LE(others, 129 * (2 + 5));
}

TEST(RepeatedValues, ReachNearlyEachOfManyThatComeOnce) {
  RepeatedValues values{8, seed};
  int reached = 0;
  for (int i = 0; i < 10'000; ++i) {
    reached += values.take(host(i), offer, event, large, start + i * 1ms) ? 1 : 0;
  }
  EXPECT_GE(reached, 9'990);
}

TEST(RepeatedValues, AreNeverSentWhereNoneMayBe) {
  RepeatedValues values{0, seed};
  EXPECT_FALSE(values.take(host(1), offer, event, large, start));
}

}  // namespace
}  // namespace trestle::sd::repeated_values_test
