#include <deque>

#include "test/bridge/carry/runtime/route_test.hpp"

namespace trestle::test::topic_to_event_test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;
using namespace std::chrono_literals;

class TopicToEventTest : public RouteTest {
 protected:
  TopicToEventTest() { config_.routes = {route(carry::Direction::dds_to_someip)}; }
  carry::Route& settings() { return config_.routes.front(); }
  void publish(const Bytes& cdr, std::chrono::nanoseconds source_time = {}) {
    dds_.on_sample(dds::Sample{samples_.emplace_back(cdr), source_time, ++sequence_});
  }

  std::deque<Bytes> samples_;  // outlive what is lent
  std::uint64_t sequence_ = 0;
};

TEST_F(TopicToEventTest, CarriesASample) {
  start();
  publish(hello_cdr);
  EXPECT_THAT(someip_.events, IsEmpty()) << "not on a thread of DDS";
  work();
  EXPECT_THAT(someip_.events, ElementsAre(hello));
  EXPECT_EQ(count("received"), 1U);
  EXPECT_EQ(count("carried"), 1U);
  EXPECT_EQ(count("bytes"), hello.size());
}

TEST_F(TopicToEventTest, MapsFields) {
  // The data of a Float64 divided by 0.5 as an UInt16.
  settings().type = "std_msgs/msg/Float64";
  settings().mapping = {.payload = {"std_msgs/msg/UInt16", {}},
                        .rules = {{.ros = {"data", {}}, .payload = {"data", {}}, .scale = 0.5}}};
  start();
  publish(hex("00010000 0000000000004940"));  // 50
  publish(hex("00000000 c049000000000000"));  // -50, in big endian
  work();
  EXPECT_THAT(someip_.events, ElementsAre(hex("0064"), hex("0000")));
  EXPECT_EQ(count("map_saturated"), 1U);
}

TEST_F(TopicToEventTest, DropsWhatATableDoesNotHave) {
  settings().type = "std_msgs/msg/UInt8";
  settings().mapping = {
      .payload = {"std_msgs/msg/UInt16", {}},
      .rules = {{.ros = {"data", {}}, .payload = {"data", {}}, .table = {{{"256", {}}, {"3", {}}}}}}};
  start();
  publish(hex("00010000 03"));
  publish(hex("00010000 04"));
  work();
  EXPECT_THAT(someip_.events, ElementsAre(hex("0100")));
  EXPECT_EQ(count("not_convertible"), 1U);
}

TEST_F(TopicToEventTest, CountsWhatCannotBeConverted) {
  start();
  publish(wrong);
  publish(hello_cdr);
  work();
  EXPECT_EQ(count("not_convertible"), 1U);
  EXPECT_THAT(someip_.events, ElementsAre(hello));
}

TEST_F(TopicToEventTest, DropsTheOldestWhenMoreWaitThanTheDepth) {
  start();
  publish(wrong);
  publish(hello_cdr);
  publish(hello_cdr);
  work();
  EXPECT_EQ(count("overtaken"), 1U);
  EXPECT_EQ(count("not_convertible"), 0U) << "the first one was dropped";
  EXPECT_THAT(someip_.events, SizeIs(2));
}

TEST_F(TopicToEventTest, DropsTheNewestIfAllAreKept) {
  settings().qos.keep_all = true;
  start();
  publish(hello_cdr);
  publish(hello_cdr);
  publish(wrong);
  work();
  EXPECT_EQ(count("overtaken"), 1U);
  EXPECT_EQ(count("not_convertible"), 0U);
  EXPECT_THAT(someip_.events, SizeIs(2));
}

TEST_F(TopicToEventTest, CountsByTheirReasonsThoseThatAreNotCarried) {
  settings().tp.max_message = hello.size() - 1;
  settings().qos.lifespan = 1min;
  start();
  publish(hello_cdr, clock_.since_1970());
  clock_.pass(1min + 1ns);  // in which the thread has no time for it
  work();
  EXPECT_EQ(count("expired"), 1U);
  publish(hello_cdr);
  work();
  EXPECT_EQ(count("too_large"), 1U);
  someip_.subscriber_count = 0;
  publish(hello_cdr);
  work();
  EXPECT_EQ(count("no_subscriber"), 1U);
  EXPECT_EQ(count("received"), 3U);
  EXPECT_THAT(someip_.events, IsEmpty());
}

