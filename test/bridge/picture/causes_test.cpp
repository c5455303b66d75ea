// Why nothing flows on a route, in words: a test for each cause, without a network.
#include "bridge/picture/causes.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <set>

#include "bridge/picture/id_names.hpp"
#include "sd/wire/entry.hpp"

namespace trestle::test::causes_test {
namespace {

using carry::Cause;
using carry::OfferPicture;
using carry::Picture;
using carry::RoutePicture;
using carry::RouteState;
using carry::WriterPicture;
using testing::AllOf;
using testing::HasSubstr;
using testing::SizeIs;

constexpr std::int64_t second_ns = 1'000'000'000;

/// Two other hosts and three participants are there.
Picture around() {
  Picture result;
  result.someip.address = "10.0.0.1";
  result.someip.interface = "eth0";
  result.someip.discovery_received = 5;
  result.someip.heard = 2;
  result.dds.domain = 7;
  result.dds.heard = 3;
  return result;
}
OfferPicture offer(std::uint16_t instance, std::uint32_t major) {
  return {0x1111, instance, major, 0, "10.0.0.3"};
}
RoutePicture route(const char* kind) {
  RoutePicture result;
  result.kind = kind;
  result.name = "/points";
  result.type = "sensor_msgs/msg/PointCloud2";
  result.service = 0x1111;
  result.instance = 1;
  result.member = 0x8001;
  result.eventgroup = 7;
  result.major = 1;
  result.minor = sd::any_minor;
  return result;
}
/// From SOME/IP, of a service that is offered.
RoutePicture event() {
  RoutePicture result = route("event_to_topic");
  result.someip.offers = {offer(1, 1)};
  result.someip.wanted = true;
  result.dds.open = true;
  result.dds.matched = 1;
  return result;
}
RoutePicture subscribed() {
  RoutePicture result = event();
  result.someip.subscribed = true;
  return result;
}
/// From DDS, of a topic without publishers.
RoutePicture topic() {
  RoutePicture result = route("topic_to_event");
  result.dds.open = true;
  result.someip.offered = true;
  return result;
}
WriterPicture writer() {
  return {.topic = "/points", .type = "sensor_msgs/msg/PointCloud2", .node = "/lidar", .qos = {}};
}
RoutePicture published_by(const WriterPicture& writer) {
  RoutePicture result = topic();
  result.dds.writers = {writer};
  return result;
}
RoutePicture pattern() {
  RoutePicture result = route("pattern");
  result.direction = "dds_to_someip";
  return result;
}
/// Messages come now, and none is carried.
RoutePicture coming(RoutePicture route) {
  route.received = 12;
  route.last_ns = 100 * second_ns;
  route.dds.matched = 1;
  route.someip.subscribers = 1;
  return route;
}

/// The cause, and what is said of it.
std::string said(const RoutePicture& route, const Picture& picture = around()) {
  const carry::Why found = why(route, picture);
  return std::string{to_string(found.cause)} + ": " + in_words(found, &route, picture);
}

TEST(Causes, AreNoneWhereMessagesFlow) {
  RoutePicture flowing = subscribed();
  flowing.received = 9;
  flowing.carried = 9;
  EXPECT_EQ(said(flowing), "none: nothing is amiss");
  flowing.someip.subscribed = false;
  flowing.someip.offers = {};
  EXPECT_THAT(said(flowing), HasSubstr("not_offered: ")) << "nothing comes any longer";
  flowing.per_second = 10;
  EXPECT_EQ(said(flowing), "none: nothing is amiss") << "it was withdrawn just now";
}

TEST(Causes, OtherInterface) {
  Picture picture = around();
  picture.someip.other_interface = "10.0.0.1 is not that of `interface` eth1, but of eth0";
  EXPECT_EQ(said(event(), picture),
            "other_interface: `address` 10.0.0.1 is not that of `interface` eth1, but of eth0: service "
            "discovery uses another network than the other hosts");
}

TEST(Causes, OutsideSubnet) {
  Picture picture = around();
  picture.someip.discovery_received = 0;
  picture.someip.heard = 0;
  picture.someip.outside_subnet = 3;
  RoutePicture unknown = event();
  unknown.someip.offers = {};
  EXPECT_EQ(said(unknown, picture),
            "outside_subnet: SOME/IP packets come from outside of the subnet of 10.0.0.1 alone, and are not "
            "heard: is its prefix length right? `sd: {check_subnet: false}` hears them");
}

TEST(Causes, NoPacket) {
  Picture picture = around();
  picture.someip.discovery_received = 0;
  picture.someip.heard = 0;
  RoutePicture unknown = event();
  unknown.someip.offers = {};
  EXPECT_EQ(
      said(unknown, picture),
      "no_packet: no SOME/IP packet has come in on eth0 since the start: is multicast routed there, and "
      "UDP 30490 let through?");
  picture.someip.interface = "";
  EXPECT_THAT(said(unknown, picture), HasSubstr("has come in for 10.0.0.1 since the start"));
}

TEST(Causes, NotOffered) {
  for (const char* const kind : {"event_to_topic", "service_to_method"}) {
    Picture picture = around();
    EXPECT_EQ(said(route(kind), picture),
              "not_offered: nobody offers 0x1111.0x0001 (2 SOME/IP hosts were heard)");
    picture.someip.heard = 1;
    EXPECT_THAT(said(route(kind), picture), HasSubstr("(1 SOME/IP host was heard)"));
    picture.someip.heard = 0;
    EXPECT_THAT(said(route(kind), picture), HasSubstr("(no other SOME/IP host was heard)"));
  }
}

TEST(Causes, OfferedOtherwise) {
  RoutePicture other = event();
  other.someip.offers = {offer(2, 1)};
  EXPECT_EQ(said(other),
            "offered_otherwise: 0x1111.0x0001 version 1.any is not offered, but 0x1111.0x0002 version 1.0 by "
            "10.0.0.3");
  other.someip.offers = {offer(1, 2), offer(1, 3)};
  EXPECT_EQ(said(other),
            "offered_otherwise: 0x1111.0x0001 version 1.any is not offered, but 0x1111.0x0001 version 2.0 by "
            "10.0.0.3, 0x1111.0x0001 version 3.0 by 10.0.0.3");
  for (std::uint16_t i = 2; i < 1000; ++i) {
    other.someip.offers.push_back(offer(i, 1));
  }
  EXPECT_THAT(said(other), AllOf(HasSubstr(" and 996 more"), SizeIs(testing::Lt(400U))));
}

TEST(Causes, Refused) {
  RoutePicture refused = event();
  refused.someip.refused = true;
  EXPECT_EQ(said(refused), "refused: 0x1111.0x0001 is offered, but the server refuses eventgroup 0x0007");
}

TEST(Causes, OverTcpOnly) {
  RoutePicture udp = event();
  udp.someip.over_tcp_only = true;
  EXPECT_EQ(said(udp),
            "over_tcp_only: 0x1111.0x0001 is offered, but not over TCP; `transport: tcp` is wanted for "
            "eventgroup 0x0007");
}

TEST(Causes, NotAcknowledged) {
  EXPECT_EQ(said(event()),
            "not_acknowledged: 0x1111.0x0001 is offered, but the server has not answered the subscription to "
            "eventgroup 0x0007");
  RoutePicture waits = event();
  waits.someip.wanted = false;
  EXPECT_EQ(said(waits), "none: nothing is amiss") << "it waits for a reader";
}

TEST(Causes, OtherEvents) {
  RoutePicture other = subscribed();
  other.someip.other_events = 37;
  other.someip.other_ids = {0x8002};
  EXPECT_EQ(said(other), "other_events: 37 events came with id 0x8002, the route waits for 0x8001");
  other.someip.other_ids = {0x8002, 0x8003};
  EXPECT_EQ(said(other), "other_events: 37 events came with id 0x8002, 0x8003, the route waits for 0x8001");
  const carry::Why before = why(other, around());
  other.someip.other_events = 38;
  EXPECT_EQ(why(other, around()), before) << "which need not be told again";
}

TEST(Causes, NoEvent) {
  RoutePicture silent = subscribed();
  EXPECT_EQ(said(silent),
            "no_event: eventgroup 0x0007 of 0x1111.0x0001 is subscribed to, but no event has come");
  silent.received = 1;
  EXPECT_EQ(said(silent), "none: nothing is amiss") << "there may be nothing to send";
}

TEST(Causes, NotCallable) {
  RoutePicture method = route("service_to_method");
  method.someip.offers = {offer(1, 1)};
  method.transport = "tcp";
  EXPECT_EQ(
      said(method),
      "not_callable: 0x1111.0x0001 is offered, but not over tcp, or by a bridge that calls this very ROS "
      "service");
  method.transport = "";
  EXPECT_EQ(said(method),
            "not_callable: 0x1111.0x0001 is offered, but by a bridge that calls this very ROS service");
  method.dds.open = true;
  EXPECT_EQ(said(method), "none: nothing is amiss");
}

TEST(Causes, NoParticipant) {
  Picture picture = around();
  picture.dds.heard = 0;
  for (const RoutePicture& one : {topic(), route("method_to_service"), pattern()}) {
    EXPECT_EQ(
        said(one, picture),
        "no_participant: nobody else is in DDS domain 7 (`dds: {domain: ...}`, ROS_DOMAIN_ID; firewall; "
        "`interfaces`)");
  }
}

TEST(Causes, NoPublisher) {
  EXPECT_EQ(said(topic()), "no_publisher: nobody publishes it (3 participants in DDS domain 7)");
}

TEST(Causes, OtherType) {
  WriterPicture other = writer();
  other.type = "std_msgs/msg/String";
  EXPECT_EQ(said(published_by(other)),
            "other_type: it is published with type std_msgs/msg/String; the route has "
            "sensor_msgs/msg/PointCloud2");
}

TEST(Causes, RefusedType) {
  WriterPicture other = writer();
  other.refused = true;
  EXPECT_EQ(
      said(published_by(other)),
      "refused_type: a publisher is there, but is refused: its definition of the type is another (`types: "
      "strict`)");
}

TEST(Causes, OtherQos) {
  const auto of = [](auto change_route, auto change_writer) {
    WriterPicture one = writer();
    change_writer(one);
    RoutePicture asks = published_by(one);
    change_route(asks.dds.qos);
    return said(asks);
  };
  const auto nothing = [](auto&) {};
  EXPECT_EQ(of(nothing, [](WriterPicture& one) { one.qos.reliable = false; }),
            "other_qos: publisher /lidar is best effort, this route asks for reliable: write `qos: "
            "{reliability: best_effort}`");
  EXPECT_EQ(of(nothing,
               [](WriterPicture& one) {
                 one.qos.reliable = false;
                 one.node = "";
               }),
            "other_qos: publisher of /points is best effort, this route asks for reliable: write `qos: "
            "{reliability: best_effort}`");
  EXPECT_EQ(of([](carry::QosPicture& qos) { qos.transient_local = true; }, nothing),
            "other_qos: publisher /lidar is volatile, this route asks for transient_local: write `qos: "
            "{durability: volatile}`");
  EXPECT_EQ(of([](carry::QosPicture& qos) { qos.deadline_s = 0.5; }, nothing),
            "other_qos: publisher /lidar promises no deadline, this route asks for one within 0.5 s: change "
            "`qos: {deadline: ...}`");
  EXPECT_THAT(of([](carry::QosPicture& qos) { qos.deadline_s = 0.5; },
                 [](WriterPicture& one) { one.qos.deadline_s = 2; }),
              HasSubstr("promises a sample within 2 s, this route asks for one within 0.5 s"));
  EXPECT_THAT(of([](carry::QosPicture& qos) { qos.manual_liveliness = true; }, nothing),
              HasSubstr("has automatic liveliness, this route asks for manual"));
  EXPECT_THAT(of([](carry::QosPicture& qos) { qos.liveliness_s = 1; }, nothing),
              HasSubstr("promises no sign of life, this route asks for one within 1 s"));
  EXPECT_EQ(of(nothing, nothing),
            "other_qos: a publisher is there, but its quality of service does not go with the route's `qos`")
      << "by a policy that is not known here";
}

TEST(Causes, NoSample) {
  RoutePicture silent = published_by(writer());
  silent.dds.matched = 1;
  EXPECT_EQ(said(silent), "no_sample: a publisher is there, but has published nothing since");
  silent.received = 1;
  EXPECT_EQ(said(silent), "none: nothing is amiss");
}

TEST(Causes, NoRosServer) {
  RoutePicture method = route("method_to_service");
  method.type = "std_srvs/srv/SetBool";
  EXPECT_EQ(said(method),
            "no_ros_server: no ROS node answers it as std_srvs/srv/SetBool (3 participants in DDS domain 7)");
  method.dds.open = true;
  EXPECT_EQ(said(method), "none: nothing is amiss");
}

TEST(Causes, NotLocked) {
  RoutePicture inbound = pattern();
  inbound.direction = "someip_to_dds";
  EXPECT_EQ(said(inbound), "none: nothing is amiss");
  inbound.pattern.locked = false;
  inbound.pattern.lock_file = "a.lock";
  EXPECT_EQ(
      said(inbound),
      "not_locked: a.lock has no topic that matches: copy it from the bridge at the other end, and start "
      "this one again");
}

TEST(Causes, NoMatch) {
  EXPECT_EQ(said(pattern()),
            "no_match: nobody publishes a topic that matches (3 participants in DDS domain 7)");
  RoutePicture has_some = pattern();
  has_some.pattern.routes = 1;
  EXPECT_EQ(said(has_some), "none: nothing is amiss");
}

TEST(Causes, OnlyBridges) {
  RoutePicture brought = pattern();
  brought.pattern.brought = true;
  EXPECT_EQ(said(brought),
            "only_bridges: what matches is brought in by other bridges, and not carried again");
}

TEST(Causes, NoRoute) {
  RoutePicture refused = pattern();
  refused.pattern.topics = 2;
  refused.pattern.brought = true;
  EXPECT_EQ(said(refused),
            "no_route: topics that match are published, but none gets a route: the warnings before this say "
            "why");
}

TEST(Causes, ReaderQos) {
  RoutePicture unread = coming(subscribed());
  unread.dds.matched = 0;
  unread.dds.incompatible_qos = 1;
  EXPECT_EQ(
      said(unread),
      "reader_qos: 12 messages came, but who wants to read the topic asks for more than the route's `qos` "
      "offers");
}

TEST(Causes, NoReader) {
  RoutePicture unread = coming(subscribed());
  unread.dds.matched = 0;
  EXPECT_EQ(said(unread), "no_reader: 12 messages came, but nobody reads the topic");
  unread.dds.qos.transient_local = true;
  EXPECT_EQ(said(unread), "none: nothing is amiss") << "it is kept for readers that come late";
  unread.dds.qos.transient_local = false;
  unread.last_carried_ns = unread.last_ns - second_ns;
  unread.carried = 11;
  EXPECT_EQ(said(unread), "none: nothing is amiss") << "it was read a second ago";
}

TEST(Causes, NotPublished) {
  RoutePicture waits = coming(topic());
  waits.someip.offered = false;
  EXPECT_EQ(
      said(waits),
      "not_published: 0x1111.0x0001 is not offered: other topics of it have no publisher yet, and `offer: "
      "while_published` is wanted");
}

TEST(Causes, NoSubscriber) {
  RoutePicture unread = coming(topic());
  unread.someip.subscribers = 0;
  EXPECT_EQ(said(unread),
            "no_subscriber: 12 samples came, but nobody subscribes to eventgroup 0x0007 of 0x1111.0x0001 (2 "
            "SOME/IP hosts were heard)");
}

TEST(Causes, Dropped) {
  RoutePicture wrong = coming(subscribed());
  EXPECT_EQ(said(wrong), "none: nothing is amiss") << "no counter says that something was lost";
  wrong.counters = {{"received", 12, "traffic"},
                    {"refused", 99, "loss"},
                    {"too_large", 2, "loss"},
                    {"not_convertible", 10, "loss"}};
  EXPECT_EQ(said(wrong),
            "dropped: 12 messages came, but none was carried: their bytes are no message of the route's type "
            "under its `wire` rules (not_convertible)");
  wrong.carried = 1;
  wrong.last_carried_ns = wrong.last_ns - 3 * second_ns;
  EXPECT_THAT(said(wrong), HasSubstr("none of the last ones was carried"));
  wrong.counters.back() = {"something_new", 10, "loss"};
  EXPECT_THAT(said(wrong), HasSubstr("see its counters (something_new)"));
}

TEST(Causes, HaveATestEach) {
  std::set<std::string> tested;
  const auto& suites = *testing::UnitTest::GetInstance();
  for (int i = 0; i < suites.total_test_suite_count(); ++i) {
    const testing::TestSuite& suite = *suites.GetTestSuite(i);
    for (int j = 0; std::string{suite.name()} == "Causes" && j < suite.total_test_count(); ++j) {
      std::string name;  // NoPacket is no_packet
      for (const char letter : std::string{suite.GetTestInfo(j)->name()}) {
        const bool is_capital = letter >= 'A' && letter <= 'Z';
        name += is_capital && !name.empty() ? "_" : "";
        name += is_capital ? static_cast<char>(letter - 'A' + 'a') : letter;
      }
      tested.insert(name);
    }
  }
  for (const carry::CauseRow& one : carry::cause_rows()) {
    EXPECT_TRUE(tested.contains(one.name)) << one.name;
  }
}

TEST(Causes, SpeakInTheNamesOfInterfaceDescriptions) {
  carry::IdNames names;
  names.add(0x1111, 1, {"Door", {{0x8001, "moved"}}, {{7, "motion"}}});
  names.add(0x1111, 2, {"Newer", {{0x8001, "shifted"}}, {{7, "other"}}});
  const auto told = [&](RoutePicture one, const Picture& picture = around()) {
    names.name(one);
    return said(one, picture);
  };
  RoutePicture one = event();
  EXPECT_EQ(told(one),
            "not_acknowledged: Door.0x0001 is offered, but the server has not answered the subscription to "
            "eventgroup 0x0007 (motion)");
  one.someip.refused = true;
  EXPECT_EQ(told(one), "refused: Door.0x0001 is offered, but the server refuses eventgroup 0x0007 (motion)");
  one = event();
  one.someip.over_tcp_only = true;
  EXPECT_THAT(told(one), HasSubstr("is wanted for eventgroup 0x0007 (motion)"));
  EXPECT_EQ(told(subscribed()),
            "no_event: eventgroup 0x0007 (motion) of Door.0x0001 is subscribed to, but no event has come");
  one = subscribed();
  one.someip.other_events = 1;
  one.someip.other_ids = {0x8002};
  EXPECT_EQ(told(one), "other_events: 1 event came with id 0x8002, the route waits for 0x8001 (moved)");
  one = event();
  one.someip.offers = {offer(2, 2)};
  EXPECT_EQ(told(one),
            "offered_otherwise: Door.0x0001 version 1.any is not offered, but Door.0x0002 version 2.0 by "
            "10.0.0.3");
  one = coming(topic());
  one.someip.subscribers = 0;
  EXPECT_THAT(told(one), HasSubstr("nobody subscribes to eventgroup 0x0007 (motion) of Door.0x0001 ("));
  one = event();
  one.major = 3;
  EXPECT_THAT(told(one), HasSubstr("0x1111.0x0001 version 3.any is not offered"))
      << "the description has no such version";
}

TEST(Causes, OfManyRoutesAreToldWithoutWhatIsTheirOwn) {
  const auto of_all = [](const RoutePicture& one) { return in_words(why(one, around()), nullptr, around()); };
  EXPECT_EQ(of_all(route("event_to_topic")), "nobody offers their services (2 SOME/IP hosts were heard)");
  EXPECT_EQ(of_all(topic()), "nobody publishes them (3 participants in DDS domain 7)");
  EXPECT_EQ(of_all(event()),
            "their services are offered, but the servers have not answered the subscriptions");
  RoutePicture other = subscribed();
  other.someip.other_events = 1;
  EXPECT_EQ(of_all(other), "events with other ids came");
  EXPECT_EQ(of_all(coming(topic())), "nothing is amiss");
  for (const carry::CauseRow& one : carry::cause_rows()) {
    const std::string words = in_words({one.cause, ""}, nullptr, around());
    EXPECT_FALSE(words.empty()) << one.name;
    EXPECT_EQ(words.find("0x1111"), std::string::npos) << words;
  }
}

TEST(Causes, GiveEachRouteOfAPictureItsState) {
  Picture picture = around();
  RoutePicture flowing = subscribed();
  flowing.per_second = 10;
  RoutePicture idle = subscribed();
  idle.received = 1;
  RoutePicture failing = coming(subscribed());
  failing.counters = {{"too_large", 2, "loss"}};
  picture.routes = {flowing, idle, topic(), failing};
  explain(picture);
  EXPECT_EQ(picture.routes[0].state, RouteState::flowing);
  EXPECT_EQ(picture.routes[0].cause.words, "");
  EXPECT_EQ(picture.routes[1].state, RouteState::idle);
  EXPECT_EQ(picture.routes[2].state, RouteState::waiting);
  EXPECT_EQ(picture.routes[2].cause.name, "no_publisher");
  EXPECT_EQ(picture.routes[2].cause.words, "nobody publishes it (3 participants in DDS domain 7)");
  EXPECT_EQ(picture.routes[3].state, RouteState::failing);
}

}  // namespace
}  // namespace trestle::test::causes_test
