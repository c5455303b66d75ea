// End-to-end protection of methods and fields at the bridge.
#include <gmock/gmock.h>

#include "dds_adapter/ros_names.hpp"
#include "test/bridge/end_to_end/services_end_to_end.hpp"
#include "test/covers.hpp"

namespace trestle::test::protected_calls_test {
namespace {

using someip::InstanceId;
using someip::MethodId;
using someip::ReturnCode;
using someip::ServiceId;
using testing::AllOf;
using testing::HasSubstr;
namespace e2e = someip::e2e;

constexpr ServiceId service{0x1234};
constexpr MethodId method{0x0021};
constexpr MethodId getter{0x0041};
constexpr MethodId setter{0x0042};
constexpr MethodId notifier{0x8044};
const e2e::Profile4m profile{{.data_id = 0x2d}};

std::string text_of(const Bytes& bytes) {
  std::string text;
  for (const std::byte one : bytes) {
    text += static_cast<char>(one);
  }
  return text;
}

class ProtectedCalls : public ServicesEndToEnd {
 protected:
  static sd::E2eSpec calls_of(MethodId id, const e2e::Config& config = profile) {
    return {.id = id, .protect = config, .check = config, .source_id = 0x123};
  }
  /// The error and the payload of a call's answer.
  Answer answer(sd::Proxy& proxy, MethodId id, const char* payload) {
    std::vector<Answer> answers;
    call(proxy, id, hex(payload), answers);
    EXPECT_TRUE(until([&] { return !answers.empty(); }));
    return answers.empty() ? Answer{} : answers[0];
  }
  Answer ros_answer(dds::ServiceClient& client, const char* request) {
    std::vector<Answer> answers;
    ros_call(client, hex(request), answers);
    EXPECT_TRUE(until([&] { return !answers.empty(); }));
    return answers.empty() ? Answer{} : answers[0];
  }
  /// std_srvs/srv/SetBool at /set, which says "on".
  void serve() {
    const auto place = std::make_shared<dds::ServiceServer*>(nullptr);
    *place = &driver_.server(ros_, ros("/set", "std_srvs/srv/SetBool"),
                             [this, place](const dds::RequestId& id, const dds::ServiceMessage&) {
                               ++asked_;
                               const Bytes reply = hex("00010000 01000000 03000000 6f6e00");
                               const dds::ByteView bytes = reply;
                               (*place)->reply(id, {&bytes, 1}, std::chrono::steady_clock::now());
                             });
  }
  const Bytes on_answer_ = hex("01 00000006 efbbbf 6f6e00");
  int asked_ = 0;
};

constexpr const char* set_by_ros =
    "methods:\n  - {ros_service: /set, type: std_srvs/srv/SetBool, server: ros, service: 0x1234, instance: "
    "1, "
    "method: 0x21, port: 40001, e2e: {profile: 4m, data_id: 0x2d";

TEST_F(ProtectedCalls, OfARosServiceAreCheckedAndAnsweredWithProtection) {
  covers({"feat_req_someip_102"});
  start_bridge(std::string{set_by_ros} + "}}\n");
  serve();
  sd::Node node{io_, node_config()};
  sd::NodeConfig other = node_config();
  other.address = own_address(3);
  sd::Node plain_node{io_, other};
  sd::Proxy proxy{node, {.service = service, .e2e = {calls_of(method)}}};
  sd::Proxy plain{plain_node, {.service = service}};
  for (int i = 0; i < 2; ++i) {
    const Answer good = answer(proxy, method, "01");
    EXPECT_FALSE(good.error) << good.error.message();
    EXPECT_EQ(good.payload, on_answer_);
    // Who does not protect is refused, with no protection of which the counter would be missed.
    const Answer bad = answer(plain, method, "00000000000000000000000000000000 01");
    EXPECT_EQ(bad.error, ReturnCode::e2e);
    EXPECT_TRUE(bad.payload.empty());
  }
  EXPECT_EQ(asked_, 2);
  const std::string group = "method of ROS service /set";
  EXPECT_EQ(bridge_->counter(group, "received"), 4U);
  EXPECT_EQ(bridge_->counter(group, "e2e_ok"), 2U);
  EXPECT_EQ(bridge_->counter(group, "e2e_error"), 2U);
  EXPECT_EQ(bridge_->counter(group, "answered"), 2U);
}

TEST_F(ProtectedCalls, ThatFailTheCheckAreCarriedIfToldSo) {
  start_bridge(std::string{set_by_ros} + ", failed: pass}}\n");
  serve();
  sd::Node node{io_, node_config()};
  sd::Proxy plain{node, {.service = service}};
  const Answer passed = answer(plain, method, "00000000000000000000000000000000 01");
  EXPECT_FALSE(passed.error) << passed.error.message();
  EXPECT_EQ(passed.payload.size(), 16 + on_answer_.size());
  EXPECT_EQ(asked_, 1);
  EXPECT_EQ(bridge_->counter("method of ROS service /set", "e2e_error"), 1U);
}

TEST_F(ProtectedCalls, OfASomeipMethodAreProtectedAndTheirAnswersChecked) {
  start_bridge(
      "methods:\n  - {ros_service: /set, type: std_srvs/srv/SetBool, server: someip, service: 0x1234, "
      "instance: 1, method: 0x21, e2e: {profile: 4m, data_id: 0x2d, source_id: 0x0abcdef}}\n");
  dds::ServiceClient& client = driver_.client(ros_, ros("/set", "std_srvs/srv/SetBool"));
  sd::Node node{io_, node_config()};
  std::vector<std::string> came;
  sd::ServiceSpec spec{.service = service,
                       .instance = InstanceId{1},
                       .methods = {{method, [&](const someip::Message& request, sd::Responder responder) {
                                      came.push_back(to_hex(request.payload));
                                      responder.respond(on_answer_);
                                    }}}};
  {
    const sd::Offer unprotected{node, spec};
    ASSERT_TRUE(until([&] { return client.ready(); }));
    // std_srvs has a way to say it: not success, but why.
    const Answer failed = ros_answer(client, "00010000 01");
    EXPECT_EQ(to_hex(failed.payload).substr(0, 10), "0001000000");
    EXPECT_THAT(text_of(failed.payload), HasSubstr("the answer fails its end-to-end check: error"));
    node.withdraw(unprotected.handle());
    ASSERT_TRUE(until([&] { return !client.ready(); }));
  }
  // Length (8 of the SOME/IP header, 16, 1), counter, Data ID, CRC, type 0 (request) and result 0 with the
  // source id; then `true`.
  ASSERT_EQ(came.size(), 1U);
  EXPECT_EQ(came[0].substr(0, 16), "001900000000002d");
  EXPECT_EQ(came[0].substr(24),
            "00abcdef"
            "01");
  spec.e2e = {{.id = method, .protect = profile, .check = profile}};
  const sd::Offer offer{node, spec};
  ASSERT_TRUE(until([&] { return client.ready(); }));
  const Answer good = ros_answer(client, "00010000 01");
  EXPECT_EQ(to_hex(good.payload).substr(0, 30),
            "000100000100000003000000"
            "6f6e00");
  EXPECT_EQ(came.back(), "01");
  const std::string group = "ROS service of method /set";
  EXPECT_EQ(bridge_->counter(group, "e2e_error"), 1U);
  EXPECT_EQ(bridge_->counter(group, "e2e_ok"), 1U);
  EXPECT_EQ(bridge_->counter(group, "failures_answered"), 1U);
  EXPECT_EQ(bridge_->counter(group, "answered"), 1U);
}

TEST_F(ProtectedCalls, OfAFieldHaveAProfileForEachPart) {
  start_bridge(
      "diagnostics: {topic: /state, period: 100 ms}\n"
      "fields:\n  - {topic: /light, type: std_msgs/msg/Int32, server: ros, service: 0x1234, instance: 1, "
      "event: 0x8044, eventgroup: 3, getter: 0x41, setter: 0x42, port: 40001, offer: always,\n"
      "     e2e: {event: {profile: 4, data_id: 1}, getter: {profile: 4m, data_id: 2}, setter: {profile: 44m, "
      "data_id: 3}}}\n");
  dds::Writer topic =
      ros_.create_writer(dds::ros_topic_name("/light"), dds::ros_type_name("std_msgs/msg/Int32"),
                         {.reliable = true, .transient_local = true, .depth = 1});
  ASSERT_TRUE(topic.write(hex("00010000 07000000")));
  Inbox<Bytes> states;
  const dds::Reader state = ros_.create_reader(
      dds::ros_topic_name("/state"), dds::ros_type_name("diagnostic_msgs/msg/DiagnosticArray"), {},
      [&](const dds::Sample& sample) { states.put(copy(sample.cdr())); });
  sd::Node node{io_, node_config()};
  std::vector<std::string> events;
  const sd::Subscription subscription{
      node,
      {.service = service,
       .eventgroup = someip::EventgroupId{3},
       .events = {notifier},
       .e2e = {{.id = notifier, .check = e2e::Config{e2e::Profile4{.data_id = 1}}}}},
      [&](const someip::Message& event, const Endpoint&) { events.push_back(to_hex(event.payload)); }};
  sd::Proxy proxy{node,
                  {.service = service,
                   .e2e = {calls_of(getter, e2e::Profile4m{{.data_id = 2}}),
                           calls_of(setter, e2e::Profile44m{{.data_id = 3}})}}};
  ASSERT_TRUE(until([&] { return bridge_->counter("route /light", "kept") == 1 || !events.empty(); }));
  ASSERT_TRUE(until([&] { return subscription.active(); }));
  ASSERT_TRUE(topic.write(hex("00010000 08000000")));
  ASSERT_TRUE(until([&] { return !events.empty() && events.back() == "00000008"; }));
  const Answer got = answer(proxy, getter, "");
  EXPECT_FALSE(got.error) << got.error.message();
  EXPECT_EQ(to_hex(got.payload), "00000008");
  // Nobody serves it: an error, but of a request that was understood.
  EXPECT_EQ(answer(proxy, setter, "00000009").error, ReturnCode::not_ready);
  sd::NodeConfig other = node_config();
  other.address = own_address(3);
  sd::Node plain_node{io_, other};
  sd::Proxy plain{plain_node, {.service = service}};
  EXPECT_EQ(answer(plain, getter, "").error, ReturnCode::e2e);
  EXPECT_EQ(bridge_->counter("getter of /light", "e2e_ok"), 1U);
  EXPECT_EQ(bridge_->counter("getter of /light", "e2e_error"), 1U);
  EXPECT_EQ(bridge_->counter("getter of /light", "answered"), 1U);
  EXPECT_EQ(bridge_->counter("method of ROS service /light/set", "e2e_ok"), 1U);
  EXPECT_EQ(bridge_->counter("method of ROS service /light/set", "unavailable"), 1U);
  std::string told;
  ASSERT_TRUE(until([&] {
    for (const Bytes& one : states.take()) {
      told = text_of(one);
    }
    return told.find(
               "e2e_error\0\0\0\2\0\0\0"
               "1",
               0, 17) != std::string::npos;
  })) << told;
  EXPECT_THAT(told, AllOf(HasSubstr("trestle: E2E of the getter of /light"),
                          HasSubstr("SOME/IP 0x1234.0x0001 method 0x0041"),
                          HasSubstr("trestle: E2E of requests to /light/set"),
                          HasSubstr("SOME/IP 0x1234.0x0001 method 0x0042")));
}

TEST_F(ProtectedCalls, RefusedValuesAreAskedForWithTheGettersProtection) {
  start_bridge(
      "fields:\n  - {topic: /light, type: std_msgs/msg/Int32, server: someip, service: 0x1234, instance: 1, "
      "getter: 0x41, setter: 0x42,\n"
      "     e2e: {getter: {profile: 4m, data_id: 2}, setter: {profile: 44m, data_id: 3}}}\n");
  sd::Node node{io_, node_config()};
  const sd::Offer offer{node,
                        {.service = service,
                         .instance = InstanceId{1},
                         .fields = {{.getter = getter,
                                     .setter = setter,
                                     .value = hex("00000007"),
                                     .on_set = [](ByteView) -> someip::Result<Bytes, ReturnCode> {
                                       return tl::unexpected{ReturnCode::not_ok};
                                     }}},
                         .e2e = {{.id = getter,
                                  .protect = e2e::Config{e2e::Profile4m{{.data_id = 2}}},
                                  .check = e2e::Config{e2e::Profile4m{{.data_id = 2}}}},
                                 {.id = setter,
                                  .protect = e2e::Config{e2e::Profile44m{{.data_id = 3}}},
                                  .check = e2e::Config{e2e::Profile44m{{.data_id = 3}}}}}}};
  dds::ServiceClient& set = driver_.client(ros_, ros("/light/set", "std_msgs_fields/srv/SetInt32"));
  ASSERT_TRUE(until([&] { return set.ready(); }));
  EXPECT_EQ(to_hex(ros_answer(set, "00010000 09000000").payload).substr(0, 16), "0001000007000000");
  EXPECT_EQ(bridge_->counter("ROS service of method /light/set", "refused"), 1U);
  EXPECT_EQ(bridge_->counter("ROS service of method /light/set", "e2e_ok"), 1U);
}

}  // namespace
}  // namespace trestle::test::protected_calls_test
