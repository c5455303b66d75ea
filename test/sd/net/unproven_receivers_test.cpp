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
  UnprovenReceivers receivers{10'000, 1000};
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

TEST(UnprovenReceivers, GetNoMoreByBeingForgotten) {
  UnprovenReceivers receivers{10'000, 1};
  for (std::uint8_t i = 1; i <= 64; ++i) {
    EXPECT_TRUE(receivers.take(host(i), 9'000, start));
  }
  std::size_t bytes = 0;
  for (std::uint8_t i = 1; i <= 200; ++i) {
    bytes += receivers.take(host(i), 1000, start) ? 1000 : 0;
  }
  EXPECT_LE(bytes, 64'000U);
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
