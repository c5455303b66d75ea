// Bridges that close a ring between DDS and SOME/IP, and those that stand side by side on purpose.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <spdlog/spdlog.h>

#include <boost/asio/post.hpp>
#include <filesystem>
#include <fstream>

#include "someip/net/address_text.hpp"
#include "test/bridge/end_to_end/log_sink.hpp"
#include "test/bridge/end_to_end/services_end_to_end.hpp"

namespace trestle::test::rings_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr dds::Qos latched{.reliable = true, .transient_local = true, .depth = 1};
constexpr auto a_while = 500ms;

std::string out(const std::string& topic, int service, const std::string& more = "") {
  return fmt::format(
      "  - {{topic: {}, type: std_msgs/msg/String, direction: dds_to_someip, service: {}, instance: 1, "
      "eventgroup: 1, event: 0x8001, port: {}{}}}\n",
      topic, service, 40000 + service, more);
}
std::string in(const std::string& topic, int service, const std::string& more = "") {
  return fmt::format(
      "  - {{topic: {}, type: std_msgs/msg/String, direction: someip_to_dds, service: {}, instance: 1, "
      "eventgroup: 1, event: 0x8001{}}}\n",
      topic, service, more);
}
std::string method(const std::string& server, int service) {
  return fmt::format(
      "  - {{ros_service: /actuate, type: std_srvs/srv/SetBool, server: {}, service: {}, instance: 1, "
      "method: 1{}}}\n",
      server, service, server == "ros" ? fmt::format(", port: {}", 40000 + service) : "");
}

/// Several bridges, and a ROS peer in the first domain.
class Rings : public ServicesEndToEnd {
 protected:
  RunningBridge& add(const std::string& lists) { return add(lists, domain_); }
  RunningBridge& add(const std::string& lists, const TestDomain& domain) {
    const auto host = static_cast<std::uint8_t>(bridges_.size() + 3);
    bridges_.push_back(std::make_unique<RunningBridge>(bridge_head(host, domain.id()) + lists));
    return *bridges_.back();
  }
  dds::Reader read(const std::string& topic, const dds::Qos& qos = {}) {
    return reader_elsewhere(topic, string_type, seen_, qos);
  }
  /// Of a participant of its own, as one does not hear itself.
  dds::Reader reader_elsewhere(const std::string& topic, const char* type, Inbox<Bytes>& into,
                               const dds::Qos& qos = {}) {
    return listener_.create_reader(dds::ros_topic_name(topic), dds::ros_type_name(type), qos,
                                   [&into](const dds::Sample& sample) { into.put(copy(sample.cdr())); });
  }
  /// Writes a String when so many readers are there, that of ours among them, and gives how often it comes.
  std::size_t copies_of(dds::Writer& writer, std::size_t readers) {
    EXPECT_TRUE(until([&] { return writer.matched() == readers; }));
    EXPECT_TRUE(writer.write(hello_cdr));
    EXPECT_TRUE(until([&] { return seen_.size() > 0; }));
    run_for(a_while);
    return seen_.take().size();
  }
  /// Writes Strings until the route of this bridge has refused one of another bridge's: how many. Some may be
  /// written before all have found each other.
  std::size_t write_until_bridged(dds::Writer& writer, RunningBridge& bridge, const std::string& topic) {
    EXPECT_TRUE(until([&] { return writer.matched() == 2; }));
    std::size_t written = 0;
    EXPECT_TRUE(until([&] {
      EXPECT_TRUE(writer.write(hello_cdr));
      ++written;
      run_for(50ms);
      return bridge.counter("route " + topic, "dds_from_bridge") > 0;
    }));
    run_for(a_while);
    return written;
  }
  /// Whether it knows so many ends of others on a topic.
  bool knows(RunningBridge& bridge, const std::string& topic, std::uint64_t others) {
    return until([&] { return bridge.counter("route " + topic, "bridges") == others; });
  }
  /// Whether it comes to have counted so many.
  bool counts(RunningBridge& bridge, const std::string& group, const std::string& name, std::uint64_t value) {
    return until([&] { return bridge.counter(group, name) == value; });
  }
  bool subscribed(RunningBridge& bridge, const std::string& topic) {
    return until([&] { return bridge.counter("route " + topic + " from SOME/IP", "subscribed") == 1; });
  }

