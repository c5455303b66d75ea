// Fields through a bridge: a latched topic with a get and a set service on one side, a notifier with getter
// and setter on the other. Values are std_msgs/msg/Int32: 7 is 07000000 in CDR and 00000007 in SOME/IP.
#include <gmock/gmock.h>

#include <algorithm>

#include "test/bridge/end_to_end/services_end_to_end.hpp"
#include "test/covers.hpp"

namespace trestle::test::fields_test {
namespace {

using someip::MethodId;
using someip::ReturnCode;
using testing::AnyOf;
using testing::ElementsAre;
using Seen = std::vector<std::string>;

constexpr someip::ServiceId service{0x1234};
constexpr someip::EventgroupId eventgroup{3};
constexpr MethodId getter{0x0041};
constexpr MethodId setter{0x0042};
constexpr MethodId notifier{0x8044};
constexpr dds::Qos latched{.reliable = true, .transient_local = true, .depth = 1};

class FieldsEndToEnd : public ServicesEndToEnd {
 protected:
  void start(const std::string& keys) {
    start_calm_bridge(
        "fields:\n  - {topic: /light, type: std_msgs/msg/Int32, service: 0x1234, instance: 1, event: "
        "0x8044, eventgroup: 3, getter: 0x41, setter: 0x42, " +
        keys + "}\n");
  }

  static sd::NodeConfig calm_config() { return calm(node_config()); }

  // --- The SOME/IP side -----------------------------------------------------------------------------------

  /// A field that is 100 at most, and refuses what is negative.
  static sd::ServiceSpec field(const char* value) {
    const auto on_set = [](ByteView wanted) -> someip::Result<Bytes, ReturnCode> {
      if (wanted.size() != 4 || (wanted[0] & std::byte{0x80}) != std::byte{0}) {
        return tl::unexpected{ReturnCode::not_ok};
      }
      return wanted[3] > std::byte{100} ? hex("00000064") : copy(wanted);
    };
    sd::ServiceSpec spec{.service = service, .instance = someip::InstanceId{1}};
    spec.fields = {
        {.getter = getter, .setter = setter, .notifier = notifier, .value = hex(value), .on_set = on_set}};
    spec.eventgroups = {{.id = eventgroup, .events = {notifier}}};
    return spec;
  }
  static sd::Subscription subscriber(sd::Node& node, Seen& seen, bool tcp = false) {
    return {
        node,
        {.service = service, .eventgroup = eventgroup, .events = {notifier}, .udp = !tcp, .tcp = tcp},
        [&seen](const someip::Message& event, const Endpoint&) { seen.push_back(to_hex(event.payload)); }};
  }
  /// Calls getter or setter: the payload, or what was wrong.
  std::string ask(sd::Proxy& proxy, MethodId id, const char* payload = "") {
    std::vector<Answer> answers;
    call(proxy, id, hex(payload), answers);
    if (!until([&] { return !answers.empty(); })) {
      return "nothing";
    }
    return answers[0].error ? answers[0].error.message() : to_hex(answers[0].payload);
  }

  // --- The ROS side ---------------------------------------------------------------------------------------

