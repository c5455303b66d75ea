#include "sd/net/deadline_timer.hpp"

#include <gmock/gmock.h>

#include <boost/asio/post.hpp>
#include <memory>

namespace trestle::sd::deadline_timer_test {
namespace {

using namespace std::chrono_literals;

class DeadlineTimerTest : public testing::Test {
 protected:
  static TimePoint now() { return std::chrono::steady_clock::now(); }

  boost::asio::io_context io;
  int calls = 0;
  DeadlineTimer timer{io, [this] { ++calls; }};
};

TEST_F(DeadlineTimerTest, CallsOnceTheDeadlineHasCome) {
  const TimePoint soon = now() + 2ms;
  timer.arm(soon);
  EXPECT_EQ(timer.armed(), soon);
  io.run();
  EXPECT_GE(now(), soon);
  EXPECT_EQ(calls, 1);
  EXPECT_EQ(timer.armed(), std::nullopt);
}

TEST_F(DeadlineTimerTest, TakesANearerDeadline) {
  timer.arm(now() + 1h);
  timer.arm(now() + 1ms);
  io.run();  // the hour must not hold it up
  EXPECT_EQ(calls, 1);
}

TEST_F(DeadlineTimerTest, LeavesTheSystemsTimerWhenTheDeadlineMovesAway) {
  const TimePoint first = now() + 2ms;
  timer.arm(first);
  timer.arm(first + 1h);
  timer.arm(std::nullopt);
  timer.arm(first + 2h);
  timer.arm(first);
  EXPECT_EQ(timer.armed(), first);
  io.run();
  EXPECT_EQ(calls, 1);  // early, so that the owner arms it for what is left
}

TEST_F(DeadlineTimerTest, IsNotArmedByNothing) {
  timer.arm(std::nullopt);
  EXPECT_EQ(timer.armed(), std::nullopt);
  io.run();
  EXPECT_EQ(calls, 0);
}

TEST_F(DeadlineTimerTest, CanBeArmedAnewWhenCalled) {
  int again = 0;
  std::unique_ptr<DeadlineTimer> cyclic;
  cyclic = std::make_unique<DeadlineTimer>(io, [&] {
    if (++again < 3) {
      cyclic->arm(now() + 1ms);
    }
  });
  cyclic->arm(now());
  io.run();
  EXPECT_EQ(again, 3);
}

TEST_F(DeadlineTimerTest, IsSilentAndHoldsNothingUpOnceDestroyed) {
  auto other = std::make_unique<DeadlineTimer>(io, [this] { ++calls; });
  other->arm(now() + 1h);
  auto due = std::make_unique<DeadlineTimer>(io, [this] { ++calls; });
  due->arm(now());
  boost::asio::post(io, [&] {
    other.reset();
    due.reset();
  });
  io.run();
  EXPECT_EQ(calls, 0);
}

}  // namespace
}  // namespace trestle::sd::deadline_timer_test
