#include "bridge/conform/parallel.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <stdexcept>

#include "someip/net/address_text.hpp"

namespace trestle::conform::parallel_test {
namespace {

Profile on_loopback() {
  Profile profile{.device = IpAddress::v4(127, 0, 77, 1),
                  .tester = IpAddress::v4(127, 0, 77, 2),
                  .multicast = IpAddress::v4(239, 255, 77, 1),
                  .lifecycle = {.start = "device {device} {multicast} {event_multicast}"}};
  profile.services.push_back({.service = someip::ServiceId{1}, .udp_port = std::uint16_t{30501}});
  profile.services.front().eventgroups.push_back(
      {.id = someip::EventgroupId{1}, .multicast = Endpoint{IpAddress::v4(239, 255, 77, 2), 30511}});
  return profile;
}

TEST(Neighbours, HaveAddressesAndGroupsOfTheirOwn) {
  const auto other = beside(on_loopback(), 64, 3);
  ASSERT_TRUE(other);
  EXPECT_EQ(someip::to_string(other->tester), "127.64.3.2");
  EXPECT_EQ(filled_in(other->lifecycle.start, *other, ""), "device 127.64.3.1 239.64.3.1 239.64.3.2");
  EXPECT_EQ(neighbours(on_loopback(), 5).size(), 5U);
  EXPECT_EQ(neighbours(on_loopback(), 1).front().device, on_loopback().device);
}

TEST(Neighbours, AreOnlyThoseOfADeviceThatIsStartedOnLoopback) {
  Profile elsewhere = on_loopback();
  elsewhere.tester = IpAddress::v4(192, 0, 2, 1);
  EXPECT_FALSE(beside(elsewhere, 64, 1));
  EXPECT_EQ(neighbours(elsewhere, 5).size(), 1U);
  // Over IPv6, where this host has addresses for them.
  elsewhere.device = *someip::parse_address("2001:db8::1");
  elsewhere.tester = *someip::parse_address("2001:db8::2");
  EXPECT_FALSE(beside(elsewhere, 64, 1));
  Profile runs_already = on_loopback();
  runs_already.lifecycle.start.clear();
  EXPECT_FALSE(beside(runs_already, 64, 1));
  Profile restarts_one = on_loopback();
  restarts_one.lifecycle.restart = "restart";
  EXPECT_FALSE(beside(restarts_one, 64, 1));
}

TEST(SharedWork, IsDoneOnceEach) {
  std::array<std::atomic<int>, 50> done{};
  share_work(4, done.size(), [&](unsigned worker, std::size_t index) {
    EXPECT_LT(worker, 4U);
    ++done.at(index);
  });
  for (const auto& one : done) {
    EXPECT_EQ(one, 1);
  }
}

TEST(SharedWork, EndsWithTheFirstProblem) {
  std::atomic<int> done{0};
  EXPECT_THROW(share_work(1, 10,
                          [&](unsigned, std::size_t index) {
                            if (index == 3) {
                              throw std::runtime_error{"no"};
                            }
                            ++done;
                          }),
               std::runtime_error);
  EXPECT_EQ(done, 3);
}

}  // namespace
}  // namespace trestle::conform::parallel_test
