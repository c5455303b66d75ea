#include "bridge/carry/runtime/call_shares.hpp"

#include <gtest/gtest.h>

namespace trestle::carry::call_shares_test {
namespace {

using namespace std::chrono_literals;

IpAddress host(int number) {
  return IpAddress::v4(10, 0, static_cast<std::uint8_t>(number / 250),
                       static_cast<std::uint8_t>(number % 250));
}

CallerKey participant(int number) {
  return dds::GuidPrefix{std::byte{1}, static_cast<std::byte>(number)};
}

class CallSharesTest : public testing::Test {
 protected:
  /// How many of so many calls may wait.
  std::size_t calls(const CallerKey& caller, std::size_t count) {
    std::size_t taken = 0;
    for (std::size_t i = 0; i < count; ++i) {
      taken += shares.take(caller, now) ? 1 : 0;
    }
    return taken;
  }
  void end(const CallerKey& caller, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      shares.give_back(caller);
    }
  }
  CallShares::TimePoint now{1h};
  CallShares shares{100};
};

TEST_F(CallSharesTest, LeaveAllPlacesToWhoIsAlone) {
  EXPECT_EQ(calls(host(1), 100), 100U);
}

TEST_F(CallSharesTest, KeepAShareForWhoHasCalledLately) {
  EXPECT_EQ(calls(host(2), 1), 1U);
  end(host(2), 1);
  now += 59s;
  EXPECT_EQ(calls(host(1), 1000), 50U);
  EXPECT_EQ(calls(host(2), 1000), 50U);
  EXPECT_EQ(calls(host(1), 1), 0U);
  end(host(2), 1);
  EXPECT_EQ(calls(host(1), 1), 0U) << "not the place of the other";
  EXPECT_EQ(calls(host(2), 1), 1U);
}

TEST_F(CallSharesTest, AreOfParticipantsAsOfAddresses) {
  EXPECT_EQ(calls(participant(2), 1), 1U);
  end(participant(2), 1);
  EXPECT_EQ(calls(participant(1), 1000), 50U);
  EXPECT_EQ(calls(participant(2), 1000), 50U);
}

TEST_F(CallSharesTest, CountACallThatFollowsOnAnother) {
  EXPECT_EQ(calls(host(2), 1), 1U);
  EXPECT_EQ(calls(host(1), 1000), 50U);
  end(host(1), 1);
  shares.take_over(host(1));
  EXPECT_EQ(calls(host(1), 1), 0U);
  end(host(1), 1);
  EXPECT_EQ(calls(host(1), 2), 1U);
}

TEST_F(CallSharesTest, ForgetWhoDoesNotCallAnyMore) {
  EXPECT_EQ(calls(host(2), 1), 1U);
  end(host(2), 1);
  now += 60s;
  EXPECT_EQ(calls(host(1), 100), 100U);
}

TEST_F(CallSharesTest, GiveWhoComesLateThePlacesThatBecomeFree) {
  EXPECT_EQ(calls(host(1), 100), 100U);
  std::size_t served = 0;
  for (int i = 0; i < 50; ++i) {  // one call ends at a time, and both want its place
    end(host(1), 1);
    EXPECT_EQ(calls(host(2), 1), 1U);
    served += calls(host(1), 10);
  }
  EXPECT_EQ(served, 0U);
}

// However many addresses call, or are made up: while there is room, nobody is kept to a share.
TEST_F(CallSharesTest, CountOnlyWhereMoreThanHalfOfThePlacesAreTaken) {
  for (int i = 0; i < 1000; ++i) {
    EXPECT_EQ(calls(host(100 + i), 1), 1U);
    end(host(100 + i), 1);
  }
  EXPECT_EQ(calls(host(1), 100), 50U);
  EXPECT_EQ(calls(host(2), 1), 1U) << "one place each, if there are any";
}

TEST_F(CallSharesTest, RememberABoundedNumberOfCallers) {
  CallShares many{10'000};
  for (int i = 0; i < 1000; ++i) {
    EXPECT_TRUE(many.take(host(i), now));
  }
  for (int i = 0; i < 1000; ++i) {
    many.give_back(host(i));
  }
  EXPECT_TRUE(many.take(host(1), now));
}

}  // namespace
}  // namespace trestle::carry::call_shares_test