  dds::Participant listener_{config()};
  std::vector<std::unique_ptr<RunningBridge>> bridges_;
  Inbox<Bytes> seen_;
};

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
  EXPECT_EQ(back.counter("ROS service of method /actuate", "ready"), 0U);
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
      "types: {paths: [" TRESTLE_SOURCE_DIR
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

/// Somebody copies events of one service to another, as a gateway of another maker in a ring.
class ForeignRings : public Rings {
 protected:
  void relay(int from, int to) {
    node_ = std::make_unique<sd::Node>(io_, node_config());
    sd::ServiceSpec spec{.service = someip::ServiceId{static_cast<std::uint16_t>(to)},
                         .instance = someip::InstanceId{1}};
    spec.udp_port = 0;
    spec.eventgroups = {{.id = someip::EventgroupId{1}, .events = {someip::MethodId{0x8001}}}};
    offer_.emplace(*node_, spec);
    subscription_.emplace(
        *node_,
        sd::SubscribeSpec{.service = someip::ServiceId{static_cast<std::uint16_t>(from)},
                          .eventgroup = someip::EventgroupId{1},
                          .events = {someip::MethodId{0x8001}}},
        [this](const someip::Message& event, const Endpoint&) {
          node_->notify(offer_->handle(), someip::MethodId{0x8001}, std::span{&event.payload, 1});
        });
  }
  std::unique_ptr<sd::Node> node_;
  std::optional<sd::Offer> offer_;
  std::optional<sd::Subscription> subscription_;
};

TEST_F(ForeignRings, BringAMessageBackOnce) {
  RunningBridge& there = add("routes:\n" + out("/chatter", 1));
  RunningBridge& back = add("routes:\n" + in("/chatter", 2));
  relay(1, 2);
  const auto reader = read("/chatter");
  auto writer = BridgeTest::writer("/chatter");
  ASSERT_TRUE(until([&] { return subscription_->active(); }));
  ASSERT_TRUE(subscribed(back, "/chatter") && knows(back, "/chatter", 1) && knows(there, "/chatter", 1));
  const std::size_t written = write_until_bridged(writer, there, "/chatter");
  EXPECT_TRUE(counts(there, "route /chatter", "carried", written));
  run_for(a_while);
  EXPECT_LE(seen_.take().size(), 2 * written);
  EXPECT_EQ(there.counter("route /chatter", "carried"), written);
}

/// Something in DDS that is no bridge of ours closes the ring.
TEST_F(ForeignRings, AreKeptFromGoingRoundForLong) {
  RunningBridge& there = add("routes:\n" + out("/chatter", 1));
  node_ = std::make_unique<sd::Node>(io_, node_config());
  auto foreign = BridgeTest::writer("/chatter");
  std::uint64_t rounds = 0;
  subscription_.emplace(*node_,
                        sd::SubscribeSpec{.service = someip::ServiceId{1},
                                          .eventgroup = someip::EventgroupId{1},
                                          .events = {someip::MethodId{0x8001}}},
                        [&](const someip::Message&, const Endpoint&) {
                          ++rounds;
                          static_cast<void>(foreign.write(hello_cdr));
                        });
  auto writer = listener_.create_writer(dds::ros_topic_name("/chatter"), dds::ros_type_name(string_type), {});
  ASSERT_TRUE(
      until([&] { return subscription_->active() && foreign.matched() == 1 && writer.matched() == 1; }));
  ASSERT_TRUE(writer.write(hello_cdr));
  ASSERT_TRUE(until([&] { return there.counter("route /chatter", "looped") > 0; }));
  run_for(a_while);
  const std::uint64_t before = rounds;
  EXPECT_LE(before, 110U);
  run_for(a_while);
  EXPECT_EQ(rounds, before);
}

