#include <spdlog/spdlog.h>

#include "test/bridge/carry/runtime/route_test.hpp"
#include "test/bridge/end_to_end/log_sink.hpp"

namespace trestle::test::event_to_topic_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using namespace std::chrono_literals;

class EventToTopicTest : public RouteTest {
 protected:
  EventToTopicTest() { config_.routes = {route(carry::Direction::someip_to_dds)}; }
  carry::Route& settings() { return config_.routes.front(); }
  void send(const Bytes& payload, const someip::e2e::CheckResult* check = nullptr) {
    someip_.on_event({.payload = payload, .check = check}, {IpAddress::v4(10, 0, 0, 2), 30501});
  }
  void start_while_read() {
    settings().presence.subscribe_while_read = true;
    context_.watch = watch_.get();
    start();
  }
  /// So many read the topic now.
  void readers(std::size_t number) {
    dds_.matched = number;
    watch_->on_event({dds::Happening::Kind::matched, "rt/talk", "", "", "writer", number});
    work();
  }

  const std::shared_ptr<carry::TopicWatch> watch_ = std::make_shared<carry::TopicWatch>(io_);
};

TEST_F(EventToTopicTest, CarriesAnEvent) {
  start();
  send(hello);
  EXPECT_THAT(dds_.written, ElementsAre(hello_cdr));
  EXPECT_EQ(count("received"), 1U);
  EXPECT_EQ(count("carried"), 1U);
  EXPECT_EQ(route_at(0).received(), 1U);
}

TEST_F(EventToTopicTest, MapsFields) {
  // 100 * 0.5 as the data of a Float64; the payload is an UInt16.
  settings().type = "std_msgs/msg/Float64";
  settings().mapping = {.payload = {"std_msgs/msg/UInt16", {}},
                        .rules = {{.ros = {"data", {}}, .payload = {"data", {}}, .scale = 0.5}}};
  start();
  send(hex("0064"));
  send(hex("64"));
  EXPECT_THAT(dds_.written, ElementsAre(hex("00010000 0000000000004940")));
  EXPECT_EQ(count("not_convertible"), 1U);
  EXPECT_EQ(count("map_rounded"), 0U);
}

TEST_F(EventToTopicTest, StampsMessagesWithTheTimeAtWhichTheyCame) {
  settings().type = "std_msgs/msg/Header";
  settings().mapping = {.payload = {"std_msgs/msg/String", {}},
                        .rules = {{.ros = {"stamp", {}}, .is_received = true},
                                  {.ros = {"frame_id", {}}, .payload = {"data", {}}}}};
  start();
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(clock_.since_1970()).count();
  send(hello);
  ASSERT_EQ(dds_.written.size(), 1U);
  const Bytes& cdr = dds_.written.front();
  std::uint32_t stamp = 0;
  std::memcpy(&stamp, cdr.data() + 4, sizeof(stamp));
  EXPECT_EQ(stamp, seconds);
  EXPECT_EQ(to_hex(ByteView{cdr}.subspan(12)), to_hex(hex("06000000 68656c6c6f 00")));
}

TEST_F(EventToTopicTest, CountsWhatCannotBeConverted) {
  start();
  send(wrong);
  send(hello);
  EXPECT_EQ(count("not_convertible"), 1U);
  EXPECT_THAT(dds_.written, ElementsAre(hello_cdr));
}

TEST_F(EventToTopicTest, CountsByTheirReasonsThoseThatAreNotCarried) {
  settings().tp.max_message = hello.size();
  start();
  Bytes longer = hello;
  longer.resize(hello.size() + 1);
  send(longer);
  EXPECT_EQ(count("too_large"), 1U);
  dds_.matched = 0;
  send(hello);
  EXPECT_EQ(count("no_reader"), 1U);
  dds_.matched = 1;
  dds_.refuses_to_write = dds::WriteError::timeout;
  send(hello);
  EXPECT_EQ(count("dds_refused"), 1U);
  EXPECT_EQ(count("received"), 3U);
  EXPECT_EQ(count("carried"), 0U);
}

