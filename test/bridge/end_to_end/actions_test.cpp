// Actions through a bridge when something goes wrong: what an action client of ROS is told, and what a
// SOME/IP client is. The action is test_msgs/action/Fibonacci: int32 order, int32[] sequence.
#include <gmock/gmock.h>

#include <map>
#include <tuple>

#include "test/bridge/end_to_end/services_end_to_end.hpp"
#include "test/source_dir.hpp"

namespace trestle::test::actions_test {
namespace {

using someip::MethodId;
using someip::ReturnCode;
using someip::ServiceId;

constexpr ServiceId service{0x1234};
constexpr MethodId send_goal{0x11};
constexpr MethodId cancel_goal{0x12};
constexpr MethodId get_result{0x13};

const std::string goal_id = "000102030405060708090a0b0c0d0e0f";
// Requests as CDR: the goal, order 5; the goal to cancel, with no time; the goal whose result is asked for.
const std::string goal_cdr = "00010000" + goal_id + "05000000";
const std::string cancel_cdr = "00010000" + goal_id + "00000000 00000000";
const std::string result_cdr = "00010000" + goal_id;
// And as payloads.
const std::string goal_payload = goal_id + "00000005";
const std::string cancel_payload = goal_id + "00000000 00000000";

class ActionsEndToEnd : public ServicesEndToEnd {
 protected:
  void start(const std::string& keys) {
    start_bridge(
        "types: {paths: [" + test::source_dir() +
        "/test/bridge/ros/interfaces"
        "]}\n"
        "actions:\n  - {action: /count, type: test_msgs/action/Fibonacci, service: 0x1234, instance: 1, "
        "eventgroup: 1, methods: {send_goal: 0x11, cancel_goal: 0x12, get_result: 0x13}, events: "
        "{feedback: 0x8011, status: 0x8012}, " +
        keys + "}\n");
  }
  // --- The SOME/IP server, and clients of ROS -------------------------------------------------------------

  /// Offers the action's service; what its methods do is in `serve_`.
  sd::Offer offer(sd::Node& node) {
    sd::ServiceSpec spec{.service = service, .instance = someip::InstanceId{1}, .tcp_port = 0};
    for (const MethodId method : {send_goal, cancel_goal, get_result}) {
      spec.methods.push_back(
          {method, [this, method](const someip::Message& request, sd::Responder responder) {
             came_[method].push_back(to_hex(request.payload));
             serve_[method](responder);
           }});
    }
    spec.eventgroups = {{.id = someip::EventgroupId{1}, .events = {MethodId{0x8011}, MethodId{0x8012}}}};
    return {node, spec};
  }
  void all_answer(const std::function<void(sd::Responder&)>& how) {
    for (const MethodId method : {send_goal, cancel_goal, get_result}) {
      serve_[method] = how;
    }
  }
  struct Clients {
    dds::ServiceClient& goal;
    dds::ServiceClient& cancel;
    dds::ServiceClient& result;
    [[nodiscard]] bool ready() const { return goal.ready() && cancel.ready() && result.ready(); }
    [[nodiscard]] bool gone() const { return !goal.ready() && !cancel.ready() && !result.ready(); }
  };
  Clients clients() {
    return {driver_.client(ros_, ros("/count/_action/send_goal", "test_msgs/action/Fibonacci_SendGoal")),
            driver_.client(ros_, ros("/count/_action/cancel_goal", "action_msgs/srv/CancelGoal")),
            driver_.client(ros_, ros("/count/_action/get_result", "test_msgs/action/Fibonacci_GetResult"))};
  }
  /// The answer without its encapsulation.
  std::string ask(dds::ServiceClient& client, const std::string& request) {
    std::vector<Answer> answers;
    ros_call(client, hex(request), answers);
    if (!until([&] { return !answers.empty(); })) {
      return "nothing";
    }
    return answers[0].error ? "no answer" : to_hex(answers[0].payload).substr(8);
  }
  static std::string of_ros(const char* name) {
    return std::string{"ROS service of method /count/_action/"} + name;
  }

  // --- The server of ROS, and a SOME/IP client ------------------------------------------------------------