/// Two bridges that carry from one SOME/IP network to another through a DDS domain. (Here it is one network
/// with two services.)
class Gateways : public ForeignRings {
 protected:
  // Of the bridge that is added first.
  const std::string from_first_ = ", from_bridges: [" + someip::to_string(own_address(3)) + "]";

  void offer(int service) {
    node_ = std::make_unique<sd::Node>(io_, node_config());
    sd::ServiceSpec spec{.service = someip::ServiceId{static_cast<std::uint16_t>(service)},
                         .instance = someip::InstanceId{1}};
    spec.udp_port = 0;
    spec.eventgroups = {{.id = someip::EventgroupId{1}, .events = {someip::MethodId{0x8001}}}};
    offer_.emplace(*node_, spec);
  }
  void notify() {
    const ByteView payload{hello};
    node_->notify(offer_->handle(), someip::MethodId{0x8001}, {&payload, 1});
  }
  void subscribe(int service) {
    subscription_.emplace(*node_,
                          sd::SubscribeSpec{.service = someip::ServiceId{static_cast<std::uint16_t>(service)},
                                            .eventgroup = someip::EventgroupId{1},
                                            .events = {someip::MethodId{0x8001}}},
                          [this](const someip::Message&, const Endpoint&) { ++came_; });
  }
  std::uint64_t came_ = 0;
};

TEST_F(Gateways, CarryWhatTheBridgesBringInThatTheyName) {
  RunningBridge& first = add("routes:\n" + in("/chatter", 1, ", subscribe: while_read"));
  RunningBridge& second = add("routes:\n" + out("/chatter", 2, from_first_ + ", offer: while_published"));
  RunningBridge& third = add("routes:\n" + out("/chatter", 3));
  offer(1);
  subscribe(2);
  ASSERT_TRUE(subscribed(first, "/chatter")) << "the second one reads it";
  ASSERT_TRUE(until([&] { return subscription_->active(); })) << "the second one has a publisher";
  ASSERT_TRUE(knows(third, "/chatter", 2));
  notify();
  ASSERT_TRUE(until([&] { return came_ == 1; }));
  ASSERT_TRUE(counts(third, "route /chatter", "dds_from_bridge", 1));
  run_for(a_while);
  EXPECT_EQ(came_, 1U);
  EXPECT_EQ(first.counter("route /chatter", "readers"), 1U);
  EXPECT_EQ(second.counter("route /chatter", "dds_from_bridge"), 0U);
  EXPECT_EQ(third.counter("route /chatter", "dds_from_bridge"), 1U) << "it names none";
  EXPECT_EQ(third.counter("route /chatter", "publishers"), 0U);
}

TEST_F(Gateways, CarryLatchedTopicsByPatterns) {
  const std::string file = testing::TempDir() + "trestle-gateways-" + std::to_string(getpid()) + ".lock";
  std::ofstream{file} << "version: 1\ntopics:\n  - {service: 0x6001, topic: /chatter, type: "
                         "std_msgs/msg/String}\n";
  RunningBridge& first =
      add("routes:\n" + in("/chatter", 1, ", qos: {durability: transient_local, depth: 1}"));
  offer(1);
  ASSERT_TRUE(subscribed(first, "/chatter"));
  notify();
  ASSERT_TRUE(until([&] { return first.counter("route /chatter", "carried") == 1; }));
  RunningBridge& second = add("lock_file: " + file +
                              "\npatterns:\n  - {topics: /**, direction: dds_to_someip, services: "
                              "0x6000-0x6fff, port: 40060" +
                              from_first_ + "}\n");
  ASSERT_TRUE(until([&] { return second.counter("pattern /**", "routes") == 1; }));
  ASSERT_TRUE(until([&] { return second.counter("route /chatter to SOME/IP", "kept") == 1; }));
  subscribe(0x6001);
  EXPECT_TRUE(until([&] { return came_ == 1; }));
  bridges_.clear();
  std::filesystem::remove(file);
}