// Who comes next must not take the value of then for that of now.
TEST_F(EventToTopicTest, ForgetsWhatIsOldWhereNobodyReadsWhatIsNew) {
  start();
  send(hello);
  dds_.matched = 0;
  EXPECT_THAT(dds_.written, ElementsAre(hello_cdr));
  send(hello);
  EXPECT_EQ(count("no_reader"), 1U);
  EXPECT_THAT(dds_.written, IsEmpty());
}

TEST_F(EventToTopicTest, DropsWhatFailsItsCheckAndTellsOfIt) {
  settings().e2e.emplace();
  start();
  const someip::e2e::CheckResult bad{.status = someip::e2e::CheckStatus::error,
                                     .state = someip::e2e::State::invalid};
  send(hello, &bad);
  EXPECT_THAT(dds_.written, IsEmpty());
  EXPECT_EQ(count("e2e_error"), 1U);
  EXPECT_TRUE(route_at(0).has_checks());
  std::vector<carry::Diagnosis> told;
  route_at(0).append_diagnoses(told, false);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told.front().name, "trestle: E2E of /talk");
  EXPECT_EQ(told.front().level, carry::Diagnosis::Level::error);
}

TEST_F(EventToTopicTest, TellsWhetherItIsSubscribed) {
  start();
  EXPECT_EQ(state(), "OK: ready");
  someip_.acknowledged = false;
  EXPECT_EQ(state(), "WARN: the SOME/IP service is not there, or not subscribed to");
  std::vector<carry::Diagnosis> told;
  route_at(0).append_diagnoses(told, false);
  EXPECT_THAT(told, IsEmpty()) << "states are told if they are wanted";
}

TEST_F(EventToTopicTest, WritesWhileTheServiceIsOffered) {
  settings().presence.write_while_offered = true;
  start();
  EXPECT_FALSE(dds_.writes);
  someip_.service_comes_or_goes(true);
  work();
  EXPECT_TRUE(dds_.writes);
  send(hello);
  someip_.service_comes_or_goes(false);
  work();
  EXPECT_FALSE(dds_.writes);
  send(hello);
  EXPECT_EQ(count("no_reader"), 1U);
  EXPECT_THAT(dds_.written, ElementsAre(hello_cdr));
}

// A field's first value may come in the very burst of datagrams that the offer came in.
TEST_F(EventToTopicTest, CarriesALatchedValueThatComesRightAfterTheOffer) {
  settings().presence.write_while_offered = true;
  settings().qos.transient_local = true;
  start();
  dds_.matched = 0;
  someip_.service_comes_or_goes(true);
  send(hello);
  EXPECT_THAT(dds_.written, ElementsAre(hello_cdr));
  EXPECT_EQ(count("no_reader"), 0U);
  EXPECT_EQ(dds_.made, 1);
  work();
  EXPECT_EQ(dds_.made, 1);
}

TEST_F(EventToTopicTest, MakesNoWriterForEachOfferThatIsSoonWithdrawn) {
  settings().presence.write_while_offered = true;
  start();
  flap(1ms);
  EXPECT_LE(dds_.made, 2 + 1001 / 200 + 1) << "2 at once, then one change in 200 ms";
  pass(200ms);
  EXPECT_TRUE(dds_.writes) << "in the end it is offered";
}

