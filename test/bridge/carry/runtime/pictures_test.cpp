// What each kind of route tells of itself, and why nothing flows on it.
#include "bridge/picture/causes.hpp"
#include "test/bridge/carry/runtime/route_test.hpp"

namespace trestle::test::pictures_test {
namespace {

using carry::RoutePicture;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;
using namespace std::chrono_literals;

class Pictures : public RouteTest {
 protected:
  Pictures() {
    around_.networks.someip.heard = 1;
    around_.networks.someip.discovery_received = 1;
    around_.networks.dds.heard = 1;
  }
  [[nodiscard]] RoutePicture picture() const {
    RoutePicture result = route_at(0).picture(around_);
    result.counters = carry::pictures_of(route_at(0).counters().counters);
    return result;
  }
  [[nodiscard]] std::string cause() const { return to_string(why(picture(), around_.networks).cause); }
  void event(const Bytes& payload) {
    someip_.on_event({.payload = payload}, {IpAddress::v4(10, 0, 0, 2), 30501});
  }
  void publish(const Bytes& cdr, std::chrono::nanoseconds source_time = {}) {
    dds_.on_sample(dds::Sample{cdr, source_time, ++sequence_});
  }
  void offered_as(std::uint8_t major) {
    around_.offers[someip::ServiceId{0x1234}] = {
        {someip::ServiceId{0x1234}, someip::InstanceId{1}, major, 0, IpAddress::v4(10, 0, 0, 2)}};
  }
  dds::FoundWriter& written_by(const char* node) {
    dds::FoundWriter writer;
    writer.topic = "rt/talk";
    writer.type = "std_msgs::msg::dds_::String_";
    writer.node = node;
    return around_.writers["rt/talk"].emplace_back(writer);
  }

  /// "topic=/talk service=0x1234"
  [[nodiscard]] std::string labels(std::size_t index = 0) const {
    std::string all;
    for (const carry::Label& label : route_at(index).counters().labels) {
      all += (all.empty() ? "" : " ") + std::string{label.name} + "=" + label.value;
    }
    return all;
  }

