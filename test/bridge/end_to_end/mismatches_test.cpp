// A SOME/IP service that is not what a route wants: in the log, though it tells warnings only, and counted.
#include <gmock/gmock.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <sstream>

#include "test/bridge/end_to_end/bridge_test.hpp"

namespace trestle::test::mismatches_test {
namespace {

using testing::HasSubstr;

class Mismatches : public BridgeTest {
 protected:
  Mismatches() {
    const auto sink = std::make_shared<spdlog::sinks::ostream_sink_mt>(log_);
    spdlog::set_default_logger(std::make_shared<spdlog::logger>("test", sink));
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
    return log_.str();
  }

  std::ostringstream log_;
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

}  // namespace
}  // namespace trestle::test::mismatches_test
