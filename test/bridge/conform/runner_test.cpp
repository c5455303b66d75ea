#include "bridge/conform/runner.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <set>
#include <thread>
#include <utility>

#include "bridge/conform/trial.hpp"
#include "test/bridge/conform/small_device.hpp"

namespace trestle::conform::runner_test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

using namespace small_device;

Profile profile() {
  return {.name = "D",
          .device = host(1),
          .tester = host(2),
          .multicast = group_of_test,
          .services = {{.service = someip::ServiceId{1},
                        .instance = someip::InstanceId{1},
                        .udp_port = std::uint16_t{30501}}}};
}

Case waiting(std::chrono::milliseconds budget) {
  return {.id = "a.waits",
          .title = "waits",
          .requirements = {"feat_req_someip_45"},
          .budget = budget,
          .run = [](Trial& t) { t.tester.receive(1min, [] { return false; }); }};
}

RunOptions options() {
  return {.folder = testing::TempDir(), .keep_evidence = false};
}

TEST(Runner, EndsACaseThatIsOverItsBudget) {
  const SmallDevice device{SmallDevice::offer(someip::InstanceId{1}), SmallDevice::Way::answers};
  const Case endless = waiting(50ms);
  const RunResult result = run_cases(profile(), {&endless}, options());
  ASSERT_EQ(result.cases.size(), 1U);
  // Whoever is slow, nothing is said of the device, and the runner is all right.
  EXPECT_EQ(result.cases[0].outcome.verdict, Verdict::inconclusive);
  EXPECT_EQ(result.cases[0].attempts, max_attempts);
  EXPECT_THAT(result.cases[0].outcome.reason, HasSubstr("not over after 0.1 s"));
  EXPECT_LT(result.took, 50s);
}

TEST(Runner, KeepsAFailureThatWasNotedBeforeTheBudgetWasOver) {
  const SmallDevice device{SmallDevice::offer(someip::InstanceId{1}), SmallDevice::Way::answers};
  Case endless = waiting(50ms);
  endless.run = [](Trial& t) {
    t.different("TTL", "3", "4", nullptr);
    t.tester.receive(1min, [] { return false; });
  };
  const RunResult result = run_cases(profile(), {&endless}, options());
  ASSERT_EQ(result.cases.size(), 1U);
  const Attempt& outcome = result.cases[0].outcome;
  EXPECT_EQ(outcome.verdict, outcome.stalled ? Verdict::inconclusive : Verdict::fail);
  EXPECT_THAT(outcome.reason, HasSubstr("TTL is 4, expected 3"));
}

TEST(Runner, TriesAgainWhatFailedWhileTheTesterStoodStill) {
  const SmallDevice device{SmallDevice::offer(someip::InstanceId{1}), SmallDevice::Way::answers};
  // Within a wait, and between two things that the case does.
  for (const bool within : {true, false}) {
    int attempts = 0;
    Case fails = waiting(30s);
    fails.run = [&](Trial& t) {
      t.send_sd({.entries = {Trial::find_entry(t.profile.service())}});
      const bool late = ++attempts == 1;
      bool stood_still = !late;
      const auto stand_still = [&] {
        if (!std::exchange(stood_still, true)) {
          std::this_thread::sleep_for(300ms);
        }
        return false;
      };
      if (!within) {
        stand_still();
      }
      t.tester.receive(within ? 200ms : 1ms, stand_still);
      if (late) {
        t.fail("too late", "an answer", "none", nullptr);
      }
    };
    const CaseResult result = run_cases(profile(), {&fails}, options()).cases.at(0);
    EXPECT_GE(result.attempts, 2);
    EXPECT_EQ(result.outcome.verdict, Verdict::pass) << result.outcome.reason;
  }
}

TEST(Runner, ReturnsWhatItHasWhenItIsCancelled) {
  const SmallDevice device{SmallDevice::offer(someip::InstanceId{1}), SmallDevice::Way::answers};
  Case quick = waiting(1s);
  quick.id = "a.quick";
  quick.run = [](Trial&) {};
  const Case slow = waiting(2min);
  bool cancelled = false;
  RunOptions with = options();
  with.on_begin = [&](const Case& one) { cancelled = &one == &slow; };
  with.cancelled = [&] { return cancelled; };
  const RunResult result = run_cases(profile(), {&quick, &slow, &quick}, with);
  EXPECT_TRUE(result.cancelled);
  ASSERT_EQ(result.cases.size(), 1U);
  EXPECT_EQ(result.cases[0].what, &quick);
  EXPECT_LT(result.took, 50s);
}

