// ROS services and SOME/IP methods through a bridge, with a ROS peer on one side and a SOME/IP Node on the
// other.
#include <gmock/gmock.h>

#include <algorithm>

#include "test/bridge/end_to_end/services_end_to_end.hpp"
#include "test/covers.hpp"

namespace trestle::test::methods_test {
namespace {

using someip::MethodId;
using someip::ReturnCode;
using someip::ServiceId;
using testing::ElementsAre;

constexpr ServiceId service{0x1234};
constexpr MethodId method{0x0021};

class MethodsEndToEnd : public ServicesEndToEnd {
 protected:
  /// A bridge with methods, each given by lines of YAML; all belong to service 0x1234, instance 1.
  void start(const std::vector<std::string>& methods, const std::string& routes = "") {
    std::string lists = routes + "methods:\n";
    for (const std::string& one : methods) {
      lists += "  - {service: 0x1234, instance: 1, " + one + "}\n";
    }
    start_bridge(lists);
  }

  /// std_srvs/srv/SetBool: says which it was.
  dds::ServiceServer& set_bool_server(dds::RosForm form = dds::RosForm::automatic) {
    return answering(ros("/set", "std_srvs/srv/SetBool", form), [](const dds::ServiceMessage& request) {
      const bool on = request.cdr()[4] != std::byte{0};
      // success = data, message = "on" or "off"
      return on ? hex("00010000 01000000 03000000 6f6e00") : hex("00010000 00000000 04000000 6f666600");
    });
  }