  /// What an action server is, each service answering as it is told, none if with nothing.
  void serve(const char* goal, const char* cancel, const char* result) {
    const auto one = [this](const char* name, const char* type, const char* answer) {
      const auto config = ros(std::string{"/count/_action/"} + name, type);
      if (answer == nullptr) {
        driver_.server(ros_, config, [this](const dds::RequestId&, const dds::ServiceMessage&) { ++kept_; });
      } else {
        answering(config, [answer](const dds::ServiceMessage&) { return hex(answer); });
      }
    };
    one("send_goal", "test_msgs/action/Fibonacci_SendGoal", goal);
    one("cancel_goal", "action_msgs/srv/CancelGoal", cancel);
    one("get_result", "test_msgs/action/Fibonacci_GetResult", result);
    writers_.push_back(writer("/count/_action/feedback", "test_msgs/action/Fibonacci_FeedbackMessage"));
    writers_.push_back(writer("/count/_action/status", "action_msgs/msg/GoalStatusArray",
                              {.reliable = true, .transient_local = true, .depth = 1}));
  }
  void end_server() {
    driver_.end_servers();
    writers_.clear();
  }
  Answer ask(sd::Proxy& proxy, MethodId id, const std::string& payload) {
    std::vector<Answer> answers;
    call(proxy, id, hex(payload), answers);
    EXPECT_TRUE(until([&] { return !answers.empty(); }));
    return answers.empty() ? Answer{boost::asio::error::timed_out, {}} : answers[0];
  }
  static std::string of_someip(const char* name) {
    return std::string{"method of ROS service /count/_action/"} + name;
  }