TEST_F(Gateways, CarryCalls) {
  RunningBridge& first = add("methods:\n" + method("someip", 1));
  std::string second = method("ros", 2);
  second.insert(second.rfind('}'), from_first_);
  add("methods:\n" + second);
  int asked = 0;
  sd::Node node{io_, node_config()};
  const sd::Offer offered{node,
                          {.service = someip::ServiceId{1},
                           .instance = someip::InstanceId{1},
                           .methods = {{someip::MethodId{1}, [&](const someip::Message&, sd::Responder to) {
                                          ++asked;
                                          to.respond(hex("01 00000004 efbbbf 00"));
                                        }}}}};
  sd::Proxy proxy{node, {.service = someip::ServiceId{2}}};
  ASSERT_TRUE(until([&] { return !proxy.available().empty(); }));
  std::vector<Answer> answers;
  call(proxy, someip::MethodId{1}, hex("01"), answers);
  ASSERT_TRUE(until([&] { return !answers.empty(); }));
  EXPECT_FALSE(answers[0].error) << answers[0].error.message();
  EXPECT_EQ(to_hex(answers[0].payload), "0100000004efbbbf00");
  EXPECT_EQ(asked, 1);
  EXPECT_EQ(first.counter("ROS service of method /actuate", "dds_from_bridge"), 0U);
}

// One message of one sender, which comes from the first bridge each time.
TEST_F(Gateways, AreKeptFromClosingARing) {
  RunningBridge& first = add("routes:\n" + in("/chatter", 1));
  RunningBridge& second = add("routes:\n" + out("/chatter", 2, from_first_));
  relay(2, 1);
  ASSERT_TRUE(until([&] { return subscription_->active(); }));
  ASSERT_TRUE(subscribed(first, "/chatter"));
  ASSERT_TRUE(until([&] { return second.counter("route /chatter", "publishers") == 1; }));
  ASSERT_TRUE(until([&] { return first.counter("route /chatter", "readers") == 1; }));
  notify();
  ASSERT_TRUE(until([&] { return second.counter("route /chatter", "looped") > 0; }));
  run_for(a_while);
  const std::uint64_t before = second.counter("route /chatter", "carried");
  EXPECT_LE(before, 110U);
  run_for(a_while);
  EXPECT_EQ(second.counter("route /chatter", "carried"), before);
}

/// Beside somebody who has readers, writers, services and events as a bridge has, and says nothing of it: an
/// older bridge. All that comes back into our bridge comes from him.
class OldBridges : public Gateways {
 protected:
  OldBridges() { spdlog::set_default_logger(std::make_shared<spdlog::logger>("test", log_)); }
  ~OldBridges() override {
    bridges_.clear();
    spdlog::set_default_logger(std::make_shared<spdlog::logger>("after"));
  }

  /// The bridge under test, which carries a service's event to a topic of this name, and the service;
  /// somebody at its host reads the topic.
  RunningBridge& event_to(const std::string& topic, int service, dds::OnSample on_sample) {
    RunningBridge& route = add("routes:\n" + in(topic, service));
    offer(service);
    reader_ = listener_.create_reader(dds::ros_topic_name(topic), dds::ros_type_name(string_type), {},
                                      std::move(on_sample));
    EXPECT_TRUE(subscribed(route, topic));
    EXPECT_TRUE(until([&] { return route.counter("route " + topic, "readers") == 1; }));
    return route;
  }
  /// Sends an event so many times, four each millisecond, or as often as the machine can.
  void notify_often(int times) {
    for (int i = 0; i < times; ++i) {
      notify();
      if (i % 4 == 3) {
        run_for(1ms);
      }
    }
  }
  /// What is said of a ring goes through these.
  void expect_told(const std::string& route, const std::string& through) {
    ASSERT_TRUE(until([&] { return log_->has("seems to loop"); })) << log_->str();
    EXPECT_THAT(log_->str(), HasSubstr(route + ": this route seems to loop through the DDS participant '"));
    EXPECT_THAT(log_->str(), HasSubstr(through + someip::to_string(own_address(2))));
  }

