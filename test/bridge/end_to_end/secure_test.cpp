// A bridge with the keys and rights of an enclave (`dds: security`).
#include <gmock/gmock.h>

#include <filesystem>

#include "test/bridge/end_to_end/bridge_test.hpp"
#include "test/dds_adapter/keystore.hpp"

namespace trestle::test::secure_test {
namespace {

using someip::ServiceId;

class SecureBridge : public BridgeTest {
 protected:
  void SetUp() override { make_keystore(folder_); }
  ~SecureBridge() override {
    std::filesystem::remove_all(folder_);
    std::filesystem::remove(folder_ + ".log");
  }

  /// As BridgeTest's, in the enclave /vehicle/trestle.
  void start_in_enclave(const std::string& lists) {
    std::string text = bridge_head(1, domain_.id());
    const std::string open = "interfaces: [127.0.0.1]";
    text.replace(text.find(open), open.size(),
                 open + ", security: {keystore: " + folder_ + ", enclave: /vehicle/trestle}");
    bridge_ = std::make_unique<RunningBridge>(text + lists);
  }
  [[nodiscard]] dds::ParticipantConfig lidar() const {
    dds::ParticipantConfig result = config();
    result.node = "/lidar";
    result.enclave = "/lidar";
    result.security_folder = folder_ + "/enclaves/lidar";
    return result;
  }

  const std::string folder_ = testing::TempDir() + "trestle-secure-" + std::to_string(getpid());
};

// rt/allowed is what the keystore's enclaves may use.
constexpr const char* allowed =
    "routes:\n"
    "  - {topic: /allowed, type: std_msgs/msg/String, direction: dds_to_someip, service: 0x1234, instance: "
    "1, "
    "eventgroup: 1, event: 0x8001, port: 40001}\n";

TEST_F(SecureBridge, CarriesWhatItsEnclaveMayReadAndNothingOfOutsiders) {
  start_in_enclave(allowed);
  dds::Participant secure{lidar()};
  dds::Writer inside = secure.create_writer("rt/allowed", dds::ros_type_name(string_type), {});
  dds::Writer outside = writer("/allowed");
  sd::Node node{io_, peer_config()};
  std::vector<std::string> came;
  const sd::Subscription subscription{
      node,
      {.service = ServiceId{0x1234},
       .eventgroup = someip::EventgroupId{1},
       .events = {someip::MethodId{0x8001}}},
      [&](const someip::Message& event, const Endpoint&) { came.push_back(to_hex(event.payload)); }};
  ASSERT_TRUE(until([&] { return inside.matched() == 1 && subscription.active(); }));
  ASSERT_TRUE(until_counter("route /allowed", "publishers", 1));
  EXPECT_TRUE(outside.write(hello_cdr));
  ASSERT_TRUE(inside.write(hello_cdr));
  ASSERT_TRUE(until([&] { return !came.empty(); }));
  run_for(300ms);
  EXPECT_EQ(came, std::vector{to_hex(hello)});
  EXPECT_EQ(outside.matched(), 0U);
  EXPECT_EQ(bridge_->counter("route /allowed", "publishers"), 1U);
  EXPECT_EQ(bridge_->counter("route /allowed", "received"), 1U);
}

TEST_F(SecureBridge, SaysThatItsEnclaveMayNotDoWhatARouteNeeds) {
  std::string forbidden = allowed;
  forbidden.replace(forbidden.find("/allowed"), 8, "/forbidden");
  try {
    start_in_enclave(forbidden);
    ADD_FAILURE() << "it has started";
  } catch (const std::exception& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("rt/forbidden"));
  }
}

}  // namespace
}  // namespace trestle::test::secure_test