  static constexpr const char* set_by_ros =
      "ros_service: /set, type: std_srvs/srv/SetBool, server: ros, method: 0x21, port: 40001";
  static constexpr const char* set_by_someip =
      "ros_service: /set, type: std_srvs/srv/SetBool, server: someip, method: 0x21";
  // true; and success, then "on" with a length, a byte order mark and a terminator.
  const Bytes on_ = hex("01");
  const Bytes on_answer_ = hex("01 00000006 efbbbf 6f6e00");
};

/// The same over UDP and TCP.
class MethodsOver : public MethodsEndToEnd, public testing::WithParamInterface<std::string> {
 protected:
  void start_over(const std::string& method) { start({method + ", transport: " + GetParam()}); }
};
INSTANTIATE_TEST_SUITE_P(Either, MethodsOver, testing::Values("udp", "tcp"),
                         [](const auto& transport) { return transport.param; });

TEST_P(MethodsOver, ASomeipClientCallsARosService) {
  covers({"feat_req_someip_625"});
  start_over(set_by_ros);
  set_bool_server();
  sd::Node node{io_, node_config()};
  sd::Proxy proxy{node, {.service = service}};
  std::vector<Answer> answers;
  call(proxy, method, on_, answers);
  ASSERT_TRUE(until([&] { return answers.size() == 1; }));
  EXPECT_FALSE(answers[0].error);
  EXPECT_EQ(to_hex(answers[0].payload), to_hex(on_answer_));
  call(proxy, method, hex("00"), answers);
  ASSERT_TRUE(until([&] { return answers.size() == 2; }));
  EXPECT_EQ(to_hex(answers[1].payload), "0000000007efbbbf6f666600");
  EXPECT_EQ(bridge_->counter("method of ROS service /set", "answered"), 2U);
  EXPECT_EQ(came_by(node), GetParam());
}

TEST_F(MethodsEndToEnd, ASomeipClientCallsARosServiceOfCyclonesForm) {
  start({std::string{set_by_ros} + ", ros_form: cyclonedds"});
  set_bool_server(dds::RosForm::cyclonedds);
  sd::Node node{io_, node_config()};
  sd::Proxy proxy{node, {.service = service}};
  std::vector<Answer> answers;
  call(proxy, method, on_, answers);
  ASSERT_TRUE(until([&] { return answers.size() == 1; }));
  EXPECT_EQ(to_hex(answers[0].payload), to_hex(on_answer_));
}

TEST_F(MethodsEndToEnd, TheMethodIsOfferedOnlyWhileTheRosServiceIsThere) {
  start({set_by_ros});
  sd::Node node{io_, node_config()};
  std::vector<bool> seen;
  sd::Proxy proxy{node, {.service = service}, [&](const sd::RemoteService&, bool available) {
                    seen.push_back(available);
                  }};
  run_for(500ms);
  EXPECT_TRUE(seen.empty());
  set_bool_server();
  ASSERT_TRUE(until([&] { return seen == std::vector{true}; }));
  driver_.end_servers();
  ASSERT_TRUE(until([&] { return seen == (std::vector{true, false}); }));
  set_bool_server();
  ASSERT_TRUE(until([&] { return seen == (std::vector{true, false, true}); }));
  std::vector<Answer> answers;
  call(proxy, method, on_, answers);
  ASSERT_TRUE(until([&] { return answers.size() == 1; }));
  EXPECT_FALSE(answers[0].error);
}

TEST_F(MethodsEndToEnd, SaysWhatWentWrongByReturnCode) {
  covers({"feat_req_someip_371"});
  start({std::string{set_by_ros} + ", offer: always, timeout: 3 s, max_message: 1024"});
  sd::Node node{io_, node_config()};
  sd::Proxy proxy{node, {.service = service}};
  std::vector<Answer> answers;
  // Nobody is there.
  call(proxy, method, on_, answers);
  ASSERT_TRUE(until([&] { return answers.size() == 1; }));
  EXPECT_EQ(answers[0].error, ReturnCode::not_ready);
  // Payloads that are none, or too much.
  call(proxy, method, {}, answers);
  ASSERT_TRUE(until([&] { return answers.size() == 2; }));
  EXPECT_EQ(answers[1].error, ReturnCode::malformed_message);
  call(proxy, method, Bytes(1025), answers);
  ASSERT_TRUE(until([&] { return answers.size() == 3; }));
  EXPECT_EQ(answers[2].error, ReturnCode::not_ok);
  // Somebody is there, but says nothing, and leaves.
  int came = 0;
  driver_.server(ros_, ros("/set", "std_srvs/srv/SetBool"),
                 [&](const dds::RequestId&, const dds::ServiceMessage&) { ++came; });
  ASSERT_TRUE(until_counter("method of ROS service /set", "ready", 1));
  call(proxy, method, on_, answers);
  ASSERT_TRUE(until([&] { return answers.size() == 4; }));
  EXPECT_EQ(answers[3].error, ReturnCode::timeout);
  EXPECT_EQ(came, 1);
  call(proxy, method, on_, answers);
  ASSERT_TRUE(until([&] { return came == 2; }));
  driver_.end_servers();
  ASSERT_TRUE(until([&] { return answers.size() == 5; }));
  EXPECT_EQ(answers[4].error, ReturnCode::not_reachable);
  const std::string group = "method of ROS service /set";
  EXPECT_EQ(bridge_->counter(group, "received"), 5U);
  EXPECT_EQ(bridge_->counter(group, "unavailable"), 1U);
  EXPECT_EQ(bridge_->counter(group, "not_convertible"), 1U);
  EXPECT_EQ(bridge_->counter(group, "too_large"), 1U);
  EXPECT_EQ(bridge_->counter(group, "timed_out"), 1U);
  EXPECT_EQ(bridge_->counter(group, "gone"), 1U);
  EXPECT_EQ(bridge_->counter(group, "answered"), 0U);
}

TEST_F(MethodsEndToEnd, AnAnswerThatCannotBeConvertedIsAnError) {
  start({set_by_ros});
  answering(ros("/set", "std_srvs/srv/SetBool"), [](const dds::ServiceMessage&) {
    return hex("00010000 01000000 ff000000");  // no such string
  });
  sd::Node node{io_, node_config()};
  sd::Proxy proxy{node, {.service = service}};
  std::vector<Answer> answers;
  call(proxy, method, on_, answers);
  ASSERT_TRUE(until([&] { return answers.size() == 1; }));
  EXPECT_EQ(answers[0].error, ReturnCode::not_ok);
  EXPECT_EQ(bridge_->counter("method of ROS service /set", "answers_not_convertible"), 1U);
}

TEST_P(MethodsOver, ARosClientCallsASomeipMethod) {
  start_over(set_by_someip);
  sd::Node node{io_, node_config()};
  const sd::Offer offer{node,
                        {.service = service,
                         .instance = someip::InstanceId{1},
                         .tcp_port = 0,  // beside UDP
                         .methods = {{method, [&](const someip::Message& request, sd::Responder responder) {
                                        EXPECT_EQ(to_hex(request.payload), "01");
                                        responder.respond(on_answer_);
                                      }}}}};
  dds::ServiceClient& client = driver_.client(ros_, ros("/set", "std_srvs/srv/SetBool"));
  ASSERT_TRUE(until([&] { return client.ready(); }));
  std::vector<Answer> answers;
  ros_call(client, hex("00010000 01"), answers);
  ASSERT_TRUE(until([&] { return answers.size() == 1; }));
  EXPECT_EQ(to_hex(answers[0].payload).substr(0, 30), "0001000001000000030000006f6e00");
  EXPECT_EQ(bridge_->counter("ROS service of method /set", "answered"), 1U);
  EXPECT_EQ(came_by(node), GetParam());
}

TEST_P(MethodsOver, TheRosServiceIsNotThereWhileTheOtherProtocolAloneIsOffered) {
  start_over(set_by_someip);
  sd::Node node{io_, node_config()};
  sd::ServiceSpec spec{.service = service, .instance = someip::InstanceId{1}};
  spec.methods = {
      {method, [&](const someip::Message&, sd::Responder responder) { responder.respond(on_answer_); }}};
  (GetParam() == "tcp" ? spec.udp_port : spec.tcp_port) = 0;
  (GetParam() == "tcp" ? spec.tcp_port : spec.udp_port).reset();
  dds::ServiceClient& client = driver_.client(ros_, ros("/set", "std_srvs/srv/SetBool"));
  {
    const sd::Offer other{node, spec};
    run_for(500ms);
    EXPECT_FALSE(client.ready());
  }
  std::swap(spec.udp_port, spec.tcp_port);
  const sd::Offer offer{node, spec};
  EXPECT_TRUE(until([&] { return client.ready(); }));
}

TEST_F(MethodsEndToEnd, TheRosServiceIsThereOnlyWhileTheSomeipServiceIs) {
  start({set_by_someip});
  sd::Node node{io_, node_config()};
  dds::ServiceClient& client = driver_.client(ros_, ros("/set", "std_srvs/srv/SetBool"));
  run_for(500ms);
  EXPECT_FALSE(client.ready());
  for (int round = 0; round < 2; ++round) {
    {
      const sd::Offer offer{node,
                            {.service = service,
                             .instance = someip::InstanceId{1},
                             .methods = {{method, [&](const someip::Message&, sd::Responder responder) {
                                            responder.respond(on_answer_);
                                          }}}}};
      ASSERT_TRUE(until([&] { return client.ready(); }));
      std::vector<Answer> answers;
      ros_call(client, hex("00010000 01"), answers);
      ASSERT_TRUE(until([&] { return answers.size() == 1; }));
      EXPECT_FALSE(answers[0].error);
    }
    ASSERT_TRUE(until([&] { return !client.ready(); }));
  }
}

/// What a response of std_srvs/srv/SetBool says: success, and the message.
std::pair<bool, std::string> set_bool_answer(const Answer& answer) {
  const auto number = std::to_integer<std::size_t>(answer.payload.at(8));  // of characters, with a zero
  std::string message;
  for (std::size_t i = 12; i + 1 < 12 + number; ++i) {
    message += static_cast<char>(answer.payload.at(i));
  }
  return {answer.payload.at(4) != std::byte{0}, message};
}

TEST_F(MethodsEndToEnd, ARosClientIsToldWhatWentWrongWhereTheTypeHasAWay) {
  start({std::string{set_by_someip} + ", timeout: 3 s, max_calls: 1"});  // longer than a machine stalls
  sd::Node node{io_, node_config()};
  int came = 0;
  const sd::Offer offer{node,
                        {.service = service,
                         .instance = someip::InstanceId{1},
                         .methods = {{method, [&](const someip::Message&, sd::Responder responder) {
                                        switch (came++) {
                                          case 0:
                                            responder.error(ReturnCode{0x21});
                                            return;
                                          case 1:
                                            responder.respond(hex("01 000000ff"));  // no such string
                                            return;
                                          default: {
                                            static sd::Responder kept;
                                            kept = std::move(responder);
                                          }
                                        }
                                      }}}}};
  dds::ServiceClient& client = driver_.client(ros_, ros("/set", "std_srvs/srv/SetBool"));
  ASSERT_TRUE(until([&] { return client.ready(); }));
  std::vector<Answer> answers;
  const auto said = [&](const char* request) {
    answers.clear();
    ros_call(client, hex(request), answers);
    return until([&] { return !answers.empty() && !answers[0].error; })
               ? set_bool_answer(answers[0])
               : std::pair<bool, std::string>{true, "no answer"};
  };
  EXPECT_EQ(said("00010000 01"),
            std::pair(false, std::string{
                                 "the answer is error 0x21 of SOME/IP service 0x1234.0x0001 method 0x0021"}));
  const auto [done, why] = said("00010000 01");
  EXPECT_FALSE(done);
  EXPECT_THAT(why, testing::MatchesRegex("the answer cannot be converted: .*there stands 00 00 00 ff.*"));
  EXPECT_EQ(
      said("00010000 01"),
      std::pair(false, std::string{"no answer in time of SOME/IP service 0x1234.0x0001 method 0x0021"}));
  EXPECT_THAT(said("00010000 07").second,
              testing::MatchesRegex("the request cannot be converted: .*there stands 07.*"));
  answers.clear();
  ros_call(client, hex("00010000 01"), answers);
  ASSERT_TRUE(until([&] { return came == 4; }));
  ros_call(client, hex("00010000 01"), answers);
  ASSERT_TRUE(until([&] { return answers.size() == 2; }));
  EXPECT_EQ(set_bool_answer(answers[0]),
            std::pair(false, std::string{"as many as `max_calls` wait for an answer"}));
  const std::string group = "ROS service of method /set";
  EXPECT_EQ(bridge_->counter(group, "errors"), 1U);
  EXPECT_EQ(bridge_->counter(group, "answers_not_convertible"), 1U);
  EXPECT_EQ(bridge_->counter(group, "timed_out"), 2U);
  EXPECT_EQ(bridge_->counter(group, "not_convertible"), 1U);
  EXPECT_EQ(bridge_->counter(group, "too_many"), 1U);
  EXPECT_EQ(bridge_->counter(group, "failures_answered"), 6U);
  EXPECT_EQ(bridge_->counter(group, "answered"), 0U);
}

TEST_F(MethodsEndToEnd, ARosClientGetsNoAnswerWhereTheTypeHasNoWayToSaySo) {
  start(
      {"ros_service: /set, type: rcl_interfaces/srv/GetParameterTypes, server: someip, method: 0x21, "
       "timeout: 3 s"});
  sd::Node node{io_, node_config()};
  int came = 0;
  const sd::Offer offer{node,
                        {.service = service,
                         .instance = someip::InstanceId{1},
                         .methods = {{method, [&](const someip::Message&, sd::Responder responder) {
                                        switch (came++) {
                                          case 0:
                                            responder.error(ReturnCode{0x21});
                                            return;
                                          case 1:
                                            responder.respond(hex("000000ff"));  // no such array
                                            return;
                                          default: {
                                            static sd::Responder kept;
                                            kept = std::move(responder);
                                          }
                                        }
                                      }}}}};
  dds::ServiceClient& client = driver_.client(ros_, ros("/set", "rcl_interfaces/srv/GetParameterTypes"));
  ASSERT_TRUE(until([&] { return client.ready(); }));
  std::vector<Answer> answers;
  const std::string group = "ROS service of method /set";
  ros_call(client, hex("00010000 00000000"), answers);
  ASSERT_TRUE(until_counter(group, "errors", 1));
  ros_call(client, hex("00010000 00000000"), answers);
  ASSERT_TRUE(until_counter(group, "answers_not_convertible", 1));
  ros_call(client, hex("00010000 00000000"), answers);
  ASSERT_TRUE(until_counter(group, "timed_out", 1));
  ros_call(client, hex("00010000 ff000000"), answers);  // no such array
  ASSERT_TRUE(until_counter(group, "not_convertible", 1));
  EXPECT_EQ(came, 3);
  EXPECT_TRUE(answers.empty());
  EXPECT_EQ(bridge_->counter(group, "answered"), 0U);
}

TEST_F(MethodsEndToEnd, MessagesWithoutFieldsHaveNoPayload) {
  start({"ros_service: /go, type: std_srvs/srv/Trigger, server: ros, method: 0x21, port: 40001",
         "ros_service: /clear, type: std_srvs/srv/Empty, server: ros, method: 0x22, port: 40001"});
  Bytes request;
  answering(ros("/go", "std_srvs/srv/Trigger"), [&](const dds::ServiceMessage& message) {
    request = copy(message.cdr());
    return hex("00010000 01000000 03000000 6f6e00");
  });
  answering(ros("/clear", "std_srvs/srv/Empty"),
            [](const dds::ServiceMessage&) { return hex("00010000 00"); });
  sd::Node node{io_, node_config()};
  sd::Proxy proxy{node, {.service = service}};
  std::vector<Answer> answers;
  call(proxy, method, {}, answers);
  ASSERT_TRUE(until([&] { return answers.size() == 1; }));
  EXPECT_EQ(to_hex(answers[0].payload), to_hex(on_answer_));
  EXPECT_EQ(to_hex(request).substr(0, 10), "0001000000");  // rosidl's one byte
  call(proxy, MethodId{0x22}, {}, answers);
  ASSERT_TRUE(until([&] { return answers.size() == 2; }));
  EXPECT_FALSE(answers[1].error);
  EXPECT_TRUE(answers[1].payload.empty());
}

TEST_P(MethodsOver, AHundredLargeCallsAreInFlightAtOnce) {
  // rcl_interfaces/srv/GetLoggerLevels: string[] names -> LoggerLevel[] levels; the names are echoed there.
  if (GetParam() == "udp") {
    covers({"feat_req_someiptp_762"});
  }
  start_over(
      "ros_service: /levels, type: rcl_interfaces/srv/ListParameters, server: ros, method: 0x21, port: "
      "40001");
  std::vector<dds::RequestId> ids;
  std::vector<std::uint8_t> last_bytes;
  dds::ServiceServer& server =
      driver_.server(ros_, ros("/levels", "rcl_interfaces/srv/ListParameters"),
                     [&](const dds::RequestId& id, const dds::ServiceMessage& message) {
                       ids.push_back(id);
                       // string[] prefixes of one element; its first character says which call it is
                       last_bytes.push_back(std::to_integer<std::uint8_t>(message.cdr()[12]));
                     });
  sd::Node node{io_, node_config()};
  sd::Proxy proxy{node, {.service = service}};
  std::array<std::vector<Answer>, 100> answers;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    // prefixes: 3007 bytes of one string of 3000 characters: BOM, characters, terminator; then depth 7
    Bytes payload = hex("00000bc0 00000bbc efbbbf");
    payload.insert(payload.end(), 3000, static_cast<std::byte>(0x21 + i % 90));
    payload.push_back(std::byte{0});
    const Bytes depth = hex("0000000000000007");
    payload.insert(payload.end(), depth.begin(), depth.end());
    call(proxy, method, std::move(payload), answers[i]);
  }
  ASSERT_TRUE(until([&] { return ids.size() == answers.size(); })) << ids.size();
  // Answered in the opposite order: two empty arrays but for one name that tells which it is.
  for (std::size_t i = ids.size(); i-- > 0;) {
    Bytes reply = hex("00010000 01000000 02000000");
    reply.push_back(static_cast<std::byte>(last_bytes[i]));
    const Bytes rest = hex("000000 00000000");
    reply.insert(reply.end(), rest.begin() + 0, rest.end());
    const dds::ByteView bytes = reply;
    server.reply(ids[i], {&bytes, 1}, std::chrono::steady_clock::now());
  }
  ASSERT_TRUE(until(
      [&] { return std::ranges::all_of(answers, [](const auto& answer) { return answer.size() == 1; }); }));
  for (std::size_t i = 0; i < answers.size(); ++i) {
    ASSERT_FALSE(answers[i][0].error) << answers[i][0].error.message();
    // names: 4 + 5 bytes of one string, after its length
    ASSERT_GT(answers[i][0].payload.size(), 11U);
    EXPECT_EQ(answers[i][0].payload[11], static_cast<std::byte>(0x21 + i % 90)) << i;
  }
  EXPECT_EQ(came_by(node), GetParam());
}

TEST_F(MethodsEndToEnd, NoMoreCallsThanConfiguredAreOutstanding) {
  start({std::string{set_by_ros} + ", max_calls: 2",
         "ros_service: /other, type: std_srvs/srv/SetBool, "
         "server: ros, method: 0x22, port: 40001, offer: always"});
  int came = 0;
  driver_.server(ros_, ros("/set", "std_srvs/srv/SetBool"),
                 [&](const dds::RequestId&, const dds::ServiceMessage&) { ++came; });
  sd::Node node{io_, node_config()};
  sd::Proxy proxy{node, {.service = service}};
  std::vector<Answer> answers;
  for (int i = 0; i < 3; ++i) {
    call(proxy, method, on_, answers);
  }
  ASSERT_TRUE(until([&] { return answers.size() == 1 && came == 2; }));
  EXPECT_EQ(answers[0].error, ReturnCode::not_ready);
  EXPECT_EQ(bridge_->counter("method of ROS service /set", "too_many"), 1U);
}

TEST_F(MethodsEndToEnd, FireAndForgetGoesBothWays) {
  covers({"feat_req_someip_345"});
  start({std::string{set_by_ros} + ", fire_and_forget: true"});
  dds::ServiceServer& server = set_bool_server();
  {
    sd::Node node{io_, node_config()};
    sd::Proxy proxy{node, {.service = service}};
    ASSERT_TRUE(until([&] { return !proxy.available().empty(); }));
    EXPECT_TRUE(proxy.send({.method = method}, on_));
    ASSERT_TRUE(until_counter("method of ROS service /set", "answered", 1));
    EXPECT_EQ(server.counters().replies, 1U);
    // A request that wants an answer is not for this method.
    std::vector<Answer> answers;
    call(proxy, method, on_, answers);
    ASSERT_TRUE(until([&] { return answers.size() == 1; }));
    EXPECT_EQ(answers[0].error, ReturnCode::wrong_message_type);
  }
  bridge_.reset();
  driver_.end_servers();
  start({std::string{set_by_someip} + ", fire_and_forget: true"});
  sd::Node node{io_, node_config()};
  std::string got;
  const sd::Offer offer{node,
                        {.service = service,
                         .instance = someip::InstanceId{1},
                         .methods = {{.id = method,
                                      .handler = [&](const someip::Message& request,
                                                     sd::Responder) { got = to_hex(request.payload); },
                                      .kind = someip::MethodKind::fire_and_forget}}}};
  dds::ServiceClient& client = driver_.client(ros_, ros("/set", "std_srvs/srv/SetBool"));
  ASSERT_TRUE(until([&] { return client.ready(); }));
  std::vector<Answer> answers;
  ros_call(client, hex("00010000 01"), answers);
  ASSERT_TRUE(until([&] { return answers.size() == 1 && !got.empty(); }));
  EXPECT_EQ(got, "01");
  EXPECT_EQ(to_hex(answers[0].payload).substr(0, 26), "00010000000000000100000000");  // all defaults
}

TEST_F(MethodsEndToEnd, AMethodAndAnEventShareAnOffer) {
  start({set_by_ros},
        "routes:\n"
        "  - {topic: /flag, type: std_msgs/msg/Bool, direction: dds_to_someip, service: 0x1234, instance: 1, "
        "eventgroup: 1, event: 0x8001, port: 40001}\n");
  set_bool_server();
  dds::Writer flag = writer("/flag", "std_msgs/msg/Bool");
  sd::Node node{io_, node_config()};
  sd::Proxy proxy{node, {.service = service}};
  std::vector<Answer> answers;
  call(proxy, method, on_, answers);
  ASSERT_TRUE(until([&] { return answers.size() == 1; }));
  EXPECT_FALSE(answers[0].error);
  std::string event;
  const sd::Subscription subscription{
      node,
      {.service = service, .eventgroup = someip::EventgroupId{1}, .events = {MethodId{0x8001}}},
      [&](const someip::Message& message, const Endpoint&) { event = to_hex(message.payload); }};
  ASSERT_TRUE(until([&] {
    static_cast<void>(flag.write(hex("00010000 01")));
    usleep(10'000);
    return !event.empty();
  }));
  EXPECT_EQ(event, "01");
}

}  // namespace
}  // namespace trestle::test::methods_test
