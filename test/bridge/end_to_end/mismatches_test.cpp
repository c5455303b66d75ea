// A SOME/IP service that is not what a route wants: in the log, though it tells warnings only, and counted.
#include <gmock/gmock.h>
#include <spdlog/spdlog.h>

#include "test/bridge/end_to_end/bridge_test.hpp"
#include "test/bridge/end_to_end/log_sink.hpp"

namespace trestle::test::mismatches_test {
namespace {

using testing::HasSubstr;

class Mismatches : public BridgeTest {
 protected:
  Mismatches() {
    spdlog::set_default_logger(std::make_shared<spdlog::logger>("test", log_));
    spdlog::set_level(spdlog::level::warn);
  }
  ~Mismatches() override {
    bridge_.reset();
    spdlog::set_default_logger(std::make_shared<spdlog::logger>("after"));
  }
  void start(const std::string& keys) {
    start_bridge(
        "routes:\n  - {topic: /text, type: std_msgs/msg/String, direction: someip_to_dds, service: 0x1234, "
        "instance: 1, eventgroup: 1, event: 0x8001" +
        keys + "}\n");
  }
  void offer(std::uint8_t major) {
    peer_.offer({.service = someip::ServiceId{0x1234},
                 .instance = someip::InstanceId{1},
                 .major = major,
                 .eventgroups = {{.id = someip::EventgroupId{1}, .events = {someip::MethodId{0x8001}}}}});
  }
  /// What the bridge logged until now, after its end.
  std::string log() {
    bridge_.reset();
    return log_->str();
  }