  // Messages in a ring at once, so that also on a slow machine it is quick enough to be found.
  static constexpr int several_ = 10;
  const std::shared_ptr<LogSink> log_ = std::make_shared<LogSink>();
  std::optional<dds::Reader> reader_;
};

TEST_F(OldBridges, AreKeptFromClosingARingWithARoute) {
  int rounds = 0;
  RunningBridge& route = event_to("/chatter", 1, [&](const dds::Sample&) {
    boost::asio::post(io_, [&] {
      ++rounds;
      notify();
    });
  });
  auto writer = BridgeTest::writer("/chatter");
  ASSERT_TRUE(until([&] { return writer.matched() == 1; }));
  for (int i = 0; i < several_; ++i) {
    ASSERT_TRUE(writer.write(hello_cdr));
  }
  ASSERT_TRUE(until([&] { return route.counter("route /chatter", "looped") > 0; }));
  run_for(a_while);
  EXPECT_LE(rounds, 101 + 2 * several_);
  const int before = rounds;
  expect_told("/chatter", "who reads the topic, and the SOME/IP service at ");
  run_for(a_while);
  EXPECT_LE(rounds, before + 110) << "at most 200 a second, and as a rule none";
  for (int i = 0; i < 20; ++i) {  // more of it comes in, and is bounded
    ASSERT_TRUE(writer.write(hello_cdr));
    run_for(50ms);
  }
  EXPECT_LE(rounds - before, 20 + 2 * 220);
}

// Whether a trial takes an honest event for a ring depends on how the machine keeps time; what it makes of
// one that comes in time is in loop_check_test.cpp.
TEST_F(OldBridges, AreNotWhoSaysTheSameOften) {
  bool goes_on = false;
  for (int attempt = 1; attempt <= 5 && !goes_on; ++attempt) {
    const std::string topic = fmt::format("/chatter{}", attempt);
    RunningBridge& route = event_to(topic, attempt, [](const dds::Sample&) {});
    const auto counted = [&](const char* name) { return route.counter("route " + topic, name); };
    for (int i = 0; i < 100 && counted("looped") == 0; ++i) {
      notify_often(80);
    }
    ASSERT_GT(counted("looped"), 0U) << "it is put on trial";
    notify_often(4400);  // longer than any trial
    const std::uint64_t looped = counted("looped");
    const std::uint64_t carried = counted("carried");
    notify_often(1000);
    goes_on = looped <= 400 && counted("looped") == looped && counted("carried") > carried;
  }
  EXPECT_TRUE(goes_on) << log_->str();
}

// Who reads here says that he is a bridge.
TEST_F(OldBridges, AreNotThoseWhoSayWhatTheyAre) {
  RunningBridge& first = add("routes:\n" + in("/chatter", 1));
  RunningBridge& second = add("routes:\n" + out("/chatter", 2, from_first_));
  offer(1);
  ASSERT_TRUE(subscribed(first, "/chatter"));
  ASSERT_TRUE(until([&] { return second.counter("route /chatter", "publishers") == 1; }));
  ASSERT_TRUE(until([&] { return first.counter("route /chatter", "readers") == 1; }));
  notify_often(500);
  ASSERT_TRUE(until([&] { return first.counter("route /chatter", "received") == 500; }));
  EXPECT_EQ(first.counter("route /chatter", "carried"), 500U);
  EXPECT_EQ(first.counter("route /chatter", "looped"), 0U);
}

