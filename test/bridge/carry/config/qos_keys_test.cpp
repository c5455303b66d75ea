// Which quality of service is as published, and which is as it is written.
#include <gmock/gmock.h>

#include "bridge/carry/commands/summary.hpp"
#include "test/bridge/carry/config/problems_of.hpp"

namespace trestle::test::qos_keys_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string with(const std::string& keys) {
  return "someip: {address: 127.0.0.1}\n"
         "routes:\n"
         "  - {topic: /a, type: std_msgs/msg/String, service: 1, instance: 2, eventgroup: 3, event: 0x8004,\n"
         "     " +
         keys + "}\n";
}
carry::QosSettings qos_of(const std::string& keys) {
  return config_of(with(keys)).routes.at(0).qos;
}
/// Of a route to SOME/IP: whether reliability and durability are as published.
std::pair<bool, bool> follows(const std::string& keys) {
  const carry::QosSettings qos = qos_of("direction: dds_to_someip, port: 40001" + keys);
  return {qos.reliability_as_published, qos.durability_as_published};
}

TEST(QosKeys, AreAsPublishedByDefault) {
  EXPECT_EQ(follows(""), (std::pair{true, true}));
  EXPECT_EQ(follows(", qos: {depth: 1}"), (std::pair{true, true}));
  EXPECT_EQ(follows(", qos: {reliability: as_published, durability: as_published}"), (std::pair{true, true}));
  EXPECT_EQ(follows(", qos: {durability: volatile}"), (std::pair{true, false}));
  EXPECT_EQ(follows(", qos: {reliability: reliable}"), (std::pair{false, true}));
  EXPECT_EQ(follows(", qos: {durability: transient_local}"), (std::pair{false, false})) << "is reliable";
  EXPECT_EQ(follows(", qos: {reliability: best_effort}"), (std::pair{false, false})) << "is volatile";
  EXPECT_EQ(follows(", multicast: {address: 239.0.0.1, port: 40002, threshold: 1}"),
            (std::pair{true, false}));
  EXPECT_EQ(qos_of("direction: someip_to_dds"), carry::QosSettings{});
}

TEST(QosKeys, FollowNobodyWhereTheBridgePublishes) {
  EXPECT_THAT(problems_of(with("direction: someip_to_dds, qos: {durability: as_published}")),
              ElementsAre(HasSubstr("error: durability: as_published is for direction: dds_to_someip")));
}

}  // namespace
}  // namespace trestle::test::qos_keys_test
