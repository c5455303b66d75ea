// What a bridge does at its time beside its routes, in virtual time; and the clock that it has outside of
// tests.
#include <spdlog/spdlog.h>

#include "bridge/carry/runtime/conversion_log.hpp"
#include "bridge/carry/runtime/diagnostics.hpp"
#include "bridge/messages/values/cdr.hpp"
#include "test/bridge/carry/runtime/route_test.hpp"
#include "test/bridge/end_to_end/log_sink.hpp"

namespace trestle::test::time_test {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

class PublishersTest : public RouteTest {
 protected:
  PublishersTest() {
    watch_.add("rt/talk", "std_msgs::msg::dds_::String_", {},
               [this](const carry::PublishedQos& published) { told_.push_back(published.publishers); });
  }
  void publishers(std::size_t number) {
    dds_.found.assign(number, {.topic = "rt/talk", .type = "std_msgs::msg::dds_::String_"});
    watch_.changed();
  }

  carry::PublisherWatch watch_{clock_};
  std::vector<std::size_t> told_;
};

TEST_F(PublishersTest, AreLookedAtOnceWhenTheyChangeSeldom) {
  publishers(1);
  EXPECT_THAT(told_, IsEmpty()) << "DDS has not been joined";
  watch_.open(dds_);
  pass(50ms);
  publishers(2);
  pass(50ms);
  publishers(0);
  EXPECT_THAT(told_, ElementsAre(1, 2, 0));
}

TEST_F(PublishersTest, AreLookedAtEvery50MsWhenTheyChangeOften) {
  watch_.open(dds_);
  for (std::size_t i = 1; i <= 1000; ++i) {
    pass(1ms);
    publishers(i);
  }
  EXPECT_THAT(told_, SizeIs(1 + 1000 / 50));
  publishers(7);
  pass(50ms);
  EXPECT_EQ(told_.back(), 7U) << "the last change is not missed";
  EXPECT_EQ(clock_.armed(), 0);
}

TEST_F(PublishersTest, AreNotLookedAtOnceThatIsStopped) {
  watch_.open(dds_);
  publishers(1);
  watch_.stop();
  publishers(2);
  pass(1h);
  EXPECT_THAT(told_, ElementsAre(0));
}

class DiagnosticsTest : public RouteTest {
 protected:
  static carry::DiagnosticsSettings settings() {
    carry::DiagnosticsSettings result;
    result.period = 10s;
    return result;
  }
  [[nodiscard]] std::size_t published() const { return dds_.written.size(); }

  std::string message_ = "ready";
  carry::Diagnostics diagnostics_{
      clock_, dds_, settings(), "", [this] {
        return std::vector<carry::Diagnosis>{
            {.level = {}, .name = "it", .message = message_, .hardware_id = "", .values = {}}};
      }};
};

TEST_F(DiagnosticsTest, ArePublishedOnceAPeriod) {
  pass(10s - 1ns);
  EXPECT_EQ(published(), 0U);
  pass(1ns);
  EXPECT_EQ(published(), 1U);
  const auto seconds = std::chrono::floor<std::chrono::seconds>(clock_.since_1970()).count();
  messages::CdrWriter stamp{64};
  stamp.number(static_cast<std::uint32_t>(seconds));
  const Bytes begin = stamp.take();
  EXPECT_TRUE(std::equal(begin.begin(), begin.end(), dds_.written.front().begin()));
  pass(1min);
  EXPECT_EQ(published(), 7U);
}

TEST_F(DiagnosticsTest, TellSoonOfAChangeAndNotMoreOftenThanEvery100Ms) {
  diagnostics_.changed();
  pass(0ns);
  EXPECT_EQ(published(), 1U);
  for (int i = 0; i < 1000; ++i) {
    diagnostics_.changed();
    pass(1ms);
  }
  EXPECT_EQ(published(), 1U + 10U);
}

TEST_F(DiagnosticsTest, TellOfNothingWhenNothingHasChanged) {
  diagnostics_.changed();
  pass(1s);
  diagnostics_.asker()();
  pass(1s);
  EXPECT_EQ(published(), 1U);
  message_ = "not ready";
  diagnostics_.asker()();
  pass(1s);
  EXPECT_EQ(published(), 2U);
}

TEST(ConversionLogTest, TellsOncePerSecondAndHowManyItPassedOver) {
  const auto log = std::make_shared<LogSink>();
  const auto before = spdlog::default_logger();
  spdlog::set_default_logger(std::make_shared<spdlog::logger>("test", log));
  VirtualClock clock;
  carry::ConversionLog said{clock, "/talk"};
  said.tell("one");
  said.tell("two");
  clock.pass(1s - 1ns);
  said.tell("three");
  EXPECT_TRUE(log->has("/talk: one\n"));
  clock.pass(1ns);
  said.tell("four");
  spdlog::set_default_logger(before);
  EXPECT_TRUE(log->has("/talk: four (and 2 others before)"));
  EXPECT_FALSE(log->has("two"));
  EXPECT_FALSE(log->has("three"));
}

// Both have come when the first one is called back.
TEST(RouteClockTest, CallsNothingBackThatHasBeenCancelledOrSetAnewMeanwhile) {
  boost::asio::io_context io;
  const auto clock = carry::clock_of(io);
  std::vector<int> called;
  std::unique_ptr<carry::RouteTimer> cancelled = clock->timer([&] { called.push_back(1); });
  std::unique_ptr<carry::RouteTimer> gone = clock->timer([&] { called.push_back(2); });
  std::unique_ptr<carry::RouteTimer> later = clock->timer([&] { called.push_back(3); });
  const auto first = clock->timer([&] {
    cancelled->cancel();
    gone.reset();
    later->set(clock->now() + 1ms);
    called.push_back(0);
  });
  const auto now = clock->now();
  first->set(now - 3ms);
  for (const auto& one : {cancelled.get(), gone.get(), later.get()}) {
    one->set(now - 2ms);
    EXPECT_EQ(one->armed(), now - 2ms);
  }
  io.run();
  EXPECT_THAT(called, ElementsAre(0, 3));
  EXPECT_FALSE(later->armed());
}

TEST(RouteClockTest, LetsATimerEndItself) {
  boost::asio::io_context io;
  const auto clock = carry::clock_of(io);
  std::unique_ptr<carry::RouteTimer> timer;
  const auto word = std::make_shared<std::string>("still there");
  std::string seen;
  timer = clock->timer([&, word] {
    timer.reset();
    seen = *word;
  });
  timer->set(clock->now());
  io.run();
  EXPECT_EQ(seen, "still there");
}

}  // namespace
}  // namespace trestle::test::time_test
