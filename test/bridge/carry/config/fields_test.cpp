// Fields: each is a route, and up to two methods.
#include <gmock/gmock.h>

#include "bridge/carry/commands/field_packages.hpp"
#include "bridge/carry/commands/summary.hpp"
#include "bridge/carry/config/load.hpp"
#include "test/bridge/carry/config/problems_of.hpp"
#include "test/covers.hpp"

namespace trestle::test::fields_test {
namespace {

using namespace carry;
using namespace std::chrono_literals;
using someip::MethodId;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;
using testing::SizeIs;

const std::string of_ros = R"(someip: {address: 192.0.2.1}
fields:
  - topic: /cabin/light
    type: std_msgs/msg/Float64
    server: ros
    service: 0x1111
    instance: 0x0022
    event: 0x8044
    eventgroup: 0x0003
    getter: 0x0041
    setter: 0x0042
    get_service: /cabin/get_light
    set_service: /cabin/set_light
    get_type: cabin_msgs/srv/GetLight
    set_type: cabin_msgs/srv/SetLight
    major: 5
    minor: 6
    transport: tcp
    port: 40001
    offer: always
    timeout: 250 ms
    max_calls: 7
    max_message: 8 KiB
    tp: {segment_bytes: 160, burst: 4, separation: 2 ms}
    ros_form: cyclonedds
    wire: {byte_order: little}
)";

const std::string of_someip = R"(someip: {address: 192.0.2.1}
fields:
  - topic: /light
    type: std_msgs/msg/Float64
    server: someip
    service: 0x1111
    instance: 0x0022
    event: 0x8044
    eventgroup: 0x0003
    getter: 0x0041
    setter: 0x0042
)";

/// What is said about `base` with the first `what` turned into something else.
std::vector<std::string> changed(const std::string& base, const std::string& what, const std::string& into) {
  return problems_of(replaced(base, what, into));
}

TEST(LoadFields, AreALatchedTopicAndTwoServices) {
  covers({"feat_req_someip_631"});
  const BridgeConfig config = config_of(of_ros);
  ASSERT_THAT(config.routes, SizeIs(1));
  const Route& route = config.routes[0];
  EXPECT_EQ(route.topic, "/cabin/light");
  EXPECT_EQ(route.type, "std_msgs/msg/Float64");
  EXPECT_EQ(route.direction, Direction::dds_to_someip);
  EXPECT_EQ(route.service, someip::ServiceId{0x1111});
  EXPECT_EQ(route.instance, someip::InstanceId{0x22});
  EXPECT_EQ(route.event, MethodId{0x8044});
  EXPECT_EQ(route.eventgroup, someip::EventgroupId{3});
  EXPECT_EQ(route.getter, std::nullopt);
  EXPECT_EQ(route.major, 5);
  EXPECT_EQ(route.minor, 6U);
  EXPECT_EQ(route.transport, Transport::tcp);
  EXPECT_EQ(route.port, 40001);
  EXPECT_EQ(route.qos, (QosSettings{{.reliable = true, .transient_local = true, .depth = 1}}));
  EXPECT_EQ(route.presence, Presence{});
  EXPECT_EQ(route.tp, (TpSettings{{.segment_bytes = 160, .burst = 4, .separation = 2ms}, 8192}));
  EXPECT_EQ(route.rules.payload.byte_order, std::endian::little);
  EXPECT_EQ(route.mark, (documents::Mark{3, 5}));

  ASSERT_THAT(config.methods, SizeIs(2));
  for (const MethodRoute& method : config.methods) {
    EXPECT_EQ(method.value_type, "std_msgs/msg/Float64");
    EXPECT_EQ(method.server, Server::ros);
    EXPECT_EQ(method.service, someip::ServiceId{0x1111});
    EXPECT_EQ(method.instance, someip::InstanceId{0x22});
    EXPECT_EQ(method.major, 5);
    EXPECT_EQ(method.minor, 6U);
    EXPECT_EQ(method.transport, Transport::tcp);
    EXPECT_EQ(method.port, 40001);
    EXPECT_TRUE(method.offer_always);
    EXPECT_EQ(method.timeout, Duration{250ms});
    EXPECT_EQ(method.max_calls, 7U);
    EXPECT_EQ(method.tp, (TpSettings{{.segment_bytes = 160, .burst = 4, .separation = 2ms}, 8192}));
    EXPECT_EQ(method.form, ServiceForm::cyclonedds);
    EXPECT_EQ(method.rules.payload.byte_order, std::endian::little);
    EXPECT_EQ(method.mark, (documents::Mark{3, 5}));
  }
  EXPECT_EQ(config.methods[0].access, messages::FieldAccess::get);
  EXPECT_EQ(config.methods[0].method, MethodId{0x41});
  EXPECT_EQ(config.methods[0].ros_service, "/cabin/get_light");
  EXPECT_EQ(config.methods[0].type, "cabin_msgs/srv/GetLight");
  EXPECT_EQ(config.methods[1].access, messages::FieldAccess::set);
  EXPECT_EQ(config.methods[1].method, MethodId{0x42});
  EXPECT_EQ(config.methods[1].ros_service, "/cabin/set_light");
  EXPECT_EQ(config.methods[1].type, "cabin_msgs/srv/SetLight");
}

