// Bridges that close a ring between DDS and SOME/IP, and those that stand side by side on purpose.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "someip/net/address_text.hpp"
#include "test/bridge/end_to_end/rings.hpp"
#include "test/source_dir.hpp"

namespace trestle::test::rings_test {
namespace {

TEST_F(Rings, OfTwoBridgesCarryATopicOnceAndNotBack) {
  RunningBridge& there = add("routes:\n" + out("/chatter", 1));
  RunningBridge& back = add("routes:\n" + in("/chatter", 1));
  const auto reader = read("/chatter");
  auto writer = BridgeTest::writer("/chatter");
  ASSERT_TRUE(subscribed(back, "/chatter") && knows(back, "/chatter", 1));
  EXPECT_EQ(copies_of(writer, 2), 1U);
  EXPECT_TRUE(counts(there, "route /chatter", "carried", 1));
  EXPECT_TRUE(counts(back, "route /chatter", "received", 1));
  EXPECT_TRUE(counts(back, "route /chatter", "returned", 1));
  EXPECT_EQ(back.counter("route /chatter", "carried"), 0U);
}

TEST_F(Rings, CarryALatchedTopicOnce) {
  const std::string kept = ", qos: {durability: transient_local, depth: 1}";
  add("routes:\n" + out("/chatter", 1, kept));
  RunningBridge& back = add("routes:\n" + in("/chatter", 1, kept));
  auto writer = BridgeTest::writer("/chatter", string_type, latched);
  ASSERT_TRUE(writer.write(hello_cdr));
  ASSERT_TRUE(subscribed(back, "/chatter") && knows(back, "/chatter", 1));
  // It may have come back before they knew each other.
  run_for(a_while);
  const auto reader = read("/chatter", latched);  // who comes late gets it from the publisher alone
  ASSERT_TRUE(until([&] { return seen_.size() > 0; }));
  run_for(a_while);
  EXPECT_EQ(seen_.take().size(), 1U);
}

TEST_F(Rings, OfThreeBridgesAndTwoTopicsEnd) {
  RunningBridge& first = add("routes:\n" + out("/chatter", 1));
  RunningBridge& second = add("routes:\n" + in("/other", 1) + in("/chatter", 2));
  RunningBridge& third = add("routes:\n" + out("/other", 2));
  const auto reader = read("/chatter");
  Inbox<Bytes> others;
  const auto other = reader_elsewhere("/other", string_type, others);
  auto writer = BridgeTest::writer("/chatter");
  ASSERT_TRUE(subscribed(second, "/other") && subscribed(second, "/chatter"));
  ASSERT_TRUE(knows(second, "/other", 1) && knows(third, "/other", 1));
  const std::size_t written = write_until_bridged(writer, third, "/other");
  EXPECT_TRUE(counts(first, "route /chatter", "carried", written));
  EXPECT_TRUE(until([&] { return seen_.size() >= written; }));
  run_for(a_while);
  EXPECT_EQ(seen_.take().size(), written);
  EXPECT_LE(others.take().size(), written);  // another topic may have it
  EXPECT_EQ(first.counter("route /chatter", "carried"), written);
  EXPECT_EQ(third.counter("route /other", "carried"), 0U);
  EXPECT_EQ(second.counter("route /chatter", "received"), 0U);
}

TEST_F(Rings, OverTwoDomainsEndInTheOtherOne) {
  const TestDomain far;
  add("routes:\n" + out("/chatter", 1));
  RunningBridge& to_far = add("routes:\n" + in("/chatter", 1), far);
  RunningBridge& from_far = add("routes:\n" + out("/chatter", 2), far);
  RunningBridge& back = add("routes:\n" + in("/chatter", 2));
  const auto reader = read("/chatter");
  auto writer = BridgeTest::writer("/chatter");
  ASSERT_TRUE(subscribed(to_far, "/chatter") && subscribed(back, "/chatter"));
  ASSERT_TRUE(knows(from_far, "/chatter", 1) && knows(back, "/chatter", 1));
  EXPECT_EQ(copies_of(writer, 2), 1U);
  EXPECT_TRUE(counts(to_far, "route /chatter", "received", 1));
  run_for(a_while);
  EXPECT_EQ(from_far.counter("route /chatter", "carried"), 0U);
  EXPECT_EQ(back.counter("route /chatter", "received"), 0U);
}

TEST_F(Rings, OfPatternsCarryATopicOnce) {
  const std::string folder = testing::TempDir() + "trestle-rings-" + std::to_string(getpid());
  std::filesystem::create_directories(folder);
  const auto pattern = [&](int number, const std::string& way) {
    const std::string file = folder + "/" + std::to_string(number) + ".lock";
    // The id of /chatter is chosen by its name.
    std::ofstream{file} << "version: 1\ntopics:\n  - {service: 0x6001, topic: /chatter, type: "
                           "std_msgs/msg/String}\n";
    return "lock_file: " + file + "\npatterns:\n  - {topics: /**, " + way + "}\n";
  };
  RunningBridge& there = add(pattern(1, "direction: dds_to_someip, services: 0x6000-0x6fff, port: 40060"));
  RunningBridge& back = add(pattern(2, "direction: someip_to_dds"));
  const auto reader = read("/chatter");
  // What only bridges publish gets no route.
  run_for(a_while);
  EXPECT_EQ(there.counter("pattern /**", "routes"), 0U);
  auto writer = std::make_optional(BridgeTest::writer("/chatter"));
  ASSERT_TRUE(until([&] { return there.counter("pattern /**", "routes") == 1; }));
  ASSERT_TRUE(subscribed(back, "/chatter") && knows(back, "/chatter", 1));
  EXPECT_EQ(copies_of(*writer, 2), 1U);
  writer.reset();
  EXPECT_TRUE(until([&] { return there.counter("pattern /**", "routes") == 0; }));
  bridges_.clear();
  std::filesystem::remove_all(folder);
}

TEST_F(Rings, KeepNoOfferAliveByThemselves) {
  RunningBridge& there = add("routes:\n" + out("/chatter", 1, ", offer: while_published"));
  RunningBridge& back = add("routes:\n" + in("/chatter", 1));
  auto writer = std::make_optional(BridgeTest::writer("/chatter"));
  ASSERT_TRUE(until([&] { return there.counter("route /chatter", "offered") == 1; }));
  ASSERT_TRUE(subscribed(back, "/chatter"));
  writer.reset();
  EXPECT_TRUE(until([&] { return there.counter("route /chatter", "offered") == 0; }));
}

TEST_F(Rings, AskARosServiceOnce) {
  int asked = 0;
  answering(ros("/actuate", "std_srvs/srv/SetBool"), [&](const dds::ServiceMessage&) {
    ++asked;
    return hex("00010000 01000000 01000000 00");
  });
  RunningBridge& there = add("methods:\n" + method("ros", 1));
  RunningBridge& back = add("methods:\n" + method("someip", 1));
  ASSERT_TRUE(until([&] { return there.counter("method of ROS service /actuate", "ready") == 1; }));
  run_for(a_while);
  // DDS may tell of the other bridge a heartbeat later than SOME/IP of its service.
  ASSERT_TRUE(until([&] { return back.counter("ROS service of method /actuate", "ready") == 0; }));
  dds::ServiceClient& client = driver_.client(listener_, ros("/actuate", "std_srvs/srv/SetBool"));
  ASSERT_TRUE(until([&] { return client.ready(); }));
  std::vector<Answer> answers;
  ros_call(client, hex("00010000 01"), answers);
  ASSERT_TRUE(until([&] { return !answers.empty(); }));
  EXPECT_FALSE(answers[0].error);
  run_for(a_while);
  EXPECT_EQ(asked, 1);

  // And called by SOME/IP.
  sd::Node node{io_, node_config()};
  sd::Proxy proxy{node, {.service = someip::ServiceId{1}}};
  call(proxy, someip::MethodId{1}, hex("01"), answers);
  ASSERT_TRUE(until([&] { return answers.size() == 2; }));
  EXPECT_FALSE(answers[1].error);
  run_for(a_while);
  EXPECT_EQ(asked, 2);
}

// No test can say that this time suffices for DDS, but that the bridge waits.
TEST_F(Rings, WaitForABridgeOfTheirDomainThatDdsDoesNotKnow) {
  RunningBridge& bridge = add("methods:\n" + method("someip", 1));
  sd::NodeConfig config = node_config();
  config.gateway_to =
      Endpoint{IpAddress::v4(239, 255, 0, 1), static_cast<std::uint16_t>(7400 + 250 * domain_.id())};
  sd::Node gateway{io_, config};
  const auto began = std::chrono::steady_clock::now();
  gateway.offer({.service = someip::ServiceId{1}, .instance = someip::InstanceId{1}});
  ASSERT_TRUE(until([&] { return bridge.counter("ROS service of method /actuate", "ready") == 1; }));
  EXPECT_GE(std::chrono::steady_clock::now() - began, 5s);
  EXPECT_EQ(bridge.counter("SOME/IP-SD", "withheld"), 1U);
}

TEST_F(Rings, KeepNoServiceAliveByThemselves) {
  RunningBridge& there = add("methods:\n" + method("ros", 1));
  RunningBridge& back = add("methods:\n" + method("someip", 1));
  run_for(a_while);
  EXPECT_EQ(there.counter("method of ROS service /actuate", "ready"), 0U);
  EXPECT_EQ(back.counter("ROS service of method /actuate", "ready"), 0U);
}

TEST_F(Rings, SetAndTellAFieldOnce) {
  const std::string field =
      "fields:\n  - {topic: /light, type: std_msgs/msg/Int32, service: 1, instance: 1, event: 0x8044, "
      "eventgroup: 3, getter: 0x41, setter: 0x42, ";
  RunningBridge& there = add(field + "server: ros, port: 40001}\n");
  RunningBridge& back = add(field + "server: someip}\n");
  Inbox<Bytes> seen;
  const auto reader = reader_elsewhere("/light", "std_msgs/msg/Int32", seen, latched);
  auto writer = BridgeTest::writer("/light", "std_msgs/msg/Int32", latched);
  int asked = 0;
  const auto set = ros("/light/set", "std_msgs_fields/srv/SetInt32");
  answering(set, [&](const dds::ServiceMessage& request) {
    ++asked;
    return copy(request.cdr().first(8));
  });
  ASSERT_TRUE(knows(back, "/light", 1));
  ASSERT_TRUE(until([&] { return writer.matched() == 2; }));
  ASSERT_TRUE(writer.write(hex("00010000 07000000")));
  ASSERT_TRUE(until([&] {
    return seen.size() > 0 &&
           there.counter("route /light", "carried") + there.counter("route /light", "kept") > 0;
  }));
  run_for(a_while);
  EXPECT_EQ(seen.take().size(), 1U);
  EXPECT_EQ(there.counter("route /light", "carried") + there.counter("route /light", "kept"), 1U);
  dds::ServiceClient& client = driver_.client(listener_, set);
  ASSERT_TRUE(until([&] { return client.ready(); }));
  std::vector<Answer> answers;
  ros_call(client, hex("00010000 05000000"), answers);
  ASSERT_TRUE(until([&] { return !answers.empty(); }));
  EXPECT_FALSE(answers[0].error);
  run_for(a_while);
  EXPECT_EQ(asked, 1);
}

TEST_F(Rings, DoAnActionOnce) {
  const std::string action =
      "types: {paths: [" + test::source_dir() +
      "/test/bridge/ros/interfaces]}\n"
      "actions:\n  - {action: /count, type: test_msgs/action/Fibonacci, service: 1, instance: 1, eventgroup: "
      "1, methods: {send_goal: 0x11, cancel_goal: 0x12, get_result: 0x13}, events: {feedback: 0x8011, "
      "status: "
      "0x8012}, ";
  RunningBridge& there = add(action + "server: ros, port: 40001}\n");
  RunningBridge& back = add(action + "server: someip}\n");
  std::map<std::string, int> asked;
  const auto serve = [&](const char* name, const char* type, const char* answer) {
    answering(ros(std::string{"/count/_action/"} + name, type), [&asked, name, answer](const auto&) {
      ++asked[name];
      return hex(answer);
    });
  };
  serve("send_goal", "test_msgs/action/Fibonacci_SendGoal", "00010000 01000000 01000000 02000000");
  serve("cancel_goal", "action_msgs/srv/CancelGoal", "00010000 02000000 00000000");
  serve("get_result", "test_msgs/action/Fibonacci_GetResult", "00010000 04000000 00000000");
  const char* const feedback_type = "test_msgs/action/Fibonacci_FeedbackMessage";
  auto feedback = BridgeTest::writer("/count/_action/feedback", feedback_type);
  auto status = BridgeTest::writer("/count/_action/status", "action_msgs/msg/GoalStatusArray", latched);
  Inbox<Bytes> heard;
  Inbox<Bytes> states;
  const auto reader = reader_elsewhere("/count/_action/feedback", feedback_type, heard);
  const auto state_reader =
      reader_elsewhere("/count/_action/status", "action_msgs/msg/GoalStatusArray", states, latched);
  const auto goal = "method of ROS service /count/_action/send_goal";
  ASSERT_TRUE(until([&] { return there.counter(goal, "ready") == 1; }));
  ASSERT_TRUE(knows(back, "/count/_action/feedback", 1) && knows(back, "/count/_action/status", 1));
  ASSERT_TRUE(until([&] { return feedback.matched() == 2 && status.matched() == 2; }));
  run_for(a_while);
  EXPECT_EQ(back.counter("ROS service of method /count/_action/send_goal", "ready"), 0U);
  const std::string goal_id = "000102030405060708090a0b0c0d0e0f";
  dds::ServiceClient& client =
      driver_.client(listener_, ros("/count/_action/send_goal", "test_msgs/action/Fibonacci_SendGoal"));
  ASSERT_TRUE(until([&] { return client.ready(); }));
  std::vector<Answer> answers;
  ros_call(client, hex("00010000" + goal_id + "05000000"), answers);
  ASSERT_TRUE(until([&] { return !answers.empty(); }));
  EXPECT_FALSE(answers[0].error);
  ASSERT_TRUE(feedback.write(hex("00010000" + goal_id + "01000000 01000000")));
  ASSERT_TRUE(status.write(hex("00010000 00000000")));
  ASSERT_TRUE(until([&] { return heard.size() > 0 && states.size() > 0; }));
  run_for(a_while);
  EXPECT_EQ(heard.size(), 1U);
  EXPECT_EQ(states.size(), 1U);

  // And by SOME/IP.
  sd::Node node{io_, node_config()};
  sd::Proxy proxy{node, {.service = someip::ServiceId{1}}};
  call(proxy, someip::MethodId{0x11}, hex(goal_id + "00000005"), answers);
  call(proxy, someip::MethodId{0x13}, hex(goal_id), answers);
  ASSERT_TRUE(until([&] { return answers.size() == 3; }));
  EXPECT_FALSE(answers[1].error || answers[2].error);
  run_for(a_while);
  EXPECT_EQ(asked["send_goal"], 2);
  EXPECT_EQ(asked["get_result"], 1);
}

TEST_F(Rings, ChainsAreNone) {
  const TestDomain far;
  add("routes:\n" + out("/chatter", 1) + in("/answers", 2));
  RunningBridge& other = add("routes:\n" + in("/chatter", 1) + out("/answers", 2), far);
  dds::ParticipantConfig settings = config();
  settings.domain = far.id();
  dds::Participant at_far{settings};
  Inbox<Bytes> heard;
  const auto far_reader =
      at_far.create_reader(dds::ros_topic_name("/chatter"), dds::ros_type_name(string_type), {},
                           [&](const dds::Sample& sample) { heard.put(copy(sample.cdr())); });
  ASSERT_TRUE(subscribed(other, "/chatter"));
  auto writer = BridgeTest::writer("/chatter");
  // The bridge may know of a reader later than the reader of the bridge.
  ASSERT_TRUE(until([&] {
    return writer.matched() == 1 && far_reader.matched() == 1 &&
           other.counter("route /chatter from SOME/IP", "readers") == 1;
  }));
  ASSERT_TRUE(writer.write(hello_cdr));
  ASSERT_TRUE(until([&] { return heard.size() == 1; }));
}

TEST_F(Rings, SideBySideAreNone) {
  const TestDomain far;
  RunningBridge& one = add("routes:\n" + out("/chatter", 1));
  RunningBridge& two = add("routes:\n" + out("/chatter", 2));
  RunningBridge& other = add("routes:\n" + in("/one", 1) + in("/two", 2), far);
  ASSERT_TRUE(subscribed(other, "/one") && subscribed(other, "/two"));
  auto writer = BridgeTest::writer("/chatter");
  ASSERT_TRUE(until([&] { return writer.matched() == 2; }));
  ASSERT_TRUE(writer.write(hello_cdr));
  ASSERT_TRUE(until([&] {
    return one.counter("route /chatter", "carried") == 1 && two.counter("route /chatter", "carried") == 1;
  }));
  EXPECT_TRUE(until([&] {
    return other.counter("route /one", "received") == 1 && other.counter("route /two", "received") == 1;
  }));
}

}  // namespace
}  // namespace trestle::test::rings_test