  dds::Reader reader(Inbox<std::string>& seen) {
    return ros_.create_reader(
        dds::ros_topic_name("/light"), dds::ros_type_name("std_msgs/msg/Int32"), latched,
        [&seen](const dds::Sample& sample) { seen.put(to_hex(sample.cdr()).substr(8)); });
  }
  dds::Writer writer() { return BridgeTest::writer("/light", "std_msgs/msg/Int32", latched); }
  /// What has come when there are as many as `count`, working the rest meanwhile.
  Seen arrived(Inbox<std::string>& seen, std::size_t count) {
    until([&] { return seen.size() >= count; });
    return seen.take();
  }
  dds::ServiceClient& get_client() {
    return driver_.client(ros_, ros("/light/get", "std_msgs_fields/srv/GetInt32"));
  }
  dds::ServiceClient& set_client() {
    return driver_.client(ros_, ros("/light/set", "std_msgs_fields/srv/SetInt32"));
  }
  std::string ask(dds::ServiceClient& client, const char* request) {
    std::vector<Answer> answers;
    ros_call(client, hex(request), answers);
    if (!until([&] { return !answers.empty(); })) {
      return "nothing";
    }
    // Samples end at a multiple of four bytes.
    return answers[0].error ? "no answer" : to_hex(answers[0].payload).substr(8, 8);
  }
  /// A node with a light: its set service takes what is not negative, and publishes it.
  dds::ServiceServer& set_server(dds::Writer& topic, Bytes& value) {
    return answering(ros("/light/set", "std_msgs_fields/srv/SetInt32"),
                     [&topic, &value](const dds::ServiceMessage& request) {
                       if ((request.cdr()[7] & std::byte{0x80}) == std::byte{0}) {
                         value = copy(request.cdr().first(8));
                         EXPECT_TRUE(topic.write(value));
                       }
                       return value;
                     });
  }
};

/// The same over UDP and TCP.
class FieldsOver : public FieldsEndToEnd, public testing::WithParamInterface<std::string> {
 protected:
  void start_over(const std::string& keys) { start(keys + ", transport: " + GetParam()); }
  /// As subscriber().
  static sd::Subscription over(sd::Node& node, Seen& seen) {
    return subscriber(node, seen, GetParam() == "tcp");
  }
};
INSTANTIATE_TEST_SUITE_P(Either, FieldsOver, testing::Values("udp", "tcp"),
                         [](const auto& transport) { return transport.param; });

TEST_P(FieldsOver, ASomeipFieldIsALatchedTopicWithTwoServices) {
  covers({"feat_req_someip_631", "feat_req_someip_633", "feat_req_someip_634"});
  sd::Node node{io_, calm_config()};
  sd::ServiceSpec spec = field("00000007");
  spec.tcp_port = 0;  // beside UDP
  if (GetParam() == "tcp") {
    spec.tcp_events = {notifier};
  }
  const sd::Offer offer{node, spec};
  start_over("server: someip");
  Inbox<std::string> seen;
  const dds::Reader early = reader(seen);
  EXPECT_THAT(arrived(seen, 1), ElementsAre("07000000"));
  offer.set(notifier, hex("00000008"));
  EXPECT_THAT(arrived(seen, 1), ElementsAre("08000000"));
  Inbox<std::string> seen_late;
  const dds::Reader late = reader(seen_late);
  EXPECT_THAT(arrived(seen_late, 1), ElementsAre("08000000"));

  dds::ServiceClient& get = get_client();
  dds::ServiceClient& set = set_client();
  ASSERT_TRUE(until([&] { return get.ready() && set.ready(); }));
  EXPECT_EQ(ask(get, "00010000 00"), "08000000");  // rosidl's byte for what is empty
  EXPECT_EQ(ask(set, "00010000 09000000"), "09000000");
  EXPECT_THAT(arrived(seen, 1), ElementsAre("09000000"));
  EXPECT_EQ(ask(set, "00010000 c8000000"), "64000000");  // what was taken, not what was wanted
  EXPECT_THAT(arrived(seen, 1), ElementsAre("64000000"));

  // A refusal is the old value, as with the field of a ROS node.
  EXPECT_EQ(ask(set, "00010000 ffffffff"), "64000000");
  EXPECT_EQ(bridge_->counter("ROS service of method /light/set", "refused"), 1U);
  EXPECT_EQ(bridge_->counter("ROS service of method /light/set", "errors"), 0U);
  EXPECT_EQ(ask(get, "00010000 00"), "64000000");
  EXPECT_EQ(seen.size(), 0U);
  EXPECT_EQ(came_by(node), GetParam());
}

TEST_F(FieldsEndToEnd, WithoutAGetterARefusalIsAnsweredWithWhatTheNotifierTold) {
  covers({"feat_req_someip_634"});
  sd::Node node{io_, calm_config()};
  sd::ServiceSpec spec = field("00000007");
  spec.fields[0].getter.reset();
  std::optional<sd::Offer> offer{std::in_place, node, spec};
  start_calm_bridge(
      "fields:\n  - {topic: /light, type: std_msgs/msg/Int32, server: someip, service: 0x1234, instance: 1, "
      "event: 0x8044, eventgroup: 3, setter: 0x42, subscribe: while_read}\n");
  const std::string group = "ROS service of method /light/set";
  dds::ServiceClient& set = set_client();
  ASSERT_TRUE(until([&] { return set.ready(); }));
  Inbox<std::string> seen;
  std::optional<dds::Reader> follower{reader(seen)};
  EXPECT_THAT(arrived(seen, 1), ElementsAre("07000000"));
  EXPECT_EQ(ask(set, "00010000 ffffffff"), "07000000");
  EXPECT_EQ(ask(set, "00010000 09000000"), "09000000");
  EXPECT_THAT(arrived(seen, 1), ElementsAre("09000000"));
  EXPECT_EQ(ask(set, "00010000 ffffffff"), "09000000");
  offer->set(notifier, hex("00000008"));
  EXPECT_THAT(arrived(seen, 1), ElementsAre("08000000"));
  EXPECT_EQ(ask(set, "00010000 ffffffff"), "08000000");
  EXPECT_EQ(bridge_->counter(group, "refused"), 3U);
  EXPECT_EQ(bridge_->counter(group, "errors"), 0U);
  // Nobody follows any more, so nobody knows.
  follower.reset();
  ASSERT_TRUE(until_counter("route /light", "subscribed", 0));
  std::vector<Answer> answers;
  ros_call(set, hex("00010000 ffffffff"), answers);
  ASSERT_TRUE(until_counter(group, "errors", 1));
  // A new follower gets what was last published, what the new subscription brings, or both: which comes first
  // is open.
  follower.emplace(reader(seen));
  EXPECT_THAT(arrived(seen, 1), AnyOf(ElementsAre("08000000"), ElementsAre("08000000", "08000000")));
  ASSERT_TRUE(until_counter("route /light", "subscribed", 1));
  // It is another field that comes back.
  offer.reset();
  ASSERT_TRUE(until([&] { return !set.ready(); }));
  spec.fields[0].value = std::nullopt;
  offer.emplace(node, spec);
  ASSERT_TRUE(until([&] { return set.ready(); }));
  ros_call(set, hex("00010000 ffffffff"), answers);
  ASSERT_TRUE(until_counter(group, "errors", 2));
  run_for(100ms);
  // The first call has ended with the service that it was put to.
  EXPECT_EQ(std::ranges::count_if(answers, [](const Answer& one) { return !one.error; }), 0);
}

TEST_F(FieldsEndToEnd, ASetterAloneAnswersARefusalWithWhatItAnsweredLast) {
  sd::Node node{io_, calm_config()};
  bool locked = false;
  sd::ServiceSpec spec{.service = service, .instance = someip::InstanceId{1}};
  spec.fields = {{.setter = setter, .on_set = [&](ByteView wanted) -> someip::Result<Bytes, ReturnCode> {
                    return locked ? someip::Result<Bytes, ReturnCode>{tl::unexpected{ReturnCode::not_ok}}
                                  : copy(wanted);
                  }}};
  const sd::Offer offer{node, spec};
  start_calm_bridge(
      "fields:\n  - {topic: /light, type: std_msgs/msg/Int32, server: someip, service: 0x1234, instance: 1, "
      "setter: 0x42}\n");
  const std::string group = "ROS service of method /light/set";
  dds::ServiceClient& set = set_client();
  ASSERT_TRUE(until([&] { return set.ready(); }));
  EXPECT_EQ(ask(set, "00010000 05000000"), "05000000");
  locked = true;
  EXPECT_EQ(ask(set, "00010000 06000000"), "05000000");
  EXPECT_EQ(bridge_->counter(group, "refused"), 1U);
  // That would say that it was taken.
  std::vector<Answer> answers;
  ros_call(set, hex("00010000 05000000"), answers);
  ASSERT_TRUE(until_counter(group, "errors", 1));
  EXPECT_EQ(bridge_->counter(group, "refused"), 1U);
  EXPECT_TRUE(answers.empty());
}

TEST_F(FieldsEndToEnd, AValueThatIsRefusedIsNotAnsweredWhereNobodySaysWhichItHas) {
  sd::Node node{io_, calm_config()};
  sd::ServiceSpec spec = field("00000007");
  spec.fields[0].getter.reset();
  const sd::Offer offer{node, spec};
  start_calm_bridge(
      "fields:\n  - {topic: /light, type: std_msgs/msg/Int32, server: someip, service: 0x1234, instance: 1, "
      "setter: 0x42}\n  - {topic: /other, type: std_msgs/msg/Int32, server: someip, service: 0x1234, "
      "instance: 1, getter: 0x41, setter: 0x43}\n");
  dds::ServiceClient& set = set_client();
  dds::ServiceClient& other = driver_.client(ros_, ros("/other/set", "std_msgs_fields/srv/SetInt32"));
  ASSERT_TRUE(until([&] { return set.ready() && other.ready(); }));
  std::vector<Answer> answers;
  ros_call(set, hex("00010000 ffffffff"), answers);
  ASSERT_TRUE(until_counter("ROS service of method /light/set", "errors", 1));
  ros_call(other, hex("00010000 ffffffff"), answers);  // neither method is there
  ASSERT_TRUE(until_counter("ROS service of method /other/set", "errors", 1));
  EXPECT_EQ(bridge_->counter("ROS service of method /other/set", "refused"), 0U);
  EXPECT_TRUE(answers.empty());
}

TEST_F(FieldsEndToEnd, TopicAndServicesGoWithTheSomeipServiceAndComeBackWithIt) {
  start("server: someip");
  sd::Node node{io_, calm_config()};
  Inbox<std::string> seen;
  const dds::Reader one = reader(seen);
  dds::ServiceClient& get = get_client();
  for (const auto& [value, cdr] : {std::pair{"00000001", "01000000"}, std::pair{"00000002", "02000000"}}) {
    const sd::Offer offer{node, field(value)};
    EXPECT_THAT(arrived(seen, 1), ElementsAre(cdr));
    ASSERT_TRUE(until([&] { return get.ready(); }));
    EXPECT_EQ(ask(get, "00010000 00"), cdr);
    Inbox<std::string> seen_late;
    const dds::Reader late = reader(seen_late);
    EXPECT_THAT(arrived(seen_late, 1), ElementsAre(cdr));
    node.withdraw(offer.handle());
    ASSERT_TRUE(until([&] { return !get.ready() && one.matched() == 0; }));
    // Its value has gone with it.
    Inbox<std::string> seen_after;
    const dds::Reader after = reader(seen_after);
    run_for(200ms);
    EXPECT_EQ(seen_after.size(), 0U);
  }
}

TEST_P(FieldsOver, ARosTopicWithASetServiceIsASomeipField) {
  covers({"feat_req_someip_631", "feat_req_someip_633", "feat_req_someip_634", "feat_req_someipsd_793"});
  dds::Writer topic = writer();
  Bytes value = hex("00010000 07000000");
  ASSERT_TRUE(topic.write(value));
  start_over("server: ros, port: 40001");
  set_server(topic, value);
  sd::Node node{io_, calm_config()};
  Seen events;
  const sd::Subscription early = over(node, events);
  ASSERT_TRUE(until([&] { return events == Seen{"00000007"}; })) << testing::PrintToString(events);
  sd::Proxy proxy{node, {.service = service}};
  EXPECT_EQ(ask(proxy, getter), "00000007");
  EXPECT_EQ(ask(proxy, setter, "00000009"), "00000009");
  ASSERT_TRUE(until([&] { return events.size() == 2; }));
  EXPECT_EQ(events[1], "00000009");
  EXPECT_EQ(ask(proxy, getter), "00000009");
  // A refusal is the old value.
  EXPECT_EQ(ask(proxy, setter, "ffffffff"), "00000009");
  EXPECT_EQ(ask(proxy, setter, "0000"), make_error_code(ReturnCode::malformed_message).message());
  ASSERT_TRUE(topic.write(hex("00010000 0a000000")));
  ASSERT_TRUE(until([&] { return events.size() == 3; }));
  EXPECT_EQ(events[2], "0000000a");
  EXPECT_EQ(ask(proxy, getter), "0000000a");
  EXPECT_EQ(bridge_->counter("getter of /light", "received"), 3U);
  EXPECT_EQ(bridge_->counter("getter of /light", "answered"), 3U);
  EXPECT_EQ(bridge_->counter("getter of /light", "without_value"), 0U);

  sd::NodeConfig other = calm_config();
  other.address = own_address(3);
  sd::Node second{io_, other};
  Seen late_events;
  const sd::Subscription late = over(second, late_events);
  ASSERT_TRUE(until([&] { return late_events == Seen{"0000000a"}; })) << testing::PrintToString(late_events);
  EXPECT_EQ(came_by(node), GetParam());
  EXPECT_EQ(came_by(second), GetParam());
}

// 1592 characters are 1600 bytes: ten segments of 160, where two would do.
TEST_F(FieldsEndToEnd, LargeValuesLeaveAsTheFieldSays) {
  covers({"feat_req_someiptp_772", "feat_req_someiptp_801"});
  const std::string keys =
      "type: std_msgs/msg/String, service: 0x1234, tp: {segment_bytes: 160, separation: 0 ms}";
  start_calm_bridge(
      "fields:\n  - {topic: /text, instance: 1, server: ros, event: 0x8044, eventgroup: 3, "
      "getter: 0x41, port: 40001, " +
      keys + "}\n  - {topic: /other, instance: 2, server: someip, setter: 0x42, " + keys + "}\n");
  Bytes text = hex("00010000 39060000");
  text.resize(text.size() + 1592, std::byte{'a'});
  text.push_back(std::byte{0});
  dds::Writer topic = BridgeTest::writer("/text", string_type, latched);
  ASSERT_TRUE(topic.write(text));
  {
    sd::Node node{io_, calm_config()};
    Seen events;
    const sd::Subscription subscription = subscriber(node, events);
    ASSERT_TRUE(until([&] { return events.size() == 1; }));
    EXPECT_EQ(events[0].size(), 3200U);
    EXPECT_EQ(node.counters().datagrams, 10U) << "the initial event";
    ASSERT_TRUE(topic.write(text));
    ASSERT_TRUE(until([&] { return events.size() == 2; }));
    EXPECT_EQ(node.counters().datagrams, 20U) << "a notification";
    sd::Proxy proxy{node, {.service = service, .instance = someip::InstanceId{1}}};
    EXPECT_EQ(ask(proxy, getter), events[0]);
    EXPECT_EQ(node.counters().datagrams, 30U) << "the getter's answer";
  }
  sd::Node node{io_, node_config()};  // its first offer may be taken for one of the node before
  sd::ServiceSpec spec{.service = service, .instance = someip::InstanceId{2}};
  spec.fields = {{.setter = setter}};
  const sd::Offer offer{node, spec};
  dds::ServiceClient& set = driver_.client(ros_, ros("/other/set", "std_msgs_fields/srv/SetString"));
  ASSERT_TRUE(until([&] { return set.ready(); }));
  std::vector<Answer> answers;
  ros_call(set, text, answers);
  ASSERT_TRUE(until([&] { return answers.size() == 1; }));
  EXPECT_EQ(node.counters().datagrams, 10U) << "the request";
}

TEST_F(FieldsEndToEnd, ARosFieldIsOfferedOnlyWhileAllOfItIsThere) {
  start("server: ros, port: 40001");
  sd::Node node{io_, calm_config()};
  std::vector<bool> offered;
  sd::Proxy proxy{node, {.service = service}, [&](const sd::RemoteService&, bool available) {
                    offered.push_back(available);
                  }};
  Seen events;
  const sd::Subscription subscription = subscriber(node, events);
  Bytes value = hex("00010000 01000000");
  {
    dds::Writer topic = writer();
    ASSERT_TRUE(topic.write(value));
    ASSERT_TRUE(until_counter("route /light", "publishers", 1));
    run_for(500ms);
    EXPECT_TRUE(offered.empty());
    set_server(topic, value);
    ASSERT_TRUE(until([&] { return offered == std::vector{true} && events == Seen{"00000001"}; }));
    driver_.end_servers();
  }
  ASSERT_TRUE(until([&] { return offered == (std::vector{true, false}); }));
  dds::Writer topic = writer();
  set_server(topic, value);
  ASSERT_TRUE(until([&] { return offered == (std::vector{true, false, true}); }));
  EXPECT_EQ(ask(proxy, getter),
            make_error_code(ReturnCode::not_ready).message());  // a new one, without value
  EXPECT_EQ(bridge_->counter("getter of /light", "without_value"), 1U);
  ASSERT_TRUE(topic.write(hex("00010000 02000000")));
  ASSERT_TRUE(until([&] { return events.size() == 2; }));
  EXPECT_EQ(events[1], "00000002");
  EXPECT_EQ(ask(proxy, getter), "00000002");
}

TEST_F(FieldsEndToEnd, ARosFieldThatIsAlwaysOfferedSaysWhatIsMissing) {
  start("server: ros, port: 40001, offer: always");
  sd::Node node{io_, calm_config()};
  sd::Proxy proxy{node, {.service = service}};
  const std::string not_ready = make_error_code(ReturnCode::not_ready).message();
  EXPECT_EQ(ask(proxy, getter), not_ready);
  EXPECT_EQ(ask(proxy, setter, "00000001"), not_ready);
  EXPECT_EQ(bridge_->counter("method of ROS service /light/set", "unavailable"), 1U);
}

TEST_F(FieldsEndToEnd, AGetServiceIsAskedWhereOneIsNamed) {
  start("server: ros, port: 40001, get_service: /light/now, wire: {struct_length: 32, byte_order: little}");
  dds::Writer topic = writer();
  ASSERT_TRUE(topic.write(hex("00010000 01000000")));
  Bytes value = hex("00010000 02000000");
  set_server(topic, value);
  std::string request;
  answering(ros("/light/now", "std_msgs_fields/srv/GetInt32"), [&](const dds::ServiceMessage& message) {
    request = to_hex(message.cdr());
    return hex("00010000 03000000");
  });
  sd::Node node{io_, calm_config()};
  sd::Proxy proxy{node, {.service = service}};
  EXPECT_EQ(ask(proxy, getter), "0000000403000000");  // one struct, not one in another
  EXPECT_EQ(request.substr(0, 10), "0001000000");
  EXPECT_EQ(ask(proxy, setter, "0000000404000000"), "0000000404000000");
}

TEST_F(FieldsEndToEnd, AServiceOfRosGetsAField) {
  // nav_msgs/srv/GetMap has one member of the value's type.
  start_calm_bridge(
      "fields:\n  - {topic: /map, type: nav_msgs/msg/OccupancyGrid, server: someip, service: 0x1234, "
      "instance: 1, "
      "getter: 0x41, get_type: nav_msgs/srv/GetMap, get_service: /static_map}\n");
  sd::Node node{io_, calm_config()};
  // stamp, frame "map", load time, resolution, 1 x 1, origin, data {100}
  const std::string grid =
      "00000001 00000002 00000007 efbbbf 6d617000 00000003 00000004 3f800000 00000001 00000001" +
      std::string(56 * 2, '0') + "00000001 64";
  sd::ServiceSpec spec{.service = service, .instance = someip::InstanceId{1}};
  spec.fields = {{.getter = getter, .value = hex(grid)}};
  const sd::Offer offer{node, spec};
  dds::ServiceClient& client = driver_.client(ros_, ros("/static_map", "nav_msgs/srv/GetMap"));
  ASSERT_TRUE(until([&] { return client.ready(); }));
  std::vector<Answer> answers;
  ros_call(client, hex("00010000 00"), answers);
  ASSERT_TRUE(until([&] { return answers.size() == 1; }));
  // After encapsulation, stamp, frame (with its length), load time, resolution, size: eight bytes aligned.
  EXPECT_EQ(to_hex(answers[0].payload).substr(0, 96),
            "00010000"
            "01000000"
            "02000000"
            "04000000"
            "6d617000"
            "03000000"
            "04000000"
            "0000803f"
            "01000000"
            "01000000"
            "00000000"
            "00000000");
  EXPECT_EQ(to_hex(answers[0].payload).substr(8 + 2 * (40 + 56), 10), "0100000064");
}

}  // namespace
}  // namespace trestle::test::fields_test