  const std::shared_ptr<LogSink> log_ = std::make_shared<LogSink>();
  sd::Node peer_{io_, peer_config()};
};

TEST_F(Mismatches, OfTheTransport) {
  start(", transport: tcp");
  offer(1);
  ASSERT_TRUE(until_counter("route /text", "other_transport", 1));
  EXPECT_THAT(log(), HasSubstr("SD cannot subscribe to eventgroup 0x0001 of 0x1234.0x0001 over TCP"));
}

TEST_F(Mismatches, OfTheVersion) {
  start(", major: 3");
  offer(1);
  ASSERT_TRUE(until_counter("route /text", "other_version", 1));
  EXPECT_THAT(log(), HasSubstr("SD 0x1234.0x0001 is wanted in version 3.any, but 127."));
}

TEST_F(Mismatches, ThatTheServerRefuses) {
  start(", subscribe: while_read");
  peer_.offer({.service = someip::ServiceId{0x1234}, .instance = someip::InstanceId{1}});
  Inbox<Bytes> inbox;
  {
    const auto reading = reader("/text", string_type, inbox);
    ASSERT_TRUE(until_counter("route /text", "refused", 1));
  }
  ASSERT_TRUE(until_counter("route /text", "readers", 0));
  EXPECT_EQ(bridge_->counter("route /text", "refused"), 1U) << "what was stays counted";
  const auto again = reader("/text", string_type, inbox);
  ASSERT_TRUE(until_counter("route /text", "refused", 2));
  EXPECT_THAT(log(),
              HasSubstr("SD subscription to eventgroup 0x0001 of 0x1234.0x0001 refused by the server"));
}

TEST_F(Mismatches, OfTheEventsId) {
  start("");
  const auto handle =
      peer_.offer({.service = someip::ServiceId{0x1234},
                   .instance = someip::InstanceId{1},
                   .eventgroups = {{.id = someip::EventgroupId{1}, .events = {someip::MethodId{0x8002}}}}});
  ASSERT_TRUE(until_counter("route /text", "subscribed", 1));
  const ByteView payload{hello};
  peer_.notify(handle, someip::MethodId{0x8002}, {&payload, 1});
  ASSERT_TRUE(until_counter("route /text", "unexpected", 1));
  ASSERT_TRUE(until([&] { return log_->has("nothing has come yet"); })) << "it is said after 5 s";
  EXPECT_THAT(log(),
              HasSubstr("/text: nothing has come yet: 1 event came with id 0x8002, the route waits for "
                        "0x8001"));
}

/// A route of a type whose fields a peer has in another order, with the same name.
class TypeMismatches : public Mismatches {
 protected:
  void start(const std::string& direction, const std::string& types) {
    bridge_ = std::make_unique<RunningBridge>(
        with_types(bridge_head(1, domain_.id()), types) +
        "routes:\n  - {topic: /text, type: std_msgs/msg/String, service: 0x1234, instance: 1, eventgroup: 1, "
        "event: 0x8001, direction: " +
        direction + "}\n");
  }
  static std::string with_types(std::string head, const std::string& types) {
    const std::string key = "domain:";
    return types.empty() ? head : head.replace(head.find(key), key.size(), "types: " + types + ", domain:");
  }
  static constexpr const char* other =
      "RIHS01_00000000000000000000000000000000000000000000000000000000000000aa";
  const dds::EndpointExtras extras_{.user_data = std::string{"typehash="} + other + ";"};
};

TEST_F(TypeMismatches, OfAPublisherAreNamed) {
  start("dds_to_someip, port: 40001", "");
  dds::Writer same = writer("/text");
  dds::Writer from = ros_.create_writer(dds::ros_topic_name("/text"), dds::ros_type_name(string_type), {},
                                        dds::default_max_sample_bytes, extras_);
  ASSERT_TRUE(until([&] { return from.matched() == 1 && same.matched() == 1; }));
  ASSERT_TRUE(until_counter("route /text", "publishers", 2));
  ASSERT_TRUE(from.write(hello_cdr));
  ASSERT_TRUE(until_counter("route /text", "received", 1)) << "is carried unless types are strict";
  ASSERT_TRUE(until([&] { return log_->has("its hash is"); }));
  const std::string told = log();
  EXPECT_THAT(told, HasSubstr("DDS rt/text: the publisher of this topic in "));
  EXPECT_THAT(told, HasSubstr(std::string{"its hash is "} + other + ", the route's is RIHS01_df668c74"));
  EXPECT_THAT(told, HasSubstr("write `dds: {types: strict}`"));
  EXPECT_EQ(told.find("its hash is", told.find("its hash is") + 1), std::string::npos) << "once";
}

TEST_F(TypeMismatches, OfAPublisherAreRefusedWhereTypesAreStrict) {
  start("dds_to_someip, port: 40001", "strict");
  dds::Writer same = writer("/text");
  std::optional from{ros_.create_writer(dds::ros_topic_name("/text"), dds::ros_type_name(string_type), {},
                                        dds::default_max_sample_bytes, extras_)};
  ASSERT_TRUE(until([&] { return from->matched() == 1 && same.matched() == 1; }));
  ASSERT_TRUE(until_counter("route /text", "publishers", 1)) << "one that is refused is none";
  ASSERT_TRUE(from->write(hello_cdr));
  ASSERT_TRUE(until_counter("route /text", "dds_other_type", 1));
  EXPECT_EQ(bridge_->counter("route /text", "received"), 0U);
  ASSERT_TRUE(same.write(hello_cdr));
  ASSERT_TRUE(until_counter("route /text", "received", 1)) << "others are heard";
  ASSERT_TRUE(until([&] { return log_->has("it is refused"); }));
  EXPECT_THAT(log(), HasSubstr("it is refused (`dds: {types: strict}`)"));
}

TEST_F(TypeMismatches, OfASubscriberAreNamed) {
  start("someip_to_dds", "");
  const dds::Reader to = ros_.create_reader(
      dds::ros_topic_name("/text"), dds::ros_type_name(string_type), {}, [](const dds::Sample&) {},
      dds::default_max_sample_bytes, extras_);
  ASSERT_TRUE(until_counter("route /text", "readers", 1));
  ASSERT_TRUE(until([&] { return log_->has("DDS rt/text: the subscriber"); }));
  EXPECT_THAT(log(), HasSubstr("DDS rt/text: the subscriber of this topic in "));
}

TEST_F(TypeMismatches, OfASubscriberAreRefusedWhereTypesAreStrict) {
  start("someip_to_dds", "strict");
  const auto handle =
      peer_.offer({.service = someip::ServiceId{0x1234},
                   .instance = someip::InstanceId{1},
                   .eventgroups = {{.id = someip::EventgroupId{1}, .events = {someip::MethodId{0x8001}}}}});
  Inbox<Bytes> other_inbox;
  Inbox<Bytes> inbox;
  const dds::Reader to = ros_.create_reader(
      dds::ros_topic_name("/text"), dds::ros_type_name(string_type), {},
      [&](const dds::Sample& sample) { other_inbox.put(copy(sample.cdr())); }, dds::default_max_sample_bytes,
      extras_);
  const dds::Reader same = reader("/text", string_type, inbox);
  ASSERT_TRUE(until_counter("route /text", "subscribed", 1));
  ASSERT_TRUE(until_counter("route /text", "dds_other_type", 1));
  ASSERT_TRUE(until([&] { return to.matched() == 1 && same.matched() == 1; })) << "as they see it";
  ASSERT_TRUE(until_counter("route /text", "readers", 1));
  const ByteView payload{hello};
  peer_.notify(handle, someip::MethodId{0x8001}, {&payload, 1});
  ASSERT_TRUE(until([&] { return inbox.size() == 1; }));
  run_for(300ms);
  EXPECT_EQ(other_inbox.size(), 0U);
  ASSERT_TRUE(until([&] { return log_->has("it is refused"); }));
  const std::string told = log();
  EXPECT_THAT(told, HasSubstr("DDS rt/text: the subscriber of this topic in "));
  EXPECT_THAT(told, HasSubstr("it is refused (`dds: {types: strict}`)"));
}

}  // namespace
}  // namespace trestle::test::mismatches_test