  std::map<MethodId, std::function<void(sd::Responder&)>> serve_;
  std::map<MethodId, std::vector<std::string>> came_;
  std::vector<dds::Writer> writers_;
  int kept_ = 0;
};

/// The same over UDP and TCP.
class ActionsOver : public ActionsEndToEnd, public testing::WithParamInterface<std::string> {
 protected:
  void start_over(const std::string& keys) { start(keys + ", transport: " + GetParam()); }
};
INSTANTIATE_TEST_SUITE_P(Either, ActionsOver, testing::Values("udp", "tcp"),
                         [](const auto& transport) { return transport.param; });

// --- server: someip ---------------------------------------------------------------------------------------

TEST_P(ActionsOver, WhatASomeipServerRefusesIsSaidAsAnActionServerSaysIt) {
  start_over("server: someip");
  sd::Node node{io_, node_config()};
  const sd::Offer offered = offer(node);
  const Clients ros = clients();
  ASSERT_TRUE(until([&] { return ros.ready(); }));
  // By its answers: not accepted, at 1 s and 2 ns; ERROR_UNKNOWN_GOAL_ID; STATUS_UNKNOWN.
  serve_[send_goal] = [](sd::Responder& to) { to.respond(hex("00 00000001 00000002")); };
  serve_[cancel_goal] = [](sd::Responder& to) { to.respond(hex("02 00000000")); };
  serve_[get_result] = [](sd::Responder& to) { to.respond(hex("00 00000000")); };
  EXPECT_EQ(ask(ros.goal, goal_cdr), "000000000100000002000000");
  EXPECT_EQ(ask(ros.cancel, cancel_cdr), "0200000000000000");
  EXPECT_EQ(ask(ros.result, result_cdr), "0000000000000000");
  EXPECT_EQ(came_[send_goal].back(), goal_payload);
  EXPECT_EQ(came_[cancel_goal].back(), to_hex(hex(cancel_payload)));
  EXPECT_EQ(came_[get_result].back(), goal_id);
  EXPECT_EQ(bridge_->counter(of_ros("send_goal"), "answered"), 1U);
  EXPECT_EQ(bridge_->counter(of_ros("send_goal"), "failures_answered"), 0U);
  // By an error: not accepted; ERROR_REJECTED; STATUS_UNKNOWN.
  all_answer([](sd::Responder& to) { to.error(ReturnCode{0x21}); });
  EXPECT_EQ(ask(ros.goal, goal_cdr), "000000000000000000000000");
  EXPECT_EQ(ask(ros.cancel, cancel_cdr), "0100000000000000");
  EXPECT_EQ(ask(ros.result, result_cdr), "0000000000000000");
  for (const char* name : {"send_goal", "cancel_goal", "get_result"}) {
    EXPECT_EQ(bridge_->counter(of_ros(name), "errors"), 1U) << name;
    EXPECT_EQ(bridge_->counter(of_ros(name), "failures_answered"), 1U) << name;
  }
  // What is no request is not put to the server.
  EXPECT_EQ(ask(ros.goal, "00010000 0001"), "000000000000000000000000");
  EXPECT_EQ(ask(ros.cancel, "00010000 0001"), "0100000000000000");
  EXPECT_EQ(ask(ros.result, "00010000 0001"), "0000000000000000");
  EXPECT_EQ(came_[send_goal].size() + came_[cancel_goal].size() + came_[get_result].size(), 6U);
  EXPECT_EQ(came_by(node), GetParam());
}

TEST_F(ActionsEndToEnd, WhatMayHaveBeenDoneIsNotSaidToHaveFailed) {
  start("server: someip, timeout: 3 s, result_timeout: 3 s");  // longer than a machine stalls
  sd::Node node{io_, node_config()};
  const sd::Offer offered = offer(node);
  const Clients ros = clients();
  ASSERT_TRUE(until([&] { return ros.ready(); }));
  std::vector<Answer> answers;
  std::vector<sd::Responder> kept;
  const auto ask_all = [&] {
    ros_call(ros.goal, hex(goal_cdr), answers);
    ros_call(ros.cancel, hex(cancel_cdr), answers);
    ros_call(ros.result, hex(result_cdr), answers);
  };
  const auto all_count = [&](const char* name, std::uint64_t number) {
    return until([&] {
      return bridge_->counter(of_ros("send_goal"), name) == number &&
             bridge_->counter(of_ros("cancel_goal"), name) == number &&
             bridge_->counter(of_ros("get_result"), name) == number;
    });
  };
  // No answer; one that cannot be understood; what another bridge says of an action server that has not
  // answered, and of one that has gone meanwhile.
  all_answer([&](sd::Responder& to) { kept.push_back(std::move(to)); });
  ask_all();
  EXPECT_TRUE(all_count("timed_out", 1));
  EXPECT_EQ(kept.size(), 3U);
  all_answer([](sd::Responder& to) { to.respond(hex("01")); });
  ask_all();
  EXPECT_TRUE(all_count("answers_not_convertible", 1));
  all_answer([](sd::Responder& to) { to.error(ReturnCode::timeout); });
  ask_all();
  EXPECT_TRUE(all_count("errors", 1));
  all_answer([](sd::Responder& to) { to.error(ReturnCode::not_reachable); });
  ask_all();
  EXPECT_TRUE(all_count("errors", 2));
  EXPECT_TRUE(all_count("failures_answered", 0));
  EXPECT_TRUE(all_count("in_flight", 0));
  EXPECT_TRUE(answers.empty());
  // The action is as good as before.
  serve_[send_goal] = [](sd::Responder& to) { to.respond(hex("01 00000001 00000002")); };
  EXPECT_EQ(ask(ros.goal, goal_cdr), "010000000100000002000000");
  EXPECT_TRUE(answers.empty());
}

TEST_F(ActionsEndToEnd, ResultsThatWaitForAServerThatGoesAreNotMadeUp) {
  start("server: someip, result_timeout: 3 s, max_calls: 2");
  sd::Node node{io_, node_config()};
  const Clients ros = clients();
  std::vector<Answer> answers;
  std::vector<sd::Responder> kept;
  serve_[get_result] = [&](sd::Responder& to) { kept.push_back(std::move(to)); };
  {
    const sd::Offer offered = offer(node);
    ASSERT_TRUE(until([&] { return ros.ready(); }));
    ros_call(ros.result, hex(result_cdr), answers);
    ros_call(ros.result, hex(result_cdr), answers);
    ASSERT_TRUE(until([&] { return kept.size() == 2; }));
    EXPECT_EQ(bridge_->counter(of_ros("get_result"), "in_flight"), 2U);
    // One more than may wait: it is told so, as far as its type can.
    EXPECT_EQ(ask(ros.result, result_cdr), "0000000000000000");
    EXPECT_EQ(bridge_->counter(of_ros("get_result"), "too_many"), 1U);
  }
  ASSERT_TRUE(until([&] { return ros.gone(); }));
  ASSERT_TRUE(until_counter(of_ros("get_result"), "in_flight", 0));
  EXPECT_EQ(bridge_->counter(of_ros("get_result"), "failures_answered"), 1U) << "of the one too many";
  // Another server knows nothing of these goals, and serves its own.
  const sd::Offer offered = offer(node);
  ASSERT_TRUE(until([&] { return ros.ready(); }));
  serve_[get_result] = [](sd::Responder& to) { to.respond(hex("04 00000004 00000007")); };
  EXPECT_EQ(ask(ros.result, result_cdr), "040000000100000007000000");
  EXPECT_TRUE(answers.empty() || answers[0].error);
}

// --- server: ros ------------------------------------------------------------------------------------------

TEST_P(ActionsOver, WhatAnActionServerRefusesASomeipClientIsTold) {
  start_over("server: ros, port: 40001");
  serve("00010000 00000000 01000000 02000000", "00010000 02000000 00000000", "00010000 00000000 00000000");
  sd::Node node{io_, node_config()};
  sd::Proxy proxy{node, {.service = service}};
  for (const auto& [id, request, answer] : {std::tuple{send_goal, goal_payload, "000000000100000002"},
                                            std::tuple{cancel_goal, cancel_payload, "0200000000"},
                                            std::tuple{get_result, goal_id, "0000000000"}}) {
    const Answer said = ask(proxy, id, request);
    EXPECT_FALSE(said.error) << said.error.message();
    EXPECT_EQ(to_hex(said.payload), answer);
    EXPECT_EQ(ask(proxy, id, "0001").error, ReturnCode::malformed_message);
  }
  EXPECT_EQ(came_by(node), GetParam());
}

TEST_F(ActionsEndToEnd, AnActionServerThatGoesTakesItsGoalsWithIt) {
  start("server: ros, port: 40001, timeout: 300 ms");
  serve(nullptr, nullptr, nullptr);
  sd::Node node{io_, node_config()};
  std::vector<bool> offered;
  sd::Proxy proxy{node, {.service = service}, [&](const sd::RemoteService&, bool available) {
                    offered.push_back(available);
                  }};
  ASSERT_TRUE(until([&] { return offered == std::vector{true}; }));
  EXPECT_EQ(ask(proxy, send_goal, goal_payload).error, ReturnCode::timeout);
  std::vector<Answer> answers;
  call(proxy, get_result, hex(goal_id), answers);  // which may take as long as the goal does
  ASSERT_TRUE(until([&] { return kept_ == 2; }));
  run_for(500ms);
  EXPECT_TRUE(answers.empty());
  end_server();
  ASSERT_TRUE(until([&] { return answers.size() == 1 && offered == (std::vector{true, false}); }));
  EXPECT_EQ(answers[0].error, ReturnCode::not_reachable);
  EXPECT_EQ(bridge_->counter(of_someip("get_result"), "gone"), 1U);
  EXPECT_EQ(bridge_->counter(of_someip("send_goal"), "timed_out"), 1U);
  EXPECT_EQ(bridge_->counter(of_someip("get_result"), "in_flight"), 0U);
  // The next one begins anew.
  serve("00010000 01000000 01000000 02000000", "00010000 00000000 00000000", "00010000 04000000 00000000");
  ASSERT_TRUE(until([&] { return offered == (std::vector{true, false, true}); }));
  // Again, if the machine stalls for as long as an answer may take.
  EXPECT_TRUE(
      until([&] { return to_hex(ask(proxy, send_goal, goal_payload).payload) == "010000000100000002"; }));
  EXPECT_EQ(to_hex(ask(proxy, get_result, goal_id).payload), "0400000000");
}

}  // namespace
}  // namespace trestle::test::actions_test
