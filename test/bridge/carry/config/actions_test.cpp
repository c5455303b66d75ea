// Actions: each is three methods and two routes.
#include <gmock/gmock.h>

#include "bridge/carry/config/load.hpp"
#include "test/bridge/carry/config/problems_of.hpp"

namespace trestle::test::actions_test {
namespace {

using namespace carry;
using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

const std::string of_ros = R"(someip: {address: 192.0.2.1}
actions:
  - action: /arm/move
    type: test_msgs/action/Fibonacci
    server: ros
    service: 0x1111
    instance: 0x0022
    eventgroup: 0x0003
    methods: {send_goal: 0x0011, cancel_goal: 0x0012, get_result: 0x0013}
    events: {feedback: 0x8011, status: 0x8012}
    major: 5
    minor: 6
    transport: tcp
    port: 40001
    timeout: 250 ms
    result_timeout: 5 s
    max_calls: 7
    max_message: 8 KiB
    tp: {segment_bytes: 160, burst: 4, separation: 2 ms}
    ros_form: cyclonedds
    wire: {string_length: 16}
)";

const std::string of_someip = R"(someip: {address: 192.0.2.1}
actions:
  - action: /move
    type: test_msgs/action/Fibonacci
    server: someip
    service: 0x1111
    instance: 0x0022
    eventgroup: 0x0003
    methods: {send_goal: 0x0011, cancel_goal: 0x0012, get_result: 0x0013}
    events: {feedback: 0x8011, status: 0x8012}
)";

TEST(LoadActions, AreThreeMethodsAndTwoRoutes) {
  const BridgeConfig config = config_of(of_ros);
  ASSERT_THAT(config.methods, SizeIs(3));
  ASSERT_THAT(config.routes, SizeIs(2));
  const std::array names{"/arm/move/_action/send_goal", "/arm/move/_action/cancel_goal",
                         "/arm/move/_action/get_result"};
  const std::array types{"test_msgs/action/Fibonacci_SendGoal", "action_msgs/srv/CancelGoal",
                         "test_msgs/action/Fibonacci_GetResult"};
  for (std::size_t i = 0; i < 3; ++i) {
    const MethodRoute& method = config.methods[i];
    EXPECT_EQ(method.ros_service, names.at(i));
    EXPECT_EQ(method.type, types.at(i));
    EXPECT_EQ(method.server, Server::ros);
    EXPECT_EQ(method.service, someip::ServiceId{0x1111});
    EXPECT_EQ(method.instance, someip::InstanceId{0x22});
    EXPECT_EQ(method.method, someip::MethodId{static_cast<std::uint16_t>(0x11 + i)});
    EXPECT_EQ(method.major, 5);
    EXPECT_EQ(method.minor, 6U);
    EXPECT_EQ(method.transport, Transport::tcp);
    EXPECT_EQ(method.port, 40001);
    EXPECT_EQ(method.timeout, i == 2 ? Duration{5s} : Duration{250ms});
    EXPECT_EQ(method.max_calls, 7U);
    EXPECT_EQ(method.tp, (TpSettings{{.segment_bytes = 160, .burst = 4, .separation = 2ms}, 8192}));
    EXPECT_EQ(method.form, ServiceForm::cyclonedds);
    EXPECT_EQ(method.rules.payload.string_length, someip::FieldWidth::bits16);
    EXPECT_EQ(method.mark, (documents::Mark{3, 5}));
  }
  const Route& feedback = config.routes[0];
  EXPECT_EQ(feedback.topic, "/arm/move/_action/feedback");
  EXPECT_EQ(feedback.type, "test_msgs/action/Fibonacci_FeedbackMessage");
  EXPECT_EQ(feedback.event, someip::MethodId{0x8011});
  EXPECT_FALSE(feedback.qos.transient_local);
  const Route& status = config.routes[1];
  EXPECT_EQ(status.topic, "/arm/move/_action/status");
  EXPECT_EQ(status.type, "action_msgs/msg/GoalStatusArray");
  EXPECT_EQ(status.event, someip::MethodId{0x8012});
  EXPECT_TRUE(status.qos.transient_local);
  EXPECT_EQ(status.qos.depth, 1U);
  for (const Route& route : config.routes) {
    EXPECT_EQ(route.direction, Direction::dds_to_someip);
    EXPECT_EQ(route.service, someip::ServiceId{0x1111});
    EXPECT_EQ(route.instance, someip::InstanceId{0x22});
    EXPECT_EQ(route.eventgroup, someip::EventgroupId{3});
    EXPECT_EQ(route.major, 5);
    EXPECT_EQ(route.minor, 6U);
    EXPECT_EQ(route.transport, Transport::tcp);
    EXPECT_EQ(route.port, 40001);
    EXPECT_EQ(route.tp, (TpSettings{{.segment_bytes = 160, .burst = 4, .separation = 2ms}, 8192}));
    EXPECT_EQ(route.rules.payload.string_length, someip::FieldWidth::bits16);
    EXPECT_TRUE(route.presence.offer_while_published);
  }
}

