// Methods: ROS services joined with SOME/IP methods.
#include <gmock/gmock.h>

#include "bridge/carry/commands/summary.hpp"
#include "test/bridge/carry/config/problems_of.hpp"
#include "test/covers.hpp"

namespace trestle::test::methods_test {
namespace {

using namespace carry;
using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

const std::string two_methods = R"(someip: {address: 192.0.2.1}
methods:
  - ros_service: /arm/set_mode
    type: std_srvs/srv/SetBool
    server: ros
    service: 0x1111
    instance: 0x0022
    method: 0x0044
    major: 5
    minor: 6
    transport: tcp
    port: 40001
    offer: always
    fire_and_forget: true
    timeout: 250 ms
    max_calls: 7
    max_message: 8 KiB
    tp: {segment_bytes: 160, burst: 4, separation: 2 ms}
    ros_form: cyclonedds
    wire: {string_length: 16, types: {std_srvs/srv/SetBool_Request: {tags: {data: 1}}}}
  - ros_service: /reset
    type: std_srvs/srv/Trigger
    server: someip
    service: 0x2222
    instance: 1
    method: 2
)";

TEST(LoadMethods, ReadsEveryKey) {
  covers({"feat_req_someip_625"});
  const BridgeConfig config = config_of(two_methods);
  EXPECT_THAT(config.routes, SizeIs(0));
  ASSERT_THAT(config.methods, SizeIs(2));
  const MethodRoute& method = config.methods[0];
  EXPECT_EQ(method.ros_service, "/arm/set_mode");
  EXPECT_EQ(method.type, "std_srvs/srv/SetBool");
  EXPECT_EQ(method.server, Server::ros);
  EXPECT_EQ(method.service, someip::ServiceId{0x1111});
  EXPECT_EQ(method.instance, someip::InstanceId{0x22});
  EXPECT_EQ(method.method, someip::MethodId{0x44});
  EXPECT_EQ(method.major, 5);
  EXPECT_EQ(method.minor, 6U);
  EXPECT_EQ(method.transport, Transport::tcp);
  EXPECT_EQ(method.port, 40001);
  EXPECT_TRUE(method.offer_always);
  EXPECT_TRUE(method.fire_and_forget);
  EXPECT_EQ(method.timeout, 250ms);
  EXPECT_EQ(method.max_calls, 7U);
  EXPECT_EQ(method.tp, (TpSettings{{.segment_bytes = 160, .burst = 4, .separation = 2ms}, 8192}));
  EXPECT_EQ(method.form, ServiceForm::cyclonedds);
  EXPECT_EQ(method.rules.payload.string_length, someip::FieldWidth::bits16);
  EXPECT_TRUE(method.rules.types.contains("std_srvs/srv/SetBool_Request"));
  EXPECT_EQ(method.mark, (documents::Mark{3, 5}));
}

TEST(LoadMethods, HasDefaults) {
  const MethodRoute method = config_of(two_methods).methods.at(1);
  EXPECT_EQ(method.server, Server::someip);
  EXPECT_EQ(method.major, 1);
  EXPECT_EQ(method.minor, 0xffff'ffffU);
  EXPECT_EQ(method.transport, std::nullopt);
  EXPECT_FALSE(method.offer_always);
  EXPECT_FALSE(method.fire_and_forget);
  EXPECT_EQ(method.timeout, 5s);
  EXPECT_EQ(method.max_calls, 256U);
  EXPECT_EQ(method.tp, TpSettings{});
  EXPECT_EQ(method.form, ServiceForm::automatic);
  EXPECT_EQ(method.rules, messages::MessageRules{});
}

TEST(LoadMethods, NamesThePlaceOfWhatIsWrong) {
  EXPECT_THAT(
      problems_of(R"(someip: {address: 192.0.2.1}
methods:
  - ros_service: arm
    type: std_msgs/msg/Bool
    server: both
    service: 0
    instance: 0xffff
    method: 0
    major: 255
    timeout: 2 h
    max_calls: 0
    max_message: 1
    ros_form: fast
    offer: never
    fire_and_forget: yes
    transport: sctp
    event: 7
)"),
      ElementsAre("b.yaml:3:18: error: ros_service: expected a service such as /arm/set_mode (absolute; "
                  "letters, digits, '_'), found 'arm'",
                  "b.yaml:4:11: error: type: expected a service type such as std_srvs/srv/SetBool, found "
                  "'std_msgs/msg/Bool'",
                  "b.yaml:5:13: error: server: expected one of someip, ros, found 'both'",
                  "b.yaml:6:14: error: service: expected an id from 0x0001 to 0xfffd, found '0'",
                  "b.yaml:7:15: error: instance: expected an id from 0x0001 to 0xfffe, found '0xffff'",
                  "b.yaml:8:13: error: method: expected an id from 0x0001 to 0xfffe, found '0'",
                  HasSubstr("b.yaml:9:12: error: major: expected"),
                  HasSubstr("b.yaml:10:14: error: timeout: expected"),
                  HasSubstr("b.yaml:11:16: error: max_calls: expected"),
                  HasSubstr("b.yaml:12:18: error: max_message: expected"),
                  "b.yaml:13:15: error: ros_form: expected one of auto, fastrtps, cyclonedds, found 'fast'",
                  "b.yaml:14:12: error: offer: expected one of while_served, always, found 'never'",
                  HasSubstr("b.yaml:15:22: error: fire_and_forget: expected"),
                  "b.yaml:16:16: error: transport: expected one of udp, tcp, found 'sctp'",
                  HasSubstr("b.yaml:17:5: error: unknown key 'event' in method")));
}

// A method with what a test gives it, in line `3 + n` for the n-th.
std::string methods_of(const std::vector<std::string>& each) {
  std::string text = "someip: {address: 127.0.0.1}\nmethods:\n";
  for (const std::string& one : each) {
    text.append("  - {type: std_srvs/srv/Trigger, ").append(one).append("}\n");
  }
  return text;
}

TEST(LoadMethods, NeedAPortWhereTheyAreOffered) {
  EXPECT_THAT(
      problems_of(methods_of({"ros_service: /a, server: ros, service: 1, instance: 1, method: 1"})),
      ElementsAre("b.yaml:3:5: error: method: 'port' is missing: expected a whole number from 1 to 65535"));
  EXPECT_THAT(problems_of(methods_of(
                  {"ros_service: /a, server: someip, service: 1, instance: 1, method: 1, port: 40000"})),
              ElementsAre(HasSubstr("error: port: is where we offer a method, with server: ros")));
  EXPECT_THAT(
      problems_of(methods_of(
          {"ros_service: /a, server: ros, service: 1, instance: 1, method: 1, port: 40000, minor: any"})),
      ElementsAre(HasSubstr("error: minor: expected a whole number")));
}

TEST(LoadMethods, AreOfferedByUsOrNotAtAll) {
  EXPECT_THAT(problems_of(methods_of(
                  {"ros_service: /a, server: someip, service: 1, instance: 1, method: 1, offer: always"})),
              ElementsAre(HasSubstr("error: offer: is for methods with server: ros")));
}

TEST(LoadMethods, WarnsOfIdsThatAreMeantForEvents) {
  covers({"feat_req_someip_626"});
  const auto loaded = parse_config(
      methods_of({"ros_service: /a, server: someip, service: 1, instance: 1, method: 0x8000"}), "b.yaml");
  ASSERT_TRUE(loaded);
  EXPECT_THAT(
      lines(loaded->warnings),
      ElementsAre("b.yaml:3:100: warning: method: ids from 0x8000 on are meant for events; is this the "
                  "one the peer uses?"));
}

TEST(LoadMethods, AreNotNeededBesideRoutesButOneOfBothIs) {
  EXPECT_THAT(problems_of("someip: {address: 127.0.0.1}\n"),
              ElementsAre("b.yaml:1:1: error: 'routes' is missing: expected a list of routes"));
  EXPECT_THAT(problems_of("someip: {address: 127.0.0.1}\nmethods: []\n"),
              ElementsAre("b.yaml:2:10: error: methods: expected a list of methods, found an empty list"));
}

TEST(LoadMethods, AsksAboutTheirTypes) {
  std::vector<std::string> asked;
  const TypeCheck check = [&](const TypeUse& use, const messages::MessageRules&,
                              const messages::TypePlaces&) {
    asked.push_back(use.type);
    return TypeVerdict{"there is none"};
  };
  EXPECT_THAT(problems_of(two_methods, check), ElementsAre("b.yaml:4:11: error: type: there is none",
                                                           "b.yaml:22:11: error: type: there is none"));
  EXPECT_THAT(asked, ElementsAre("std_srvs/srv/SetBool", "std_srvs/srv/Trigger"));
}

TEST(MethodConflict, OfOneRosService) {
  EXPECT_THAT(
      problems_of(methods_of({"ros_service: /a, server: someip, service: 1, instance: 1, method: 1",
                              "ros_service: /a, server: someip, service: 1, instance: 1, method: 2"})),
      ElementsAre("b.yaml:4:47: error: ros_service: /a already belongs to the method in line 3"));
}

TEST(MethodConflict, OfOneId) {
  EXPECT_THAT(
      problems_of(methods_of({"ros_service: /a, server: someip, service: 1, instance: 1, method: 1",
                              "ros_service: /b, server: someip, service: 1, instance: 1, method: 2",
                              "ros_service: /c, server: someip, service: 1, instance: 1, method: 2"})),
      ElementsAre(HasSubstr(
          "b.yaml:5:100: error: method: service 0x0001 instance 0x0001 id 0x0002 already belongs to "
          "the method in line 4")));
}

TEST(MethodConflict, OfAServiceThatIsOursAndNot) {
  EXPECT_THAT(problems_of(methods_of(
                  {"ros_service: /a, server: someip, service: 1, instance: 1, method: 1",
                   "ros_service: /b, server: ros, service: 1, instance: 1, method: 2, port: 40000"})),
              ElementsAre(HasSubstr(
                  "error: server: service 0x0001 instance 0x0001 is used by the method in line 3")));
}

TEST(MethodConflict, OfWhatOneServiceHasOnce) {
  EXPECT_THAT(problems_of(methods_of({"ros_service: /a, server: ros, service: 1, instance: 1, method: 1, "
                                      "port: 40000, major: 1, minor: 2",
                                      "ros_service: /b, server: ros, service: 1, instance: 1, method: 2, "
                                      "port: 40001, major: 2, minor: 3"})),
              ElementsAre(HasSubstr("port: service 0x0001 instance 0x0001 has 40000 in the method in line 3"),
                          HasSubstr("major: service 0x0001 instance 0x0001 has 1 in the method in line 3"),
                          HasSubstr("minor: service 0x0001 instance 0x0001 has 2 in the method in line 3")));
}

TEST(MethodConflict, OfPorts) {
  covers({"feat_req_someip_445", "feat_req_someip_676"});
  EXPECT_THAT(problems_of(methods_of(
                  {"ros_service: /a, server: ros, service: 1, instance: 1, method: 1, port: 30490"})),
              ElementsAre(HasSubstr("error: port: 30490 is service discovery's own port")));
  EXPECT_THAT(problems_of(methods_of(
                  {"ros_service: /a, server: ros, service: 1, instance: 1, method: 1, port: 40000",
                   "ros_service: /b, server: ros, service: 1, instance: 2, method: 1, port: 40000"})),
              ElementsAre(HasSubstr(
                  "error: port: 40000 already belongs to service 0x0001 instance 0x0001 (line 3); instances "
                  "of one service need ports of their own")));
}

TEST(MethodConflict, WithARoute) {
  const std::string text = R"(someip: {address: 127.0.0.1}
routes:
  - {topic: /a, type: std_msgs/msg/Bool, direction: dds_to_someip, service: 1, instance: 1, eventgroup: 1, event: 0x8001, port: 40000}
  - {topic: /b, type: std_msgs/msg/Bool, direction: someip_to_dds, service: 2, instance: 1, eventgroup: 1, event: 0x8001, port: 40001}
methods:
  - {ros_service: /c, type: std_srvs/srv/Trigger, server: ros, service: 1, instance: 1, method: 2, port: 40002}
  - {ros_service: /d, type: std_srvs/srv/Trigger, server: ros, service: 3, instance: 1, method: 2, port: 40001}
)";
  EXPECT_THAT(
      problems_of(text),
      ElementsAre(
          HasSubstr("b.yaml:6:106: error: port: service 0x0001 instance 0x0001 has 40000 in the route "
                    "in line 3"),
          HasSubstr("b.yaml:7:106: error: port: 40001 is used the other way by the route in line 4")));
  const std::string id = replaced(replaced(text, "method: 2, port: 40002", "method: 0x8001, port: 40000"),
                                  "method: 2, port: 40001", "method: 2, port: 40003");
  EXPECT_THAT(problems_of(id), testing::Contains(HasSubstr(
                                   "method: service 0x0001 instance 0x0001 id 0x8001 already belongs to the "
                                   "route in line 3")));
}

TEST(MethodDiagnostics, ArePublishedWhereTheyAreWanted) {
  const std::string wanted = two_methods + "diagnostics: {topic: /d}\n";
  EXPECT_THAT(summary(config_of(wanted), {}),
              HasSubstr("methods are published on /d, every 1 s and when a state changes\n"));
  EXPECT_THAT(summary(config_of(two_methods), {}), testing::Not(HasSubstr("are published on")));
  const std::string route =
      "routes: [{topic: /d, type: std_msgs/msg/String, direction: someip_to_dds, service: 7, instance: 1, "
      "eventgroup: 1, event: 0x8001}]\n";
  EXPECT_THAT(problems_of(wanted + route),
              ElementsAre(HasSubstr("type: /d is where the diagnostics of this bridge are published")));
  EXPECT_TRUE(parse_config(two_methods + route, "b.yaml"));
}

TEST(MethodSummary, ShowsWhatGoesWhere) {
  EXPECT_THAT(summary(config_of(two_methods), {}), testing::StartsWith("b.yaml: good, 2 methods\n"));
  EXPECT_THAT(summary(config_of(two_methods), {}), HasSubstr(R"(
  ROS SERVICE        SERVICE.INSTANCE  METHOD  VERSION  PORT        TYPE
  /arm/set_mode  <-  0x1111.0x0022     0x0044  5.6      tcp 40001   std_srvs/srv/SetBool
  /reset         ->  0x2222.0x0001     0x0002  1.any    as offered  std_srvs/srv/Trigger

)"));
  EXPECT_THAT(summary(config_of(two_methods), {}),
              HasSubstr("calls always offered, no answer, at most 7 at once, ROS form of rmw_cyclonedds\n"
                        "          for /arm/set_mode\n"));
  EXPECT_THAT(summary(config_of(two_methods), {}),
              HasSubstr("calls answer within 5 s, at most 256 at once, ROS form as the peer's\n"
                        "          for /reset\n"));
  EXPECT_THAT(summary(config_of(two_methods), {}),
              HasSubstr("TP    segments of 160 bytes, 2 ms after every 4, messages up to 8 KiB\n"
                        "          for /arm/set_mode\n"));
}

}  // namespace
}  // namespace trestle::test::methods_test
