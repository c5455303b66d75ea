// Events that the Enhanced Testability Service is told to send, with virtual time.
#include "examples/ets/schedule.hpp"

#include <gmock/gmock.h>

#include <vector>

#include "test/bytes.hpp"

namespace ets {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using trestle::test::hex;

constexpr TimePoint start{1h};
constexpr const Trigger& one = triggers[0];
constexpr const Trigger& other = triggers[1];

/// When events are sent, from one deadline to the next.
std::vector<std::chrono::milliseconds> sending_times(Schedule& schedule, std::size_t most = 10) {
  std::vector<std::chrono::milliseconds> times;
  while (times.size() < most) {
    const auto due = schedule.deadline();
    if (!due) {
      break;
    }
    while (schedule.next(*due) != nullptr) {
      times.push_back(std::chrono::duration_cast<std::chrono::milliseconds>(*due - start));
    }
  }
  return times;
}

TEST(TestabilitySchedule, SendsOnceAndAtOnceWithoutParameters) {
  Schedule schedule;
  EXPECT_EQ(schedule.next(start), nullptr);
  EXPECT_EQ(schedule.deadline(), std::nullopt);
  schedule.trigger(one, {}, start);
  EXPECT_EQ(schedule.deadline(), start);
  EXPECT_EQ(schedule.next(start), &one);
  EXPECT_EQ(schedule.next(start), nullptr);
  EXPECT_EQ(schedule.deadline(), std::nullopt);
}

TEST(TestabilitySchedule, TakesHalfOfTheParametersForNone) {
  Schedule schedule;
  schedule.trigger(one, hex("00000064 000000"), start);
  EXPECT_THAT(sending_times(schedule), ElementsAre(0ms));
}

TEST(TestabilitySchedule, WaitsAndRepeats) {
  Schedule schedule;
  schedule.trigger(one, hex("00000064 0000001e 0000000a"), start);  // 100 ms, for 30 ms, each 10 ms
  EXPECT_EQ(schedule.next(start + 99ms), nullptr);
  EXPECT_THAT(sending_times(schedule), ElementsAre(100ms, 110ms, 120ms));
}

TEST(TestabilitySchedule, PausesForAMillisecondAtLeast) {
  Schedule schedule;
  schedule.trigger(one, hex("00000000 ffffffff 00000000"), start);
  EXPECT_THAT(sending_times(schedule, 3), ElementsAre(0ms, 1ms, 2ms));
}

TEST(TestabilitySchedule, DoesNotCatchUpWithABurstAfterAStall) {
  Schedule schedule;
  schedule.trigger(one, hex("00000000 000003e8 0000000a"), start);
  EXPECT_EQ(schedule.next(start), &one);
  EXPECT_EQ(schedule.next(start + 500ms), &one);
  EXPECT_EQ(schedule.next(start + 500ms), nullptr);
  EXPECT_EQ(schedule.deadline(), start + 510ms);
}

TEST(TestabilitySchedule, GoesOnWithSeveralBesideEachOther) {
  Schedule schedule;
  schedule.trigger(one, hex("00000014 00000000 00000000"), start);
  schedule.trigger(other, hex("0000000a 00000000 00000000"), start);
  EXPECT_EQ(schedule.deadline(), start + 10ms);
  EXPECT_EQ(schedule.next(start + 10ms), &other);
  EXPECT_EQ(schedule.next(start + 10ms), nullptr);
  EXPECT_EQ(schedule.next(start + 20ms), &one);
  EXPECT_EQ(schedule.deadline(), std::nullopt);
}

TEST(TestabilitySchedule, LetsTheFirstGiveWayWhenThereAreTooMany) {
  Schedule schedule;
  schedule.trigger(one, hex("00000001 00000000 00000000"), start);
  for (std::size_t count = 0; count < Schedule::places; ++count) {
    schedule.trigger(other, hex("00000002 00000000 00000000"), start);
  }
  EXPECT_EQ(schedule.next(start + 1ms), nullptr);
  EXPECT_EQ(sending_times(schedule).size(), Schedule::places);
}

}  // namespace
}  // namespace ets