TEST(LoadActions, OfASomeipServerAreThereWhileItIs) {
  const BridgeConfig config = config_of(of_someip);
  ASSERT_THAT(config.methods, SizeIs(3));
  ASSERT_THAT(config.routes, SizeIs(2));
  for (const MethodRoute& method : config.methods) {
    EXPECT_EQ(method.server, Server::someip);
    EXPECT_EQ(method.transport, std::nullopt);
    EXPECT_EQ(method.minor, 0xffff'ffffU);
  }
  EXPECT_EQ(config.methods[2].timeout, Duration{1h});
  for (const Route& route : config.routes) {
    EXPECT_EQ(route.direction, Direction::someip_to_dds);
    EXPECT_EQ(route.minor, 0xffff'ffffU);
    EXPECT_TRUE(route.presence.write_while_offered);
  }
}

TEST(LoadActions, NameWhatIsWrong) {
  const auto changed = [](const std::string& base, const std::string& what, const std::string& into) {
    std::string text = base;
    text.replace(text.find(what), what.size(), into);
    return problems_of(text);
  };
  EXPECT_THAT(changed(of_ros, "test_msgs/action/Fibonacci", "test_msgs/srv/Fibonacci"),
              ElementsAre(HasSubstr("b.yaml:4:11: error: type: expected an action type such as")));
  EXPECT_THAT(changed(of_ros, "    port: 40001\n", ""), ElementsAre(HasSubstr("'port' is missing")));
  EXPECT_THAT(changed(of_someip, "server: someip", "server: someip\n    port: 40001"),
              ElementsAre(HasSubstr("b.yaml:6:11: error: port: is where we offer an action")));
  EXPECT_THAT(changed(of_ros, "get_result: 0x0013", "get_resul: 0x0013"),
              ElementsAre(HasSubstr("'get_result' is missing"), HasSubstr("did you mean 'get_result'?")));
  EXPECT_THAT(changed(of_ros, "status: 0x8012", "status: 0x0012"),
              ElementsAre(HasSubstr("b.yaml:10:40: error: status: expected an id from 0x8000 to 0xfffe")));
  EXPECT_THAT(changed(of_ros, "    events: {feedback: 0x8011, status: 0x8012}\n", ""),
              ElementsAre(HasSubstr("'events' is missing in action")));
  EXPECT_THAT(changed(of_ros, "cancel_goal: 0x0012", "cancel_goal: 0x0011"),
              ElementsAre(HasSubstr("method: service 0x1111 instance 0x0022 id 0x0011 already belongs to")));
  EXPECT_THAT(
      changed(of_ros, "wire: {string_length: 16}", "wire: {types: {test_msgs/msg/Empty: {form: struct}}}"),
      ElementsAre(HasSubstr("wire: the messages of an action have no types with rules of their own")));
  EXPECT_THAT(changed(of_ros, "service: 0x1111", "service: 0x11111"),
              ElementsAre(HasSubstr("service: expected an id")));
}

}  // namespace
}  // namespace trestle::test::actions_test