TEST(LoadFields, OfASomeipServerAreThereWhileItIs) {
  const BridgeConfig config = config_of(of_someip);
  ASSERT_THAT(config.routes, SizeIs(1));
  EXPECT_EQ(config.routes[0].direction, Direction::someip_to_dds);
  EXPECT_EQ(config.routes[0].presence, Presence{.write_while_offered = true});
  EXPECT_EQ(config.routes[0].minor, sd::any_minor);
  EXPECT_EQ(config.routes[0].transport, Transport::udp);
  ASSERT_THAT(config.methods, SizeIs(2));
  EXPECT_EQ(config.methods[0].ros_service, "/light/get");
  EXPECT_EQ(config.methods[0].type, "std_msgs_fields/srv/GetFloat64");
  EXPECT_EQ(config.methods[1].ros_service, "/light/set");
  EXPECT_EQ(config.methods[1].type, "std_msgs_fields/srv/SetFloat64");
  for (const MethodRoute& method : config.methods) {
    EXPECT_EQ(method.server, Server::someip);
    EXPECT_EQ(method.transport, std::nullopt);
    EXPECT_EQ(method.minor, sd::any_minor);
  }
}

TEST(LoadFields, OfRosAreOfferedWhileServedAndAnswerTheGetterWithTheLastSample) {
  const BridgeConfig config =
      config_of(replaced(of_someip, "server: someip", "server: ros\n    port: 40001"));
  ASSERT_THAT(config.routes, SizeIs(1));
  EXPECT_EQ(config.routes[0].getter, (FieldGetter{MethodId{0x41}, std::nullopt}));
  EXPECT_EQ(config.routes[0].presence, Presence{.offer_while_published = true});
  ASSERT_THAT(config.methods, SizeIs(1));
  EXPECT_EQ(config.methods[0].access, messages::FieldAccess::set);
  EXPECT_EQ(config.methods[0].transport, Transport::udp);
  EXPECT_FALSE(config.methods[0].offer_always);
  // A service that is named is asked, and so is one where there is no topic to know the value from.
  for (const char* more : {"get_service: /light/get", "get_type: std_msgs_fields/srv/GetFloat64"}) {
    const BridgeConfig named = config_of(
        replaced(of_someip, "server: someip", std::string{"server: ros\n    port: 40001\n    "} + more));
    EXPECT_EQ(named.routes.at(0).getter, std::nullopt);
    ASSERT_THAT(named.methods, SizeIs(2));
    EXPECT_EQ(named.methods[0].ros_service, "/light/get");
    EXPECT_EQ(named.methods[0].type, "std_msgs_fields/srv/GetFloat64");
  }
  const BridgeConfig silent =
      config_of(replaced(replaced(of_someip, "server: someip", "server: ros\n    port: 40001"),
                         "    event: 0x8044\n    eventgroup: 0x0003\n", ""));
  EXPECT_THAT(silent.routes, IsEmpty());
  ASSERT_THAT(silent.methods, SizeIs(2));
  EXPECT_EQ(silent.methods[0].ros_service, "/light/get");
}