TEST_F(EventToTopicTest, PutsOnTrialWhatComesAgainAndAgainFromAHostWhereSomebodyReads) {
  start();
  dds_.counterparts_found = {{.guid = {}, .node = "/gateway", .participant = "", .addresses = {"10.0.0.2"}}};
  dds_.on_match({}, true);
  const auto events = [&](int number) {
    for (int i = 0; i < number; ++i) {
      send(hello);
    }
    return dds_.written.size();
  };
  EXPECT_EQ(events(101), 101U) << "the first, and 100 that repeat it";
  EXPECT_EQ(events(1), 101U);
  EXPECT_EQ(count("looped"), 1U);
  pass(1s);  // in which none comes: there is a ring
  EXPECT_EQ(clock_.armed(), 0);
  EXPECT_EQ(events(20), 101U + 10U) << "in the minute after that fewer are enough";
  pass(1min + 2s);
  EXPECT_EQ(events(20), 101U + 10U + 20U);
}

// A ring over two hosts: one reads the topic, the other one sends the events.
TEST_F(EventToTopicTest, PutsOnTrialWhatComesMuchMoreOftenFromElsewhere) {
  start();
  const auto events = [&](int number) {
    for (int i = 0; i < number; ++i) {
      send(hello);
    }
    return dds_.written.size();
  };
  EXPECT_EQ(events(2000), 2000U) << "nobody reads who could close a ring";
  pass(2s);
  dds_.counterparts_found = {{.guid = {}, .node = "/gateway", .participant = "", .addresses = {"10.0.0.77"}}};
  dds_.on_match({}, true);
  EXPECT_EQ(events(500 + 501), 3001U) << "500 in a second are not looked at; then the first, and 500 repeats";
  const auto log = std::make_shared<LogSink>();
  const auto before = spdlog::default_logger();
  spdlog::set_default_logger(std::make_shared<spdlog::logger>("test", log));
  EXPECT_EQ(events(1), 3001U);
  EXPECT_EQ(count("looped"), 1U);
  pass(1s);  // in which none comes: there is a ring
  spdlog::set_default_logger(before);
  EXPECT_THAT(log->str(),
              HasSubstr("seems to loop through the ROS node /gateway, who reads the topic, and the "
                        "SOME/IP service at 10.0.0.2:30501"));
  EXPECT_EQ(events(20), 3001U + 10U) << "in the minute after that fewer are enough";
}

TEST_F(EventToTopicTest, SubscribesWhileSomebodyReads) {
  start_while_read();
  EXPECT_FALSE(someip_.on_event);
  readers(1);
  EXPECT_TRUE(someip_.on_event);
  readers(0);
  EXPECT_FALSE(someip_.on_event);
  EXPECT_EQ(state(), "OK: ready") << "nobody reads, so that nothing is amiss";
}

// Of its servers' events with other ids, it has those of the subscriptions that it had before.
TEST_F(EventToTopicTest, KeepsTheCountOfOtherEventsWhenItSubscribesAnew) {
  start_while_read();
  readers(1);
  someip_.faults.other_events = 3;
  EXPECT_EQ(count("unexpected"), 3U);
  readers(0);
  EXPECT_EQ(count("unexpected"), 3U);
  someip_.faults.other_events = 2;
  readers(1);
  EXPECT_EQ(count("unexpected"), 5U);
}

TEST_F(EventToTopicTest, KeepsTheCountOfOtherEventsWhenItIsStopped) {
  start();
  someip_.faults.other_events = 3;
  routes_->stop();
  EXPECT_EQ(count("unexpected"), 3U);
  someip_.faults = {};  // the node has ended its subscriptions
  EXPECT_EQ(count("unexpected"), 3U);
}

TEST_F(EventToTopicTest, BeginsNothingOnceItIsStopped) {
  settings().presence.write_while_offered = true;
  start();
  routes_->stop();
  someip_.service_comes_or_goes(true);
  work();
  EXPECT_FALSE(dds_.writes);
}

TEST_F(EventToTopicTest, EndsWhileAServiceComes) {
  settings().presence.write_while_offered = true;
  start();
  someip_.service_comes_or_goes(true);
  routes_.reset();
  work();
  EXPECT_FALSE(dds_.writes);
}

}  // namespace
}  // namespace trestle::test::event_to_topic_test
