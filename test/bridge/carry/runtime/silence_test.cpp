// How often it is said why nothing comes to a route; in which words: test/bridge/picture.
#include <gmock/gmock.h>

#include "bridge/carry/runtime/silence_watch.hpp"
#include "test/bridge/carry/runtime/virtual_clock.hpp"

namespace trestle::test::silence_test {
namespace {

using carry::RoutePicture;
using carry::SilenceWatch;
using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

/// An event that is subscribed to, or of a service that nobody offers.
RoutePicture subscribed() {
  RoutePicture route;
  route.kind = "event_to_topic";
  route.service = 0x1111;
  route.instance = 1;
  route.eventgroup = 7;
  route.major = 1;
  route.someip.wanted = true;
  route.someip.subscribed = true;
  return route;
}
RoutePicture not_offered() {
  RoutePicture route = subscribed();
  route.someip.subscribed = false;
  return route;
}
/// A topic without a publisher.
RoutePicture not_published() {
  RoutePicture route;
  route.kind = "topic_to_event";
  return route;
}

class Watch : public testing::Test {
 protected:
  void add(std::size_t routes) {
    state_.resize(routes, not_offered());
    received_.resize(routes);
    for (std::size_t i = 0; i < routes; ++i) {
      watch_.add({.topic = "/t" + std::to_string(i),
                  .received = [this, i] { return received_[i]; },
                  .picture = [this, i] { return state_[i]; }});
    }
  }
  std::vector<std::string> lines() {
    lines_.clear();
    watch_.start();
    clock_.pass(SilenceWatch::period);
    return lines_;
  }
  VirtualClock clock_;
  std::vector<RoutePicture> state_;
  std::vector<std::uint64_t> received_;
  std::vector<std::string> lines_;
  std::size_t looks_ = 0;
  carry::Picture around_;
  SilenceWatch watch_{clock_,
                      [this]() -> const carry::Picture& {
                        around_.someip.heard = static_cast<std::uint32_t>(++looks_);
                        around_.dds.heard = 3;
                        return around_;
                      },
                      [this](const std::string& line) { lines_.push_back(line); }};
};

TEST_F(Watch, TellsOnceAndAgainWhenTheReasonChanges) {
  add(2);
  EXPECT_THAT(lines(), ElementsAre("/t0: nothing has come yet: nobody offers 0x1111.0x0001 (1 SOME/IP host "
                                   "was heard)",
                                   testing::StartsWith("/t1: ")));
  EXPECT_THAT(lines(), IsEmpty()) << "another number of hosts is no other reason";
  state_[1] = subscribed();
  EXPECT_THAT(lines(), ElementsAre("/t1: nothing has come yet: eventgroup 0x0007 of 0x1111.0x0001 is "
                                   "subscribed to, but no event has come"));
  ++received_[1];
  EXPECT_THAT(lines(), IsEmpty());
  ++received_[0];
  ++received_[1];
  EXPECT_THAT(lines(), IsEmpty());
  EXPECT_EQ(looks_, 4U) << "nothing is looked at when no route is silent";
}

TEST_F(Watch, TellsOfARouteThatHasWorkedWhenNobodyIsThereAnyLonger) {
  add(1);
  state_[0] = subscribed();
  state_[0].received = ++received_[0];
  EXPECT_THAT(lines(), IsEmpty());
  EXPECT_THAT(lines(), IsEmpty()) << "who is there may have nothing to say";
  state_[0].someip.subscribed = false;
  EXPECT_THAT(lines(), ElementsAre("/t0: nothing comes any longer: nobody offers 0x1111.0x0001 (2 SOME/IP "
                                   "hosts were heard)"));
  EXPECT_THAT(lines(), IsEmpty());
  ++received_[0];
  EXPECT_THAT(lines(), IsEmpty());
  EXPECT_THAT(lines(), SizeIs(1)) << "once more";
}

TEST_F(Watch, GivesTimeToRoutesThatBeginLater) {
  add(1);
  watch_.start();
  EXPECT_THAT(lines(), SizeIs(1));
  state_.push_back(subscribed());
  watch_.add({.topic = "/late",
              .received = [] { return std::uint64_t{0}; },
              .picture = [this] { return state_[1]; }});
  EXPECT_THAT(lines(), IsEmpty());
  EXPECT_THAT(lines(), ElementsAre(testing::StartsWith("/late: ")));
  watch_.remove("/late");
  state_[1] = not_published();
  EXPECT_THAT(lines(), IsEmpty());
  watch_.stop();
}

TEST_F(Watch, BeginsToLookWhenThereIsSomethingToLookAt) {
  watch_.start();
  EXPECT_EQ(clock_.armed(), 0);
  clock_.pass(1h);
  add(1);
  EXPECT_EQ(clock_.armed(), 1);
  clock_.pass(5s - 1ns);
  EXPECT_EQ(looks_, 0U);
  clock_.pass(1ns);
  EXPECT_EQ(looks_, 0U) << "it is new";
  clock_.pass(5s);
  EXPECT_EQ(looks_, 1U);
  watch_.stop();
  clock_.pass(1h);
  EXPECT_EQ(looks_, 1U);
}

TEST_F(Watch, TellsOfAThousandRoutesInAFewLines) {
  add(1000);
  for (std::size_t i = 0; i < 300; ++i) {
    state_[i] = not_published();
  }
  EXPECT_THAT(
      lines(),
      ElementsAre("/t300, /t301, /t302 and 697 more routes: nothing has come yet: nobody offers their "
                  "services (1 SOME/IP host was heard)",
                  "/t0, /t1, /t2 and 297 more routes: nothing has come yet: nobody publishes them (3 "
                  "participants in DDS domain 0)"));
  EXPECT_THAT(lines(), IsEmpty());
}

}  // namespace
}  // namespace trestle::test::silence_test