TEST(LoadFields, HaveAnyOfTheirParts) {
  covers({"feat_req_someip_631", "feat_req_someip_632"});
  const BridgeConfig told = config_of(replaced(of_someip, "    getter: 0x0041\n    setter: 0x0042\n", ""));
  EXPECT_THAT(told.routes, SizeIs(1));
  EXPECT_THAT(told.methods, IsEmpty());
  const BridgeConfig set =
      config_of(replaced(of_someip, "    event: 0x8044\n    eventgroup: 0x0003\n    getter: 0x0041\n", ""));
  EXPECT_THAT(set.routes, IsEmpty());
  ASSERT_THAT(set.methods, SizeIs(1));
  EXPECT_EQ(set.methods[0].access, messages::FieldAccess::set);
  EXPECT_EQ(set.methods[0].getter, std::nullopt);
  EXPECT_EQ(set.methods[0].notifier, std::nullopt);
  const BridgeConfig both = config_of(replaced(of_someip, "    getter: 0x0041\n", ""));
  ASSERT_THAT(both.methods, SizeIs(1));
  EXPECT_EQ(both.methods[0].access, messages::FieldAccess::set);
  EXPECT_EQ(both.methods[0].notifier, MethodId{0x8044});
  EXPECT_THAT(
      changed(of_someip,
              "    event: 0x8044\n    eventgroup: 0x0003\n    getter: 0x0041\n    setter: 0x0042\n", ""),
      ElementsAre("b.yaml:3:5: error: a field needs at least one of 'event', 'getter' and 'setter'"));
}

TEST(LoadFields, NameWhatIsWrong) {
  EXPECT_THAT(changed(of_ros, "std_msgs/msg/Float64", "std_msgs/srv/Float64"),
              ElementsAre(HasSubstr("b.yaml:4:11: error: type: expected a message type such as")));
  EXPECT_THAT(
      changed(of_ros, "    port: 40001\n", ""),
      ElementsAre("b.yaml:3:5: error: field: 'port' is missing: expected a whole number from 1 to 65535"));
  EXPECT_THAT(
      changed(of_someip, "server: someip", "server: someip\n    port: 40001"),
      ElementsAre(HasSubstr("b.yaml:6:11: error: port: is where we offer a field, with server: ros")));
  EXPECT_THAT(changed(of_someip, "server: someip", "server: someip\n    offer: always"),
              ElementsAre("b.yaml:6:12: error: offer: is for fields with server: ros"));
  EXPECT_THAT(changed(of_someip, "server: someip", "server: someip\n    tp: {segment_bytes: 100}"),
              ElementsAre(HasSubstr("b.yaml:6:25: error: segment_bytes: expected a multiple of 16")));
  EXPECT_THAT(changed(of_someip, "server: someip", "server: someip\n    tp: {max_message: 1 MiB}"),
              ElementsAre(HasSubstr("b.yaml:6:10: error: unknown key 'max_message' in tp")));
  EXPECT_THAT(changed(of_someip, "    eventgroup: 0x0003\n", ""),
              ElementsAre(HasSubstr("b.yaml:3:5: error: field: 'eventgroup' is missing")));
  EXPECT_THAT(changed(of_someip, "    event: 0x8044\n", ""),
              ElementsAre("b.yaml:8:17: error: eventgroup: belongs to the `event`, which is missing"));
  EXPECT_THAT(changed(of_someip, "event: 0x8044", "event: 0x18044"),
              ElementsAre(HasSubstr("b.yaml:8:12: error: event: expected an id from 0x0001 to 0xfffe")));
  EXPECT_THAT(changed(of_someip, "setter: 0x0042", "setter: 0"),
              ElementsAre(HasSubstr("b.yaml:11:13: error: setter: expected an id from 0x0001 to 0xfffe")));
  EXPECT_THAT(changed(of_someip, "    setter: 0x0042\n", "    set_service: /a\n    set_type: a/srv/B\n"),
              ElementsAre("b.yaml:11:18: error: set_service: belongs to the `setter`, which is missing",
                          "b.yaml:12:15: error: set_type: belongs to the `setter`, which is missing"));
  EXPECT_THAT(changed(of_ros, "/cabin/get_light", "cabin"),
              ElementsAre(HasSubstr("b.yaml:12:18: error: get_service: expected a service such as")));
  EXPECT_THAT(changed(of_ros, "cabin_msgs/srv/SetLight", "cabin_msgs/msg/SetLight"),
              ElementsAre(HasSubstr("b.yaml:15:15: error: set_type: expected a service type such as")));
  EXPECT_THAT(changed(of_ros, "    setter: 0x0042\n", "    settre: 0x0042\n    setter: 0x0042\n"),
              ElementsAre("b.yaml:11:5: error: unknown key 'settre' in field; did you mean 'setter'?"));
  EXPECT_THAT(
      changed(of_someip, "topic: /light", "topic: /" + std::string(245, 'a')),
      ElementsAre("b.yaml:3:12: error: topic: is too long for the service that is named after it, with "
                  "/get; give it another name by `get_service`",
                  "b.yaml:3:12: error: topic: is too long for the service that is named after it, with "
                  "/set; give it another name by `set_service`"));
  EXPECT_THAT(problems_of("someip: {address: 192.0.2.1}\nfields: []\n"),
              ElementsAre("b.yaml:2:9: error: fields: expected a list of fields, found an empty list"));
  EXPECT_THAT(problems_of("someip: {address: 192.0.2.1}\nfields: [7]\n"),
              ElementsAre(HasSubstr("b.yaml:2:10: error: field: expected a mapping")));
}