TEST_F(TopicToEventTest, LendsAsManyAsAreBoundedAndCopiesTheRest) {
  settings().qos.depth = 1;
  start();
  someip_.holds_all = true;
  for (int i = 0; i < 20; ++i) {
    publish(hello_cdr);
    work();
  }
  EXPECT_EQ(count("carried"), 20U);
  EXPECT_EQ(std::ranges::count(someip_.holds, nullptr), 11) << "the depth, and 8 for slow ones, are lent";
  EXPECT_EQ(count("copied"), 11U);
  someip_.holds.clear();
  publish(hello_cdr);
  work();
  EXPECT_EQ(count("copied"), 11U);
}

TEST_F(TopicToEventTest, KeepsTheNewestWhileThereIsNoRoom) {
  start();
  someip_.without_room = 1;
  publish(hello_cdr);
  work();
  publish(hex("00010000 04000000 746f6f 00"));  // "too"
  publish(hex("00010000 04000000 6e6577 00"));  // "new"
  work();
  EXPECT_THAT(someip_.events, IsEmpty());
  EXPECT_EQ(count("overtaken"), 1U) << "two wait: the depth";
  EXPECT_EQ(count("not_sent"), 0U);
  someip_.make_room();
  const Bytes too = hex("00000007 efbbbf 746f6f 00");
  const Bytes newest = hex("00000007 efbbbf 6e6577 00");
  EXPECT_THAT(someip_.events, ElementsAre(too, newest));
  EXPECT_EQ(count("received"), 3U);
  EXPECT_EQ(count("carried"), 2U);
  publish(hello_cdr);
  work();
  EXPECT_THAT(someip_.events, ElementsAre(too, newest, hello)) << "as before";
}

TEST_F(TopicToEventTest, KeepsTheOldestWhileThereIsNoRoomIfAllAreKept) {
  settings().qos.keep_all = true;
  start();
  someip_.without_room = 1;
  publish(hello_cdr);
  publish(hello_cdr);
  work();
  publish(wrong);
  work();
  EXPECT_EQ(count("overtaken"), 1U);
  someip_.make_room();
  EXPECT_THAT(someip_.events, ElementsAre(hello, hello));
  EXPECT_EQ(count("not_convertible"), 0U);
}

TEST_F(TopicToEventTest, WaitsForNobodyWhileSomeSubscriberHasRoom) {
  start();
  someip_.subscriber_count = 2;
  someip_.without_room = 1;
  publish(hello_cdr);
  publish(hello_cdr);
  work();
  EXPECT_THAT(someip_.events, ElementsAre(hello, hello));
  EXPECT_EQ(count("not_sent"), 2U);
  EXPECT_FALSE(someip_.asked);
}

TEST_F(TopicToEventTest, EndsWhileThereIsNoRoom) {
  start();
  someip_.without_room = 1;
  publish(hello_cdr);
  work();
  routes_->stop();
  EXPECT_EQ(count("stopped"), 1U);
  someip_.make_room();
  EXPECT_THAT(someip_.events, IsEmpty());
  routes_.reset();
}

TEST_F(TopicToEventTest, OffersTheServiceWhileThereIsAPublisher) {
  settings().presence.offer_while_published = true;
  dds_.matched = 0;
  start();
  EXPECT_FALSE(someip_.offered);
  EXPECT_EQ(state(), "WARN: nobody publishes the topic");
  dds_.matched = 1;
  routes_->update_offers();
  EXPECT_TRUE(someip_.offered);
  EXPECT_EQ(state(), "OK: ready");
  EXPECT_EQ(count("publishers"), 1U);
}

TEST_F(TopicToEventTest, KeepsTheValueOfALatchedTopicForWhoComesLate) {
  settings().qos.transient_local = true;
  start();
  someip_.subscriber_count = 0;
  publish(hello_cdr);
  work();
  EXPECT_EQ(count("kept"), 1U);
  ASSERT_TRUE(someip_.value);
  EXPECT_EQ(*someip_.value, hello);
}

TEST_F(TopicToEventTest, CarriesNothingOnceItIsStopped) {
  start();
  publish(hello_cdr);
  routes_->stop();
  publish(hello_cdr);
  work();
  EXPECT_THAT(someip_.events, IsEmpty());
  EXPECT_EQ(count("received"), 2U);
  EXPECT_EQ(count("stopped"), 2U);
}

TEST_F(TopicToEventTest, EndsWhileASampleIsLentOut) {
  start();
  someip_.holds_all = true;
  publish(hello_cdr);
  work();
  publish(hello_cdr);  // waits
  routes_.reset();
  EXPECT_EQ(dds_.reads, 0);
  someip_.holds.clear();
  work();
  EXPECT_THAT(someip_.events, SizeIs(1));
}

}  // namespace
}  // namespace trestle::test::topic_to_event_test