// He answers a ROS service by a method of ours, which calls that ROS service.
TEST_F(OldBridges, AreKeptFromClosingARingWithAMethod) {
  RunningBridge& ours = add("methods:\n" + method("ros", 1));
  sd::Node node{io_, node_config()};
  sd::Proxy proxy{node, {.service = someip::ServiceId{1}}};
  int asked = 0;
  std::vector<Answer> answers;
  dds::ServiceServer* server = nullptr;
  server = &driver_.server(listener_, ros("/actuate", "std_srvs/srv/SetBool"),
                           [&](const dds::RequestId& id, const dds::ServiceMessage&) {
                             ++asked;
                             call(proxy, someip::MethodId{1}, hex("01"), answers);
                             const Bytes yes = hex("00010000 01000000 01000000 00");
                             const dds::ByteView bytes = yes;
                             server->reply(id, {&bytes, 1}, std::chrono::steady_clock::now());
                           });
  const std::string group = "method of ROS service /actuate";
  ASSERT_TRUE(until([&] { return ours.counter(group, "ready") == 1 && !proxy.available().empty(); }));
  for (int i = 0; i < several_; ++i) {
    call(proxy, someip::MethodId{1}, hex("01"), answers);
  }
  ASSERT_TRUE(until([&] { return ours.counter(group, "looped") > 0; }));
  run_for(a_while);
  EXPECT_LE(asked, 301 + 2 * several_);
  const int before = asked;
  expect_told("/actuate", "which has a server of it, and the SOME/IP client at ");
  run_for(a_while);
  EXPECT_LE(asked, before + 110) << "at most 200 a second, and as a rule none";
}

// He calls a ROS service for a method of his, which we call for that ROS service.
TEST_F(OldBridges, AreKeptFromClosingARingWithAService) {
  RunningBridge& ours = add("methods:\n" + method("someip", 1));
  int asked = 0;
  answering(ros("/actuate", "std_srvs/srv/SetBool"), [&](const dds::ServiceMessage&) {
    ++asked;
    return hex("00010000 01000000 01000000 00");
  });
  dds::ServiceClient& client = driver_.client(listener_, ros("/actuate", "std_srvs/srv/SetBool"));
  const Bytes bytes = hex("00010000 01");
  const dds::ByteView request = bytes;
  std::vector<Answer> answers;
  sd::Node node{io_, node_config()};
  int called = 0;
  const sd::Offer offered{
      node,
      {.service = someip::ServiceId{1},
       .instance = someip::InstanceId{1},
       .methods = {{someip::MethodId{1}, [&](const someip::Message&, sd::Responder to) {
                      ++called;
                      const auto waiting = std::make_shared<sd::Responder>(std::move(to));
                      client.call({&request, 1}, patience, std::chrono::steady_clock::now(),
                                  [waiting](const auto&) { waiting->respond(hex("01 00000004 efbbbf 00")); });
                    }}}}};
  const std::string group = "ROS service of method /actuate";
  ASSERT_TRUE(until([&] { return ours.counter(group, "ready") == 1 && client.ready(); }));
  ASSERT_TRUE(until([&] {  // he may have found the other server only
    ros_call(client, bytes, answers);
    run_for(20ms);
    return called > 0;
  }));
  for (int i = 0; i < several_; ++i) {
    ros_call(client, bytes, answers);
  }
  ASSERT_TRUE(until([&] { return ours.counter(group, "looped") > 0; }));
  run_for(a_while);
  const int before = asked;
  expect_told("/actuate", "which calls it, and the SOME/IP service at ");
  run_for(a_while);
  EXPECT_LE(asked, before + 110) << "at most 200 a second, and as a rule none";
}

}  // namespace
}  // namespace trestle::test::rings_test