TEST(LoadFields, WarnOfIdsThatAreMeantForOthers) {
  covers({"feat_req_someip_626"});
  const auto loaded = parse_config(
      replaced(replaced(of_someip, "event: 0x8044", "event: 0x0044"), "getter: 0x0041", "getter: 0x8041"),
      "b.yaml");
  ASSERT_TRUE(loaded);
  EXPECT_THAT(
      lines(loaded->warnings),
      ElementsAre(HasSubstr("b.yaml:8:12: warning: event: ids below 0x8000 are meant for methods"),
                  HasSubstr("b.yaml:10:13: warning: getter: ids from 0x8000 on are meant for events")));
}

TEST(FieldConflict, OfIdsAndNames) {
  covers({"feat_req_someip_625"});
  EXPECT_THAT(
      changed(of_someip, "setter: 0x0042", "setter: 0x0041"),
      ElementsAre("b.yaml:11:13: error: setter: service 0x1111 instance 0x0022 id 0x0041 already belongs "
                  "to the field in line 3"));
  // Also of a getter that is answered with the last sample.
  const std::string offered = replaced(of_someip, "server: someip", "server: ros\n    port: 40001");
  EXPECT_THAT(
      changed(offered, "setter: 0x0042", "setter: 0x0041"),
      ElementsAre("b.yaml:12:13: error: setter: service 0x1111 instance 0x0022 id 0x0041 already belongs "
                  "to the field in line 3"));
  const std::string second =
      offered +
      "  - {topic: /b, type: std_msgs/msg/Bool, server: ros, service: 0x1111, instance: 0x22, event: 0x8045, "
      "eventgroup: 3, getter: 0x41, port: 40001}\n";
  EXPECT_THAT(problems_of(second),
              ElementsAre(HasSubstr("b.yaml:13:126: error: getter: service 0x1111 instance "
                                    "0x0022 id 0x0041 already belongs to the field in line 3")));
  EXPECT_THAT(
      problems_of(replaced(second, "0x8045", "0x8044")),
      testing::Contains(HasSubstr("event: service 0x1111 instance 0x0022 event 0x8044 is already routed")));
  EXPECT_THAT(problems_of(replaced(replaced(second, "getter: 0x41", "getter: 0x43"), "/b,", "/light,")),
              testing::Contains(HasSubstr("topic: /light is already routed")));
  EXPECT_THAT(
      changed(of_someip, "setter: 0x0042", "setter: 0x0042\n    set_service: /light/get"),
      ElementsAre("b.yaml:12:18: error: set_service: /light/get already belongs to the method in line 3"));
}

