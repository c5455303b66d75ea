// What a bridge tells everybody by discovery, as ROS 2's nodes do, seen by Cyclone DDS.
#include <gmock/gmock.h>

#include <filesystem>

#include "test/bridge/end_to_end/bridge_test.hpp"
#include "test/dds_adapter/cyclone_discovery.hpp"
#include "test/dds_adapter/keystore.hpp"

namespace trestle::test::user_data_test {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::StartsWith;
using testing::UnorderedElementsAre;

class UserData : public BridgeTest {
 protected:
  ~UserData() override {
    std::filesystem::remove_all(folder_);
    std::filesystem::remove(folder_ + ".log");
  }
  /// @param keys  further ones of `dds`.
  void start_with(const std::string& keys, const std::string& lists) {
    std::string text = bridge_head(1, domain_.id());
    const std::string open = "interfaces: [127.0.0.1]";
    text.replace(text.find(open), open.size(), open + keys);
    bridge_ = std::make_unique<RunningBridge>(text + lists);
  }
  const std::string folder_ = testing::TempDir() + "trestle-told-" + std::to_string(getpid());
};

// test/bridge/ros/golden.txt has these hashes from ROS 2 itself. That of the service is told by nodes since
// Lyrical.
TEST_F(UserData, OfAServicesEndsHasTheHashesOfTheMessageAndOfTheService) {
  const std::string request =
      "typehash=RIHS01_c62fbb99d94e1b25e8ef9e109f9581956bb1b3361a45a4e5810c36a90d29932e;";
  const std::string reply =
      "typehash=RIHS01_d0814e7f7b4880ab77e9c57426c7aa1562ab69f11eef8e2e968812f9cbd0b059;";
  const std::string of_service =
      "sertypehash=RIHS01_abe9e4bb6b41b40e6789712c00ec8871923e089af3f667a79992a428cff2da0a;";
  start_bridge(
      "methods:\n"
      "  - {ros_service: /ours, type: std_srvs/srv/SetBool, service: 0x1234, instance: 1, method: 1, server: "
      "someip}\n"
      "  - {ros_service: /theirs, type: std_srvs/srv/SetBool, service: 0x1235, instance: 1, method: 1, "
      "server: "
      "ros, port: 40001}\n");
  sd::Node node{io_, peer_config()};
  const sd::Offer offer{node, {.service = someip::ServiceId{0x1234}, .instance = someip::InstanceId{1}}};
  const CycloneDiscovery discovery{domain_.id()};
  ASSERT_TRUE(until([&] {
    return discovery.writers("rr/oursReply").size() == 1 && discovery.readers("rq/oursRequest").size() == 1 &&
           discovery.writers("rq/theirsRequest").size() == 1 &&
           discovery.readers("rr/theirsReply").size() == 1;
  }));
  EXPECT_THAT(discovery.readers("rq/oursRequest"),
              ElementsAre(StartsWith(request + of_service + "serviceid=")));
  EXPECT_THAT(discovery.writers("rr/oursReply"), ElementsAre(StartsWith(reply + of_service + "serviceid=")));
  EXPECT_THAT(discovery.writers("rq/theirsRequest"),
              ElementsAre(StartsWith(request + of_service + "clientid=")));
  EXPECT_THAT(discovery.readers("rr/theirsReply"), ElementsAre(StartsWith(reply + of_service + "clientid=")));
}

constexpr const char* allowed =
    "routes:\n"
    "  - {topic: /allowed, type: std_msgs/msg/String, direction: dds_to_someip, service: 0x1234, instance: "
    "1, "
    "eventgroup: 1, event: 0x8001, port: 40001}\n";

TEST_F(UserData, NamesNoEnclaveButTheRoot) {
  start_with("", allowed);
  const CycloneDiscovery discovery{domain_.id()};
  ASSERT_TRUE(until([&] { return discovery.participants().size() == 3; }));  // ros_, too, which is no node
  EXPECT_THAT(discovery.participants(), UnorderedElementsAre("", "", "enclave=/;"));
}

TEST_F(UserData, NamesTheEnclaveThatTheBridgeIsIn) {
  make_keystore(folder_);
  if (IsSkipped()) {
    return;
  }
  start_with(", security: {keystore: " + folder_ + ", enclave: /vehicle/trestle}", allowed);
  const CycloneDiscovery discovery{domain_.id()};
  EXPECT_TRUE(until([&] { return discovery.participants().size() == 3; }));
  EXPECT_THAT(discovery.participants(), Contains("enclave=/vehicle/trestle;"));
}

}  // namespace
}  // namespace trestle::test::user_data_test