  carry::Surroundings around_;
  std::uint64_t sequence_ = 0;
};

TEST_F(Pictures, OfAnEventThatIsCarried) {
  config_.routes = {route(carry::Direction::someip_to_dds)};
  start();
  for (int i = 0; i < 30; ++i) {
    event(hello);
    pass(100ms);
  }
  EXPECT_EQ(labels(), "topic=/talk direction=someip_to_dds service=0x1234 instance=0x0001 event=0x8001");
  const RoutePicture now = picture();
  EXPECT_EQ(now.kind, "event_to_topic");
  EXPECT_EQ(now.name, "/talk");
  EXPECT_EQ(now.direction, "someip_to_dds");
  EXPECT_EQ(now.type, "std_msgs/msg/String");
  EXPECT_EQ(now.service, 0x1234);
  EXPECT_EQ(now.instance, 1);
  EXPECT_EQ(now.member, 0x8001);
  EXPECT_EQ(now.eventgroup, 1);
  EXPECT_EQ(now.transport, "udp");
  EXPECT_EQ(now.received, 30U);
  EXPECT_EQ(now.carried, 30U);
  EXPECT_EQ(now.bytes, 30 * hello_cdr.size());
  EXPECT_NEAR(now.per_second, 10, 0.5);
  EXPECT_EQ(now.conversion.count, 30U);
  EXPECT_EQ(now.path.count, 30U);
  EXPECT_EQ(now.last_ns, (clock_.since_1970() - 100ms).count());
  EXPECT_EQ(now.last_carried_ns, now.last_ns);
  EXPECT_THAT(now.slowest, SizeIs(4));
  EXPECT_TRUE(now.someip.wanted);
  EXPECT_TRUE(now.someip.subscribed);
  EXPECT_TRUE(now.dds.open);
  EXPECT_EQ(now.dds.matched, 1U);
  EXPECT_EQ(now.dds.qos.depth, 2U);
  EXPECT_EQ(cause(), "none");
}

TEST_F(Pictures, OfAnEventThatDoesNotCome) {
  config_.routes = {route(carry::Direction::someip_to_dds)};
  someip_.acknowledged = false;
  start();
  EXPECT_EQ(cause(), "not_offered");
  offered_as(2);
  ASSERT_THAT(picture().someip.offers, SizeIs(1));
  EXPECT_EQ(picture().someip.offers.front().host, "10.0.0.2");
  EXPECT_EQ(cause(), "offered_otherwise");
  offered_as(1);
  EXPECT_EQ(cause(), "not_acknowledged");
  someip_.faults.refused = 1;
  EXPECT_EQ(cause(), "refused");
  someip_.acknowledged = true;
  EXPECT_EQ(cause(), "no_event");
  event(wrong);
  EXPECT_EQ(cause(), "dropped");
  dds_.matched = 0;
  event(hello);
  EXPECT_EQ(cause(), "no_reader");
}

TEST_F(Pictures, OfAnEventThatWaitsForAReader) {
  config_.routes = {route(carry::Direction::someip_to_dds)};
  config_.routes.front().presence.subscribe_while_read = true;
  offered_as(1);
  dds_.matched = 0;
  start();
  EXPECT_FALSE(picture().someip.wanted);
  EXPECT_EQ(cause(), "none");
}

TEST_F(Pictures, OfATopicThatIsCarried) {
  config_.routes = {route(carry::Direction::dds_to_someip)};
  start();
  publish(hello_cdr, clock_.since_1970() - 3ms);
  publish(hello_cdr);
  EXPECT_EQ(picture().in_use, 2U);
  EXPECT_EQ(picture().limit, 2U);
  clock_.pass(1ms);  // in which the thread has no time for it
  work();
  const RoutePicture now = picture();
  EXPECT_EQ(now.kind, "topic_to_event");
  EXPECT_EQ(now.received, 2U);
  EXPECT_EQ(now.carried, 2U);
  EXPECT_EQ(now.bytes, 2 * hello.size());
  EXPECT_EQ(now.in_use, 0U);
  EXPECT_EQ(now.path.max_ns, 4'000'000) << "since it was published";
  EXPECT_EQ(now.path.min_ns, 1'000'000) << "since it came";
  EXPECT_EQ(now.slowest.front().source_ns, 4'000'000);
  EXPECT_EQ(now.slowest.front().waited_ns, 1'000'000);
  EXPECT_EQ(now.last_ns, (clock_.since_1970() - 1ms).count());
  EXPECT_TRUE(now.someip.offered);
  EXPECT_EQ(now.someip.subscribers, 1U);
  EXPECT_EQ(cause(), "none");
}

TEST_F(Pictures, OfATopicThatNobodyPublishes) {
  config_.routes = {route(carry::Direction::dds_to_someip)};
  dds_.matched = 0;
  start();
  EXPECT_EQ(cause(), "no_publisher");
  written_by("/b").bridge = true;
  EXPECT_EQ(cause(), "no_publisher") << "but for a bridge that it has nothing to do with";
  written_by("/lidar").qos.reliable = false;
  ASSERT_THAT(picture().dds.writers, SizeIs(1));
  EXPECT_EQ(picture().dds.writers.front().topic, "/talk");
  EXPECT_EQ(picture().dds.writers.front().type, "std_msgs/msg/String");
  EXPECT_EQ(cause(), "other_qos");
  EXPECT_EQ(in_words(why(picture(), around_.networks), nullptr, around_.networks),
            "publishers are there, but their quality of service does not go with the routes' `qos`");
  dds_.matched = 1;
  EXPECT_EQ(cause(), "no_sample");
}

TEST_F(Pictures, OfATopicThatNobodySubscribesTo) {
  config_.routes = {route(carry::Direction::dds_to_someip)};
  someip_.subscriber_count = 0;
  start();
  publish(hello_cdr);
  work();
  EXPECT_EQ(cause(), "no_subscriber");
}

TEST_F(Pictures, OfALatchedTopicThatNobodySubscribesToYet) {
  config_.routes = {route(carry::Direction::dds_to_someip)};
  config_.routes.front().qos.transient_local = true;
  someip_.subscriber_count = 0;
  start();
  publish(hello_cdr);
  work();
  EXPECT_EQ(picture().carried, 1U) << "it is kept for readers that come later";
  EXPECT_EQ(cause(), "none");
}

TEST_F(Pictures, NameAsManyWritersAsAreWorthIt) {
  config_.routes = {route(carry::Direction::dds_to_someip)};
  start();
  for (int i = 0; i < 100; ++i) {
    written_by("/one");
  }
  EXPECT_THAT(picture().dds.writers, SizeIs(carry::most_in_picture));
}

// std_srvs/srv/SetBool: {bool data} and {bool success, string message}.
TEST_F(Pictures, OfAMethodThatRosAnswers) {
  config_.methods = {method(carry::Server::ros)};
  dds_.ready = false;
  start();
  EXPECT_EQ(picture().kind, "method_to_service");
  EXPECT_EQ(labels(),
            "ros_service=/set direction=someip_to_dds service=0x1234 instance=0x0001 method=0x0021");
  EXPECT_EQ(cause(), "no_ros_server");
  dds_.ready = true;
  dds_.wake();
  work();
  EXPECT_EQ(cause(), "none");
  someip_.request(hex("01"));
  EXPECT_EQ(picture().received, 1U);
  EXPECT_EQ(picture().in_use, 1U);
  EXPECT_EQ(picture().limit, 2U);
  std::exchange(dds_.called.at(0).handler,
                nullptr)(dds::ServiceMessage{hex("00010000 01 000000 01000000 00")});
  EXPECT_EQ(picture().carried, 1U);
  EXPECT_EQ(picture().in_use, 0U);
}

TEST_F(Pictures, OfAMethodThatSomeipAnswers) {
  config_.methods = {method(carry::Server::someip)};
  start();
  EXPECT_EQ(picture().kind, "service_to_method");
  EXPECT_EQ(labels(),
            "ros_service=/set direction=dds_to_someip service=0x1234 instance=0x0001 method=0x0021");
  EXPECT_EQ(cause(), "not_offered");
  offered_as(1);
  EXPECT_EQ(cause(), "not_callable");
  someip_.service_comes_or_goes(true);
  work();
  EXPECT_EQ(cause(), "none");
  dds_.on_request({}, dds::ServiceMessage{hex("00010000 01")});
  EXPECT_EQ(picture().received, 1U);
  EXPECT_EQ(picture().in_use, 1U);
  someip_.respond(0, {}, hex("01 00000004 efbbbf 00"));
  EXPECT_EQ(picture().carried, 1U);
}

TEST_F(Pictures, OfAGetter) {
  config_.routes = {route(carry::Direction::dds_to_someip)};
  config_.routes.front().qos.transient_local = true;
  config_.routes.front().getter = carry::FieldGetter{.id = someip::MethodId{0x31}};
  start();
  EXPECT_EQ(labels(0), "topic=/talk direction=dds_to_someip service=0x1234 instance=0x0001 event=0x8001");
  EXPECT_EQ(labels(1), "topic=/talk direction=dds_to_someip service=0x1234 instance=0x0001 method=0x0031");
  const RoutePicture getter = route_at(1).picture(around_);
  EXPECT_EQ(getter.kind, "getter_to_topic");
  EXPECT_EQ(getter.member, 0x31);
  EXPECT_TRUE(getter.someip.offered);
  EXPECT_EQ(to_string(why(getter, around_.networks).cause), std::string{"none"});
}

TEST_F(Pictures, OfServicesOfOurs) {
  config_.routes = {route(carry::Direction::dds_to_someip)};
  config_.routes.front().port = 40001;
  start();
  std::vector<carry::OwnOfferPicture> offers;
  routes_->append_offers(offers);
  ASSERT_THAT(offers, SizeIs(1));
  EXPECT_EQ(offers.front().service, 0x1234);
  EXPECT_EQ(offers.front().udp_port, 40001U);
  EXPECT_TRUE(offers.front().offered);
}

}  // namespace
}  // namespace trestle::test::pictures_test
