// Why nothing comes to a route, in words, and how often that is said.
#include <gmock/gmock.h>

#include "bridge/carry/runtime/silence_watch.hpp"
#include "test/bridge/carry/runtime/virtual_clock.hpp"

namespace trestle::test::silence_test {
namespace {

using carry::Route;
using carry::SilenceReason;
using carry::SilenceWatch;
using Kind = carry::SilenceReason::Kind;
using namespace std::chrono_literals;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

Route route() {
  Route result;
  result.topic = "/points";
  result.type = "sensor_msgs/msg/PointCloud2";
  result.service = someip::ServiceId{0x1111};
  result.instance = someip::InstanceId{1};
  result.eventgroup = someip::EventgroupId{7};
  result.event = someip::MethodId{0x8001};
  result.minor = carry::any_minor;
  return result;
}
sd::SeenOffer offer(std::uint16_t instance, std::uint8_t major) {
  return {someip::ServiceId{0x1111}, someip::InstanceId{instance}, major, 0, IpAddress::v4(10, 0, 0, 3)};
}
std::string said(const SilenceReason& reason, std::size_t heard = 2) {
  return in_words(reason, 1, heard);
}
std::string of_someip(const carry::SomeipSilence& known, std::size_t heard = 2) {
  return said(why_silent(route(), known), heard);
}
std::string of_dds(const carry::DdsSilence& known, std::size_t heard = 2) {
  return said(why_silent(route(), known), heard);
}

TEST(Silence, OfAServiceThatNobodyOffers) {
  EXPECT_EQ(of_someip({}), "nobody offers 0x1111.0x0001 (2 SOME/IP hosts were heard)");
  EXPECT_EQ(of_someip({}, 1), "nobody offers 0x1111.0x0001 (1 SOME/IP host was heard)");
  EXPECT_EQ(of_someip({}, 0), "nobody offers 0x1111.0x0001 (no other SOME/IP host was heard)");
}

TEST(Silence, OfAServiceThatIsOfferedOtherwise) {
  const std::vector instance{offer(2, 1)};
  EXPECT_EQ(of_someip({.offers = instance}),
            "0x1111.0x0001 version 1.any is not offered, but 0x1111.0x0002 version 1.0 by 10.0.0.3");
  const std::vector major{offer(1, 2), offer(1, 3)};
  EXPECT_EQ(of_someip({.offers = major}),
            "0x1111.0x0001 version 1.any is not offered, but 0x1111.0x0001 version 2.0 by 10.0.0.3, "
            "0x1111.0x0001 version 3.0 by 10.0.0.3");
  std::vector<sd::SeenOffer> many;
  for (std::uint16_t i = 2; i < 1000; ++i) {
    many.push_back(offer(i, 1));
  }
  EXPECT_THAT(of_someip({.offers = many}), AllOf(HasSubstr(" and 994 more"), SizeIs(testing::Lt(400U))));
}

TEST(Silence, OfASubscriptionThatIsNone) {
  const std::vector offers{offer(1, 1)};
  EXPECT_EQ(
      of_someip({.offers = offers, .subscription = true}),
      "0x1111.0x0001 is offered, but the server has not answered the subscription to eventgroup 0x0007");
  EXPECT_EQ(of_someip({.offers = offers, .subscription = true, .refused = true}),
            "0x1111.0x0001 is offered, but the server refuses eventgroup 0x0007");
  EXPECT_EQ(of_someip({.offers = offers, .subscription = true, .over_tcp_only = true}),
            "0x1111.0x0001 is offered, but not over TCP; `transport: tcp` is wanted for eventgroup 0x0007");
  EXPECT_EQ(why_silent(route(), carry::SomeipSilence{.offers = offers}).kind, Kind::none)
      << "waits for a reader";
}

TEST(Silence, OfEventsWithOtherIds) {
  const std::vector offers{offer(1, 1)};
  const carry::SomeipSilence known{
      .offers = offers,
      .subscription = true,
      .subscribed = true,
      .others = {.count = 9, .ids = {someip::MethodId{0x8005}, someip::MethodId{0x8006}}}};
  EXPECT_EQ(of_someip(known), "of 0x1111.0x0001 came event 0x8005, 0x8006; the route waits for 0x8001");
  EXPECT_EQ(of_someip({.offers = offers, .subscription = true, .subscribed = true}),
            "eventgroup 0x0007 of 0x1111.0x0001 is subscribed to, but no event has come");
}

TEST(Silence, OfAnAddressThatIsNotTheInterfaces) {
  EXPECT_EQ(of_someip({.other_interface = "10.0.0.1 is not that of `interface` eth1, but of eth0"}),
            "`address` 10.0.0.1 is not that of `interface` eth1, but of eth0: service discovery uses another "
            "network than the other hosts");
}

TEST(Silence, OfATopic) {
  EXPECT_THAT(of_dds({}), HasSubstr("nobody else is in the DDS domain"));
  EXPECT_EQ(of_dds({.participants = 3}, 3), "nobody publishes it (3 participants in the DDS domain)");
  const std::vector other{dds::FoundWriter{.topic = "rt/points", .type = "std_msgs::msg::dds_::String_"}};
  EXPECT_EQ(of_dds({.participants = 3, .writers = other}),
            "it is published with type std_msgs/msg/String; the route has sensor_msgs/msg/PointCloud2");
  const std::vector right{
      dds::FoundWriter{.topic = "rt/points", .type = "sensor_msgs::msg::dds_::PointCloud2_"}};
  EXPECT_THAT(of_dds({.participants = 3, .writers = right}), HasSubstr("does not go with the route's `qos`"));
  EXPECT_EQ(of_dds({.participants = 3, .writers = right, .matched = 1}),
            "a publisher is there, but has published nothing since");
}

TEST(Silence, OfAPattern) {
  const auto of = [](const carry::PatternSilence& known, std::size_t heard) {
    return said(why_silent(known), heard);
  };
  EXPECT_THAT(of({}, 0), HasSubstr("nobody else is in the DDS domain"));
  EXPECT_EQ(of({.participants = 3}, 3),
            "nobody publishes a topic that matches (3 participants in the DDS domain)");
  EXPECT_THAT(of({.participants = 3, .brought = true}, 3), HasSubstr("is brought in by other bridges"));
  EXPECT_THAT(of({.participants = 3, .topics = 2, .brought = true}, 3), HasSubstr("none gets a route"));
  EXPECT_EQ(of({.routes = 1, .participants = 3, .topics = 2}, 3), "nothing is amiss");
}

class Watch : public testing::Test {
 protected:
  void add(std::size_t routes) {
    state_.resize(routes, {Kind::not_offered, "0x1111.0x0001"});
    received_.resize(routes);
    for (std::size_t i = 0; i < routes; ++i) {
      watch_.add({.topic = "/t" + std::to_string(i),
                  .received = [this, i] { return received_[i]; },
                  .reason = [this, i] { return state_[i]; }});
    }
  }
  std::vector<std::string> lines() {
    lines_.clear();
    watch_.start();
    clock_.pass(SilenceWatch::period);
    return lines_;
  }
  VirtualClock clock_;
  std::vector<SilenceReason> state_;
  std::vector<std::uint64_t> received_;
  std::vector<std::string> lines_;
  std::size_t looks_ = 0;
  SilenceWatch watch_{clock_,
                      [this] {
                        ++looks_;
                        return SilenceWatch::Heard{.someip = looks_, .dds = 3};
                      },
                      [this](const std::string& line) { lines_.push_back(line); }};
};

TEST_F(Watch, TellsOnceAndAgainWhenTheReasonChanges) {
  add(2);
  EXPECT_THAT(lines(), ElementsAre("/t0: nothing has come yet: nobody offers 0x1111.0x0001 (1 SOME/IP host "
                                   "was heard)",
                                   testing::StartsWith("/t1: ")));
  EXPECT_THAT(lines(), IsEmpty()) << "another number of hosts is no other reason";
  state_[1] = {Kind::no_event, "subscribed"};
  EXPECT_THAT(lines(), ElementsAre("/t1: nothing has come yet: subscribed"));
  ++received_[1];
  EXPECT_THAT(lines(), IsEmpty());
  ++received_[0];
  ++received_[1];
  EXPECT_THAT(lines(), IsEmpty());
  EXPECT_EQ(looks_, 4U) << "nothing is looked at when no route is silent";
}

TEST_F(Watch, TellsOfARouteThatHasWorkedWhenNobodyIsThereAnyLonger) {
  add(1);
  state_[0] = {Kind::no_event, "subscribed"};
  ++received_[0];
  EXPECT_THAT(lines(), IsEmpty());
  EXPECT_THAT(lines(), IsEmpty()) << "who is there may have nothing to say";
  state_[0] = {Kind::not_offered, "0x1111.0x0001"};
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
  state_.push_back({Kind::no_sample, {}});
  watch_.add({.topic = "/late",
              .received = [] { return std::uint64_t{0}; },
              .reason = [this] { return state_[1]; }});
  EXPECT_THAT(lines(), IsEmpty());
  EXPECT_THAT(lines(), ElementsAre(testing::StartsWith("/late: ")));
  watch_.remove("/late");
  state_[1] = {Kind::no_publisher, {}};
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
    state_[i] = {Kind::no_publisher, {}};
  }
  EXPECT_THAT(
      lines(),
      ElementsAre("/t300, /t301, /t302 and 697 more routes: nothing has come yet: nobody offers their "
                  "services (1 SOME/IP host was heard)",
                  "/t0, /t1, /t2 and 297 more routes: nothing has come yet: nobody publishes them (3 "
                  "participants in the DDS domain)"));
  EXPECT_THAT(lines(), IsEmpty());
}

}  // namespace
}  // namespace trestle::test::silence_test