TEST(LoadFields, AskAboutTheirTypesEach) {
  std::vector<std::string> asked;
  const TypeCheck check = [&](const TypeUse& use, const messages::MessageRules&,
                              const messages::TypePlaces&) {
    asked.push_back(use.type + " of " + use.value_type);
    return TypeVerdict{use.type + " is odd"};
  };
  EXPECT_THAT(problems_of(of_ros, check),
              ElementsAre("b.yaml:4:11: error: type: std_msgs/msg/Float64 is odd",
                          "b.yaml:14:15: error: get_type: cabin_msgs/srv/GetLight is odd",
                          "b.yaml:15:15: error: set_type: cabin_msgs/srv/SetLight is odd"));
  EXPECT_THAT(asked,
              ElementsAre("std_msgs/msg/Float64 of ", "cabin_msgs/srv/GetLight of std_msgs/msg/Float64",
                          "cabin_msgs/srv/SetLight of std_msgs/msg/Float64"));
  EXPECT_THAT(problems_of(of_someip, check),
              ElementsAre("b.yaml:4:11: error: type: std_msgs/msg/Float64 is odd",
                          "b.yaml:4:11: error: type: std_msgs_fields/srv/GetFloat64 is odd",
                          "b.yaml:4:11: error: type: std_msgs_fields/srv/SetFloat64 is odd"));
}

TEST(FieldSummary, ShowsTheParts) {
  const std::string text = summary(config_of(of_someip), {});
  EXPECT_THAT(text, testing::StartsWith("b.yaml: good, 1 route, 2 methods\n"));
  EXPECT_THAT(
      text,
      HasSubstr("/light  <-  0x1111.0x0022     0x8044  0x0003  1.any    udp any  std_msgs/msg/Float64\n"));
  EXPECT_THAT(text, HasSubstr("/light/get   ->  0x1111.0x0022     0x0041  1.any    as offered  "
                              "std_msgs_fields/srv/GetFloat64\n"));
  EXPECT_THAT(text,
              HasSubstr("  made  std_msgs_fields/srv/SetFloat64, which ROS nodes get by --field-services\n"
                        "          for /light/set\n"));
  EXPECT_THAT(summary(config_of(of_ros), {}), testing::Not(HasSubstr("  made ")));
  EXPECT_THAT(summary(config_of(replaced(of_someip, "server: someip", "server: ros\n    port: 40001")), {}),
              HasSubstr("  get   getter 0x0041, answered with the last sample\n"));
}

TEST(FieldPackages, HoldTheServicesThatAreMade) {
  EXPECT_THAT(field_packages(config_of(of_ros)), IsEmpty());
  const auto files = field_packages(config_of(of_someip));
  ASSERT_THAT(files, SizeIs(4));
  EXPECT_EQ(files.at("std_msgs_fields/srv/GetFloat64.srv"), "---\nstd_msgs/Float64 value\n");
  EXPECT_EQ(files.at("std_msgs_fields/srv/SetFloat64.srv"),
            "std_msgs/Float64 value\n---\nstd_msgs/Float64 value\n");
  EXPECT_THAT(
      files.at("std_msgs_fields/package.xml"),
      testing::AllOf(HasSubstr("<name>std_msgs_fields</name>"), HasSubstr("<depend>std_msgs</depend>")));
  EXPECT_THAT(
      files.at("std_msgs_fields/CMakeLists.txt"),
      HasSubstr("rosidl_generate_interfaces(${PROJECT_NAME}\n  srv/GetFloat64.srv\n  srv/SetFloat64.srv\n"
                "  DEPENDENCIES std_msgs)\n"));
}

TEST(FieldPackages, AreWrittenOrSayWhyNot) {
  EXPECT_THAT(write_field_packages(config_of(of_someip), "/dev/null/x"),
              testing::StartsWith("/dev/null/x/std_msgs_fields: cannot be made: "));
}

}  // namespace
}  // namespace trestle::test::fields_test
