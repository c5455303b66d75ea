// What is said about routes that contradict each other, and about what is allowed but odd.
#include <gmock/gmock.h>

#include "test/bridge/carry/config/problems_of.hpp"
#include "test/covers.hpp"

namespace trestle::test::conflicts_test {
namespace {

using namespace carry;
using testing::ElementsAre;

// Two routes that differ in what a test gives them.
std::string two_routes(const std::string& first, const std::string& second) {
  const std::string common = "type: std_msgs/msg/String, eventgroup: 1, ";
  return "someip: {address: 127.0.0.1}\nroutes:\n  - {" + first + ", " + common + "major: 1}\n  - {" +
         second + ", " + common + "major: 1}\n";
}

TEST(ConfigConflict, OfOneTopicRoutedTwice) {
  EXPECT_THAT(
      problems_of(two_routes(
          "topic: /a, service: 1, instance: 1, event: 0x8001, direction: dds_to_someip, port: 40000",
          "topic: /a, service: 2, instance: 1, event: 0x8001, direction: dds_to_someip, port: 40000")),
      ElementsAre("b.yaml:4:13: error: topic: /a is already routed dds_to_someip by the route in line 3"));
}

TEST(ConfigConflict, OfOneTopicWithTwoTypes) {
  EXPECT_THAT(problems_of(R"(someip: {address: 127.0.0.1}
routes:
  - {topic: /a, type: std_msgs/msg/Bool, direction: someip_to_dds, service: 1, instance: 1, eventgroup: 1, event: 0x8001}
  - {topic: /a, type: std_msgs/msg/Byte, direction: dds_to_someip, service: 2, instance: 1, eventgroup: 1, event: 0x8001, port: 40000}
)"),
              ElementsAre("b.yaml:4:23: error: type: /a is std_msgs/msg/Bool in the route in line 3"));
}

TEST(ConfigConflict, OfOneEventRoutedTwice) {
  EXPECT_THAT(
      problems_of(two_routes("topic: /a, service: 1, instance: 1, event: 0x8001, direction: someip_to_dds",
                             "topic: /b, service: 1, instance: 1, event: 0x8001, direction: someip_to_dds")),
      ElementsAre(
          "b.yaml:4:49: error: event: service 0x0001 instance 0x0001 event 0x8001 is already routed by the "
          "route in line 3"));
}

TEST(ConfigConflict, OfAnEventThatWouldComeBack) {
  EXPECT_THAT(
      problems_of(two_routes(
          "topic: /a, service: 1, instance: 1, event: 0x8001, direction: someip_to_dds",
          "topic: /b, service: 1, instance: 1, event: 0x8001, direction: dds_to_someip, port: 40000")),
      ElementsAre(
          "b.yaml:4:49: error: event: service 0x0001 instance 0x0001 event 0x8001 is also routed the other "
          "way, so it would come back here, by the route in line 3"));
}

TEST(ConfigConflict, OfOneServiceAtTwoPortsOrVersions) {
  EXPECT_THAT(
      problems_of(two_routes("topic: /a, service: 1, instance: 1, event: 0x8001, direction: dds_to_someip, "
                             "port: 40000, minor: 1",
                             "topic: /b, service: 1, instance: 1, event: 0x8002, direction: dds_to_someip, "
                             "port: 40001, minor: 2")),
      ElementsAre("b.yaml:4:89: error: port: service 0x0001 instance 0x0001 has 40000 in the route in line 3",
                  "b.yaml:4:103: error: minor: service 0x0001 instance 0x0001 has 1 in the route in line 3"));
}

TEST(ConfigConflict, OfOneEventgroupSentTwoWays) {
  EXPECT_THAT(
      problems_of(two_routes("topic: /a, service: 1, instance: 1, event: 0x8001, direction: dds_to_someip, "
                             "port: 40000, multicast: {address: 239.0.0.1, port: 1}",
                             "topic: /b, service: 1, instance: 1, event: 0x8002, direction: dds_to_someip, "
                             "port: 40000, multicast: {address: 239.0.0.1, port: 2}")),
      ElementsAre(
          "b.yaml:4:107: error: multicast: service 0x0001 instance 0x0001 eventgroup 0x0001 has another "
          "in the route in line 3"));
}

TEST(ConfigConflict, OfTwoInstancesAtOnePort) {
  covers({"feat_req_someip_445", "feat_req_someip_967", "feat_req_someipsd_782"});
  EXPECT_THAT(
      problems_of(two_routes(
          "topic: /a, service: 1, instance: 1, event: 0x8001, direction: dds_to_someip, port: 40000",
          "topic: /b, service: 1, instance: 2, event: 0x8001, direction: dds_to_someip, port: 40000")),
      ElementsAre(
          "b.yaml:4:89: error: port: 40000 already belongs to service 0x0001 instance 0x0001 (line 3); "
          "instances of one service need ports of their own"));
}

TEST(ConfigConflict, OfAPortUsedBothWays) {
  EXPECT_THAT(
      problems_of(two_routes(
          "topic: /a, service: 1, instance: 1, event: 0x8001, direction: dds_to_someip, port: 40000",
          "topic: /b, service: 2, instance: 1, event: 0x8001, direction: someip_to_dds, port: 40000")),
      ElementsAre("b.yaml:4:89: error: port: 40000 is used the other way (dds_to_someip) by the route in "
                  "line 3; take "
                  "two ports"));
}

TEST(ConfigConflict, WithThePortOfServiceDiscovery) {
  covers({"feat_req_someip_676"});
  EXPECT_THAT(problems_of(two_routes(
                  "topic: /a, service: 1, instance: 1, event: 0x8001, direction: dds_to_someip, port: 30490",
                  "topic: /b, service: 2, instance: 1, event: 0x8001, direction: someip_to_dds")),
              ElementsAre("b.yaml:3:89: error: port: 30490 is service discovery's own port"));
}

TEST(ConfigConflict, OfMergedKeysIsReportedWhereTheyAreMergedIn) {
  EXPECT_THAT(
      problems_of(R"(someip: {address: 127.0.0.1}
routes:
  - &a {topic: /a, type: std_msgs/msg/Bool, direction: someip_to_dds, service: 1, instance: 1, eventgroup: 1, event: 0x8001}
  - topic: /b
    <<: *a
)"),
      ElementsAre(
          "b.yaml:5:5: error: event: service 0x0001 instance 0x0001 event 0x8001 is already routed by "
          "the route in line 3"));
}

TEST(ConfigConflict, IsNotSoughtInWhatCouldNotBeRead) {
  // Both services are wrong, and would be the same if they were taken as they are by default.
  EXPECT_THAT(
      problems_of(two_routes("topic: /a, service: x, instance: 1, event: 0x8001, direction: someip_to_dds",
                             "topic: /b, service: y, instance: 1, event: 0x8001, direction: someip_to_dds")),
      ElementsAre("b.yaml:3:26: error: service: expected an id from 0x0001 to 0xfffd, found 'x'",
                  "b.yaml:4:26: error: service: expected an id from 0x0001 to 0xfffd, found 'y'"));
}

TEST(ConfigWarning, ForAnEventIdThatLooksLikeAMethod) {
  covers({"feat_req_someip_626"});
  const auto loaded = parse_config(replaced(good_config, "0x8044", "0x0044"), "b.yaml");
  ASSERT_TRUE(loaded.has_value());
  EXPECT_THAT(lines(loaded->warnings),
              ElementsAre("b.yaml:30:12: warning: event: ids below 0x8000 are meant for methods; is "
                          "this the one the peer uses?"));
}

TEST(ConfigWarning, ForOffersThatExpireBeforeTheyAreRenewed) {
  const auto loaded = parse_config(replaced(good_config, "10 s", "2 s"), "b.yaml");
  ASSERT_TRUE(loaded.has_value());
  EXPECT_THAT(lines(loaded->warnings),
              ElementsAre("b.yaml:14:10: warning: ttl: offers live 2 s but are renewed only every 2 s "
                          "(cyclic_offer_delay)"));
}

}  // namespace
}  // namespace trestle::test::conflicts_test
