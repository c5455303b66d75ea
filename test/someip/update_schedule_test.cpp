#include "someip/core/update_schedule.hpp"

#include <gtest/gtest.h>

#include "test/covers.hpp"

namespace trestle::someip::update_schedule_test {
namespace {

using namespace std::chrono_literals;
using test::covers;

constexpr TimePoint start{1000s};

TEST(UpdateSchedule, SendsOnChangeOnly) {
  covers({"feat_req_someip_635"});
  UpdateSchedule schedule{{}};
  EXPECT_TRUE(schedule.on_value(true, start));
  EXPECT_FALSE(schedule.on_value(false, start + 1s)) << "the same again, or no more than epsilon away";
  EXPECT_TRUE(schedule.on_value(true, start + 1s));
  EXPECT_EQ(schedule.deadline(), std::nullopt);
  EXPECT_FALSE(schedule.on_time(start + 100s)) << "never by itself";
}

TEST(UpdateSchedule, SendsInACycleThatChangesDoNotDisturb) {
  covers({"feat_req_someip_635"});
  UpdateSchedule schedule{{.on_change = false, .cycle = 100ms}};
  EXPECT_FALSE(schedule.on_time(start)) << "there is no value yet";
  EXPECT_EQ(schedule.deadline(), std::nullopt);
  EXPECT_TRUE(schedule.on_value(true, start)) << "the first value begins the cycle";
  EXPECT_EQ(schedule.deadline(), start + 100ms);
  EXPECT_FALSE(schedule.on_value(true, start + 30ms)) << "waits for its turn";
  EXPECT_FALSE(schedule.on_time(start + 99ms));
  EXPECT_TRUE(schedule.on_time(start + 100ms));
  EXPECT_FALSE(schedule.on_time(start + 100ms)) << "once";
  EXPECT_TRUE(schedule.on_time(start + 200ms)) << "changed or not";
}

TEST(UpdateSchedule, SendsInACycleAndOnChange) {
  UpdateSchedule schedule{{.on_change = true, .cycle = 100ms}};
  EXPECT_TRUE(schedule.on_value(true, start));
  EXPECT_TRUE(schedule.on_value(true, start + 30ms));
  EXPECT_FALSE(schedule.on_value(false, start + 40ms));
  EXPECT_EQ(schedule.deadline(), start + 100ms);
}

TEST(UpdateSchedule, KeepsItsIntervalAfterALateTimerAndDoesNotCatchUp) {
  UpdateSchedule schedule{{.on_change = false, .cycle = 100ms}};
  EXPECT_TRUE(schedule.on_value(true, start));
  EXPECT_TRUE(schedule.on_time(start + 107ms));
  EXPECT_EQ(schedule.deadline(), start + 200ms);
  EXPECT_TRUE(schedule.on_time(start + 1050ms)) << "after a stall";
  EXPECT_FALSE(schedule.on_time(start + 1050ms));
  EXPECT_EQ(schedule.deadline(), start + 1100ms);
  EXPECT_TRUE(schedule.on_time(start + 1100ms));
  EXPECT_EQ(schedule.deadline(), start + 1200ms);
}

TEST(UpdateSchedule, SendsNothingByItselfWithoutAnyRule) {
  UpdateSchedule schedule{{.on_change = false}};
  EXPECT_FALSE(schedule.on_value(true, start));
  EXPECT_FALSE(schedule.on_time(start + 1s));
}

}  // namespace
}  // namespace trestle::someip::update_schedule_test