TEST(Runner, StartsADeviceAnewThatACaseHasKilled) {
  SmallDevice device{SmallDevice::offer(someip::InstanceId{1}), SmallDevice::Way::answers};
  const std::string file = testing::TempDir() + "/revived." + std::to_string(getpid());
  Case deadly = waiting(30s);
  deadly.run = [&](Trial&) { device.die(file); };
  Case harmless = waiting(30s);
  harmless.run = [](Trial&) {};
  Profile with = profile();
  with.lifecycle.restart = "touch " + file;
  const RunResult result = run_cases(with, {&deadly, &harmless}, options());
  std::filesystem::remove(file);
  ASSERT_EQ(result.cases.size(), 2U);
  EXPECT_EQ(result.cases[0].outcome.verdict, Verdict::fail);
  EXPECT_THAT(result.cases[0].outcome.reason, HasSubstr("does not answer any more after this"));
  EXPECT_EQ(result.cases[1].outcome.verdict, Verdict::pass) << result.cases[1].outcome.reason;
  EXPECT_EQ(result.cases[1].attempts, 1);
}

TEST(Runner, LeavesADeviceThatItDoesNotStopAlive) {
  SmallDevice device{SmallDevice::offer(someip::InstanceId{1}), SmallDevice::Way::answers};
  const std::string file = testing::TempDir() + "/left." + std::to_string(getpid());
  Case deadly = waiting(30s);
  deadly.run = [&](Trial&) { device.die(file); };
  Profile with = profile();
  with.timing.answer_within = 300ms;
  with.lifecycle.restart = "touch " + file;
  const RunResult result = run_cases(with, {&deadly}, options());
  EXPECT_EQ(result.cases.at(0).outcome.verdict, Verdict::fail);
  EXPECT_TRUE(std::filesystem::remove(file));
}

TEST(Runner, KnowsADeviceThatDoesNothingButOfferByItsOffers) {
  const SmallDevice device{SmallDevice::offer(someip::InstanceId{1}), SmallDevice::Way::to_group};
  Case quick = waiting(30s);
  quick.run = [](Trial& t) { t.pass(); };
  Profile with = profile();
  with.timing.cyclic_offer_delay = 20ms;
  with.timing.answer_within = 300ms;
  with.timing.ready_within = 30s;  // a busy machine may need more than one try
  EXPECT_EQ(run_cases(with, {&quick}, options()).cases.at(0).outcome.verdict, Verdict::pass);
  with.timing.cyclic_offer_delay.reset();
  with.timing.ready_within = 100ms;
  EXPECT_EQ(run_cases(with, {&quick}, options()).cases.at(0).outcome.verdict, Verdict::inconclusive);
}

TEST(Runner, KnowsADeviceThatAnswersFindsByMulticast) {
  const SmallDevice device{SmallDevice::offer(someip::InstanceId{1}), SmallDevice::Way::answers_to_group};
  Case quick = waiting(30s);
  quick.run = [](Trial& t) { t.pass(); };
  Case asks = waiting(30s);
  asks.run = [](Trial& t) {
    const ServiceProfile& service = t.profile.service();
    (void)t.answer_to_find(Trial::find_entry(service), false, service);
  };
  Profile with = profile();
  with.timing.cyclic_offer_delay = 1min;
  with.timing.answer_within = 2s;
  with.timing.ready_within = 30s;  // a busy machine may need more than one try
  const RunResult result = run_cases(with, {&quick, &asks}, options());
  EXPECT_EQ(result.cases.at(0).outcome.verdict, Verdict::pass) << result.cases[0].outcome.reason;
  // That it should be by unicast is for the cases, which say what the profile lacks where it is meant.
  EXPECT_EQ(result.cases.at(1).outcome.verdict, Verdict::fail);
  EXPECT_THAT(result.cases[1].outcome.reason, HasSubstr("policy: multicast_find_answers"));
}

TEST(Runner, DrawsTheSameNumbersForTheSameSeed) {
  const SmallDevice device{SmallDevice::offer(someip::InstanceId{1}), SmallDevice::Way::answers};
  std::vector<std::uint64_t> drawn;
  Case one = waiting(1s);
  one.run = [&](Trial& t) { drawn.push_back(t.random()); };
  Case other = one;
  other.id = "a.other";
  for (const std::uint64_t seed : {1U, 1U, 2U}) {
    RunOptions with = options();
    with.seed = seed;
    (void)run_cases(profile(), {&one, &other}, with);
  }
  ASSERT_EQ(drawn.size(), 6U);
  EXPECT_EQ(drawn[0], drawn[2]);
  EXPECT_EQ(drawn[1], drawn[3]);
  EXPECT_EQ((std::set<std::uint64_t>{drawn.begin(), drawn.end()}.size()), 4U);
}

}  // namespace
}  // namespace trestle::conform::runner_test
