#include "bridge/conform/verdict.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trestle::conform::verdict_test {
namespace {

using testing::HasSubstr;

TEST(Verdict, StaysWhereNothingElseIsKnown) {
  for (const Verdict verdict : {Verdict::pass, Verdict::pass_nonstrict, Verdict::fail, Verdict::inconclusive,
                                Verdict::unsupported, Verdict::error}) {
    EXPECT_EQ(settled({.verdict = verdict}).verdict, verdict) << to_string(verdict);
  }
}

TEST(Verdict, IsInconclusiveWhenTheDeviceWasNotThereBefore) {
  EXPECT_EQ(settled({.verdict = Verdict::pass, .alive_before = false}).verdict, Verdict::inconclusive);
  EXPECT_EQ(settled({.verdict = Verdict::fail, .alive_before = false}).verdict, Verdict::inconclusive);
  EXPECT_EQ(settled({.verdict = Verdict::error, .alive_before = false}).verdict, Verdict::error);
}

TEST(Verdict, FailsWhenTheDeviceDoesNotSurvive) {
  const Attempt attempt = settled({.verdict = Verdict::pass, .alive_after = false});
  EXPECT_EQ(attempt.verdict, Verdict::fail);
  EXPECT_THAT(attempt.reason, HasSubstr("does not answer any more"));
}

TEST(Verdict, DoesNotBlameTheDeviceForAStallOfTheTester) {
  const Attempt failed = settled({.verdict = Verdict::fail, .reason = "no answer", .stalled = true});
  EXPECT_EQ(failed.verdict, Verdict::inconclusive);
  EXPECT_THAT(failed.reason, HasSubstr("no answer"));
  EXPECT_EQ(settled({.verdict = Verdict::pass, .alive_after = false, .stalled = true}).verdict,
            Verdict::inconclusive);
  // What came in spite of it came.
  EXPECT_EQ(settled({.verdict = Verdict::pass, .stalled = true}).verdict, Verdict::pass);
}

TEST(Verdict, IsNoPlainPassWhenTheDeviceHadToBeAskedAgainAndAgain) {
  // One datagram may get lost.
  EXPECT_EQ(settled({.retries = 1, .retried = "answered the 2nd of 3 requests"}).verdict, Verdict::pass);
  const Attempt often = settled({.retries = 2, .retried = "answered the 3rd of 3 requests"});
  EXPECT_EQ(often.verdict, Verdict::pass_nonstrict);
  EXPECT_EQ(often.reason, "it answered the 3rd of 3 requests; 2 messages were sent again");
  // Nothing is said of a device where the tester itself was late.
  EXPECT_EQ(settled({.retries = 2, .stalled = true}).verdict, Verdict::pass);
  EXPECT_EQ(settled({.verdict = Verdict::fail, .reason = "r", .retries = 2}).reason, "r");
}

TEST(Verdict, IsTriedAgainThreeTimesAtMostAndOnlyWhenInconclusive) {
  EXPECT_TRUE(try_again({.verdict = Verdict::inconclusive}, 1));
  EXPECT_TRUE(try_again({.verdict = Verdict::inconclusive}, 2));
  EXPECT_FALSE(try_again({.verdict = Verdict::inconclusive}, 3));
  EXPECT_FALSE(try_again({.verdict = Verdict::fail}, 1));
  EXPECT_FALSE(try_again({.verdict = Verdict::pass}, 1));
}

}  // namespace
}  // namespace trestle::conform::verdict_test
