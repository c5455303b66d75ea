#include "sd/net/unproven_receivers.hpp"

#include <gtest/gtest.h>

#include "test/loopback.hpp"

namespace trestle::sd::unproven_receivers_test {
namespace {

using namespace std::chrono_literals;

const TimePoint start{1h};
IpAddress host(std::uint8_t number) {
  return IpAddress::v4(192, 0, 2, number);
}

TEST(UnprovenReceivers, GetWhatFitsIntoTheirBudget) {
  UnprovenReceivers receivers{10'000, 1000, 1};
  EXPECT_FALSE(receivers.take(host(1), 10'001, start)) << "however long it waits";
  EXPECT_TRUE(receivers.take(host(1), 10'000, start));
  EXPECT_FALSE(receivers.take(host(1), 1, start));
  EXPECT_TRUE(receivers.take(host(2), 10'000, start)) << "each has its own";
  EXPECT_FALSE(receivers.take(host(1), 2001, start + 2s));
  EXPECT_TRUE(receivers.take(host(1), 2000, start + 2s));
  EXPECT_FALSE(receivers.take(host(1), 1, start + 2s));
  EXPECT_FALSE(receivers.take(host(1), 10'001, start + 1h)) << "it does not grow beyond";
  EXPECT_TRUE(receivers.take(host(1), 10'000, start + 1h));
}

TEST(UnprovenReceivers, GetNoMoreThoughManyOthersAsk) {
  UnprovenReceivers receivers{10'000, 1, 7};
  std::size_t bytes = 0;
  for (int i = 0; i < 10'000; ++i) {
    EXPECT_FALSE(receivers.take(IpAddress::v4(10, 1, 0, 1), 10'001, start));
    (void)receivers.take(
        IpAddress::v4(10, 0, static_cast<std::uint8_t>(i / 250), static_cast<std::uint8_t>(i % 250)), 9'000,
        start);
    bytes += receivers.take(host(1), 1000, start) ? 1000 : 0;
  }
  EXPECT_LE(bytes, 10'000U);
}

TEST(UnprovenReceivers, LoseLittleToManyOthers) {
  UnprovenReceivers receivers{10'000, 1, 7};
  for (int i = 0; i < 200; ++i) {  // in the names of others
    (void)receivers.take(IpAddress::v4(10, 0, 0, static_cast<std::uint8_t>(i)), 10'000, start);
  }
  EXPECT_TRUE(receivers.take(host(1), 10'000, start));
}

TEST(UnprovenReceivers, AreNotOfThisHost) {
  const IpAddress own = host(7);
  EXPECT_TRUE(is_of_this_host(IpAddress::v4(127, 1, 2, 3), own));
  EXPECT_TRUE(is_of_this_host(own, own));
  EXPECT_FALSE(is_of_this_host(host(8), own));
  IpAddress address{.bytes = {}, .v6 = true};
  EXPECT_FALSE(is_of_this_host(address, own));
  address.bytes[15] = 1;
  EXPECT_TRUE(is_of_this_host(address, own));
  address.bytes[0] = 0xfd;
  EXPECT_FALSE(is_of_this_host(address, address)) << "Linux takes these from a network";
}

}  // namespace
}  // namespace trestle::sd::unproven_receivers_test
