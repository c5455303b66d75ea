#include "someip/core/session_counter.hpp"

#include "test/covers.hpp"

namespace trestle::someip::session_counter_test {
namespace {
using test::covers;

TEST(SessionCounter, StartsAtOneAndCountsUp) {
  covers({"feat_req_someip_649", "feat_req_someip_88"});
  SessionCounter sessions;
  EXPECT_EQ(sessions.next(), SessionId{1});
  EXPECT_EQ(sessions.next(), SessionId{2});
  EXPECT_EQ(sessions.next(), SessionId{3});
  EXPECT_FALSE(sessions.wrapped());
}

TEST(SessionCounter, WrapsToOneAndNeverGivesZero) {
  covers({"feat_req_someip_677"});
  SessionCounter sessions;
  for (std::uint32_t expected = 1; expected <= 0xffff; ++expected) {
    ASSERT_EQ(value(sessions.next()), expected);
  }
  EXPECT_EQ(sessions.next(), SessionId{1});
  EXPECT_EQ(sessions.next(), SessionId{2});
}

TEST(SessionCounter, HasWrappedFromTheSecondOneOnForGood) {
  covers({"feat_req_someipsd_41"});
  SessionCounter sessions{SessionId{0xfffe}};
  EXPECT_EQ(sessions.next(), SessionId{0xfffe});
  EXPECT_FALSE(sessions.wrapped());
  EXPECT_EQ(sessions.next(), SessionId{0xffff});
  EXPECT_FALSE(sessions.wrapped());
  EXPECT_EQ(sessions.next(), SessionId{1});
  EXPECT_TRUE(sessions.wrapped());
  EXPECT_EQ(sessions.next(), SessionId{2});
  EXPECT_TRUE(sessions.wrapped());
}

}  // namespace
}  // namespace trestle::someip::session_counter_test
