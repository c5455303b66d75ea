#include <gmock/gmock.h>

#include <vector>

#include "sd/core/offer_schedule.hpp"
#include "sd/core/random.hpp"
#include "sd/core/reboot_detector.hpp"
#include "test/covers.hpp"

namespace trestle::sd::schedule_test {
namespace {
using namespace std::chrono_literals;
using test::covers;
using testing::ElementsAre;

constexpr TimePoint start{100s};

template <typename Schedule>
Schedule started(const Timing& timing, TimePoint first) {
  Schedule schedule;
  schedule.start(timing, first);
  return schedule;
}

// When messages are sent, from the start on, as long as the schedule has a deadline.
template <typename Schedule>
std::vector<std::chrono::milliseconds> send_times(Schedule& schedule, std::size_t count) {
  std::vector<std::chrono::milliseconds> times;
  while (times.size() < count && schedule.deadline() != never) {
    const TimePoint now = schedule.deadline();
    EXPECT_FALSE(schedule.on_time(now - 1ns));
    if (schedule.on_time(now)) {
      times.push_back(std::chrono::duration_cast<std::chrono::milliseconds>(now - start));
    }
  }
  return times;
}

TEST(OfferSchedule, DoublesTheWaitAfterEachRepetition) {
  covers({"feat_req_someipsd_62", "feat_req_someipsd_66", "feat_req_someipsd_67", "feat_req_someipsd_68",
          "feat_req_someipsd_73", "feat_req_someipsd_75", "feat_req_someipsd_76", "feat_req_someipsd_79",
          "feat_req_someipsd_80"});
  const Timing timing{.repetitions_base_delay = 30ms, .repetitions_max = 2, .cyclic_offer_delay = 1s};
  auto offers = started<OfferSchedule>(timing, start + 10ms);
  EXPECT_EQ(offers.phase(), Phase::initial_wait);
  // 10 ms initial wait, then 30 ms, then 2 x 30 ms, then the cyclic delay.
  EXPECT_THAT(send_times(offers, 5), ElementsAre(10ms, 40ms, 100ms, 1100ms, 2100ms));
  EXPECT_EQ(offers.phase(), Phase::main);
}

TEST(OfferSchedule, SkipsTheRepetitionPhaseWithoutRepetitions) {
  covers({"feat_req_someipsd_74"});
  auto offers = started<OfferSchedule>({.repetitions_max = 0, .cyclic_offer_delay = 1s}, start);
  EXPECT_THAT(send_times(offers, 3), ElementsAre(0ms, 1000ms, 2000ms));
}

TEST(OfferSchedule, EndsAfterTheRepetitionsWithoutACycle) {
  covers({"feat_req_someipsd_79"});
  auto offers = started<OfferSchedule>(
      {.repetitions_base_delay = 30ms, .repetitions_max = 1, .cyclic_offer_delay = 0s}, start);
  EXPECT_THAT(send_times(offers, 9), ElementsAre(0ms, 30ms));
  EXPECT_EQ(offers.phase(), Phase::main);
}

TEST(OfferSchedule, DoesNotCatchUpWithABurstAfterAStall) {
  covers({"feat_req_someipsd_81"});
  auto offers = started<OfferSchedule>({.repetitions_max = 0, .cyclic_offer_delay = 1s}, start);
  ASSERT_TRUE(offers.on_time(start));
  EXPECT_TRUE(offers.on_time(start + 10s));
  EXPECT_FALSE(offers.on_time(start + 10s));
  EXPECT_EQ(offers.deadline(), start + 11s);
}

TEST(OfferSchedule, SurvivesTheMostRepetitionsThereCanBe) {
  auto offers = started<OfferSchedule>({.repetitions_base_delay = 1h, .repetitions_max = 255}, start);
  EXPECT_EQ(send_times(offers, 300).size(), 300U);
}

TEST(OfferSchedule, IsSilentWhileDown) {
  OfferSchedule offers;
  EXPECT_EQ(offers.deadline(), never);
  EXPECT_FALSE(offers.on_time(start + 1000h));
}

TEST(FindSchedule, FallsSilentInTheMainPhase) {
  covers({"feat_req_someipsd_866", "feat_req_someipsd_73", "feat_req_someipsd_76"});
  auto finds = started<FindSchedule>({.repetitions_base_delay = 30ms, .repetitions_max = 3}, start + 10ms);
  EXPECT_THAT(send_times(finds, 9), ElementsAre(10ms, 40ms, 100ms, 220ms));
  EXPECT_EQ(finds.phase(), Phase::main);
}

TEST(FindSchedule, StopsWhenTheServiceIsFound) {
  covers({"feat_req_someipsd_867", "feat_req_someipsd_238"});
  auto finds = started<FindSchedule>({.repetitions_base_delay = 30ms, .repetitions_max = 3}, start);
  ASSERT_TRUE(finds.on_time(start));
  finds.found();
  EXPECT_EQ(finds.deadline(), never);
  EXPECT_EQ(finds.phase(), Phase::main);
}

TEST(FindSchedule, SendsAtLeastOneWhenThereMayBeMoreInstances) {
  covers({"feat_req_someipsd_239"});
  auto finds = started<FindSchedule>({.repetitions_base_delay = 30ms, .repetitions_max = 3}, start);
  finds.found_some();
  EXPECT_THAT(send_times(finds, 9), ElementsAre(0ms));
  auto later = started<FindSchedule>({.repetitions_base_delay = 30ms, .repetitions_max = 3}, start);
  ASSERT_TRUE(later.on_time(start));
  later.found_some();
  EXPECT_EQ(later.deadline(), never);
}

TEST(Random, StaysInItsBoundsAndReachesThem) {
  covers({"feat_req_someipsd_63", "feat_req_someipsd_64", "feat_req_someipsd_84", "feat_req_someipsd_85"});
  Random random{7};
  std::array<int, 3> hits{};
  for (int i = 0; i < 300; ++i) {
    const auto drawn = random.between(2ns, 4ns);
    ASSERT_GE(drawn, 2ns);
    ASSERT_LE(drawn, 4ns);
    ++hits.at(static_cast<std::size_t>((drawn - 2ns).count()));
  }
  EXPECT_THAT(hits, testing::Each(testing::Gt(60)));
  EXPECT_EQ(random.between(5ms, 5ms), 5ms);
  EXPECT_EQ(Random{7}.next(), Random{7}.next());
  EXPECT_NE(Random{7}.next(), Random{8}.next());
}

using Channel = RebootDetector::Channel;

struct Heard {
  std::uint16_t session;
  bool flag;
  bool reboot;
};

TEST(RebootDetector, FollowsBothRulesOfTheSpecification) {
  covers({"feat_req_someipsd_764", "feat_req_someipsd_863"});
  RebootDetector detector;
  for (const auto& [session, flag, reboot] : {
           Heard{5, true, false},        // the first ever: nothing to compare with
           Heard{6, true, false},        //
           Heard{9, true, false},        // some were lost
           Heard{9, true, true},         // not increasing, with the flag set
           Heard{3, true, true},         //
           Heard{0xffff, true, false},   //
           Heard{1, false, false},       // wrapped around
           Heard{0xffff, false, false},  //
           Heard{1, false, false},       // wrapped around again
           Heard{7, true, true},         // the flag came back, whatever the session
       }) {
    EXPECT_EQ(detector.shows_reboot(Channel::multicast, SessionId{session}, flag), reboot) << session;
    detector.observe(Channel::multicast, SessionId{session}, flag);
  }
}

TEST(RebootDetector, KeepsMulticastAndUnicastApart) {
  covers({"feat_req_someipsd_765", "feat_req_someipsd_813"});
  RebootDetector detector;
  detector.observe(Channel::multicast, SessionId{100}, true);
  EXPECT_FALSE(detector.shows_reboot(Channel::unicast, SessionId{1}, true));
  detector.observe(Channel::unicast, SessionId{1}, true);
  EXPECT_FALSE(detector.shows_reboot(Channel::multicast, SessionId{101}, true));
  EXPECT_TRUE(detector.shows_reboot(Channel::multicast, SessionId{100}, true));
}

TEST(RebootDetector, TakesOneRebootForOne) {
  RebootDetector detector;
  detector.observe(Channel::multicast, SessionId{100}, true);
  detector.observe(Channel::unicast, SessionId{50}, true);
  ASSERT_TRUE(detector.shows_reboot(Channel::multicast, SessionId{1}, true));
  detector.observe(Channel::multicast, SessionId{1}, true);
  // The unicast counter restarted with the same reboot.
  EXPECT_FALSE(detector.shows_reboot(Channel::unicast, SessionId{1}, true));
}

}  // namespace
}  // namespace trestle::sd::schedule_test
