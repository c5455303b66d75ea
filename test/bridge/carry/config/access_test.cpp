// Who may do what: `access` of `someip`, and `peers` of routes, methods, fields, actions and patterns.
#include "bridge/carry/runtime/node_config.hpp"
#include "test/bridge/carry/config/problems_of.hpp"

namespace trestle::test::access_test {
namespace {

using namespace carry;
using sd::Access;
using someip::EventgroupId;
using someip::InstanceId;
using someip::MethodId;
using someip::ServiceId;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

const sd::Subnet office{IpAddress::v4(10, 1, 0, 0), 16};
const sd::Subnet host{IpAddress::v4(10, 1, 2, 3), 32};

std::string with_access(const std::string& access) {
  return "someip:\n  address: 10.0.0.1\n  access:\n" + access +
         "routes:\n  - {topic: /a, type: std_msgs/msg/String, direction: someip_to_dds, service: 1, "
         "instance: "
         "2, eventgroup: 3, event: 0x8004}\n";
}

std::string with_route(const std::string& keys) {
  return "someip: {address: 10.0.0.1}\nroutes:\n  - {topic: /a, type: std_msgs/msg/String, service: 1, "
         "instance: 2, eventgroup: 3, event: 0x8004, " +
         keys + "}\n";
}

TEST(AccessKeys, AreRead) {
  const sd::AccessControl access = config_of(with_access(R"(
    peers: [10.1.0.0/16, 10.1.2.3]
    refused_calls: drop
    others: deny
    rules:
      - {allow: [call, subscribe], service: 0x1000-0x1fff, instance: 7, methods: [1, 2], eventgroups: [3], peers: [10.1.2.3]}
      - {service: 0x2000, peers: []}
)"))
                                       .someip.access;
  EXPECT_THAT(access.peers, ElementsAre(office, host));
  EXPECT_FALSE(access.answer_calls);
  ASSERT_THAT(access.policies, SizeIs(1));
  EXPECT_FALSE(access.policies[0].allow_others);
  ASSERT_THAT(access.policies[0].rules, SizeIs(2));
  const sd::AccessRule& rule = access.policies[0].rules[0];
  EXPECT_THAT(rule.allow, ElementsAre(Access::call, Access::subscribe));
  EXPECT_EQ(rule.first_service, ServiceId{0x1000});
  EXPECT_EQ(rule.last_service, ServiceId{0x1fff});
  EXPECT_EQ(rule.instance, InstanceId{7});
  EXPECT_THAT(rule.methods, ElementsAre(MethodId{1}, MethodId{2}));
  EXPECT_THAT(rule.eventgroups, ElementsAre(EventgroupId{3}));
  EXPECT_THAT(rule.peers, ElementsAre(host));
  const sd::AccessRule& nobody = access.policies[0].rules[1];
  EXPECT_THAT(nobody.allow, IsEmpty());
  EXPECT_EQ(nobody.first_service, ServiceId{0x2000});
  EXPECT_EQ(nobody.last_service, ServiceId{0x2000});
  EXPECT_EQ(nobody.instance, someip::any_instance);
  EXPECT_THAT(nobody.peers, IsEmpty());
}

TEST(AccessKeys, AllowEverythingUnlessGiven) {
  const sd::NodeConfig node = node_config(config_of(with_route("direction: someip_to_dds")));
  EXPECT_THAT(node.access.peers, IsEmpty());
  EXPECT_THAT(node.access.policies, IsEmpty());
}

TEST(AccessKeys, HaveTheirMistakesToldWithTheirPlaces) {
  EXPECT_THAT(
      problems_of(with_access("    peers: [10.1.2.3/16]\n")),
      ElementsAre("b.yaml:4:12: error: peers: names nobody; leave it out to allow everybody",
                  "b.yaml:4:13: error: peers: expected an address or a subnet such as 192.168.10.5, "
                  "192.168.10.0/24 or fd00::/8, with no bits behind the prefix, found '10.1.2.3/16'"));
  EXPECT_THAT(problems_of(with_access("    peers: []\n")),
              ElementsAre("b.yaml:4:12: error: peers: names nobody; leave it out to allow everybody"));
  EXPECT_THAT(problems_of(with_access("    peers: [fd00::/8]\n")),
              ElementsAre("b.yaml:4:12: error: peers: fd00::/8 is not of the IP version of the address of "
                          "someip"));
  EXPECT_THAT(problems_of(with_access("    others: perhaps\n")),
              ElementsAre("b.yaml:4:13: error: others: expected one of allow, deny, found 'perhaps'"));
  EXPECT_THAT(
      problems_of(with_access("    rules:\n      - {allow: [offer], methods: [1], peers: [10.0.0.2]}\n")),
      ElementsAre("b.yaml:5:35: error: methods: is for rules that allow call"));
  EXPECT_THAT(
      problems_of(with_access("    rules:\n      - {allow: [call], eventgroups: [1], peers: [10.0.0.2]}\n")),
      ElementsAre("b.yaml:5:38: error: eventgroups: is for rules that allow subscribe"));
  EXPECT_THAT(
      problems_of(with_access("    rules:\n      - {service: 0x2000-0x1000, peers: []}\n")),
      ElementsAre("b.yaml:5:19: error: service: expected an id from 0x0001 to 0xfffe, or a range such "
                  "as 0x1000-0x1fff, found '0x2000-0x1000'"));
  EXPECT_THAT(problems_of(with_access("    rules:\n      - {service: 1}\n")),
              ElementsAre("b.yaml:5:9: error: 'peers' is missing in rule: expected a list of addresses and "
                          "subnets; []: nobody may"));
  EXPECT_THAT(problems_of(with_route("direction: someip_to_dds, peers: [fd00::1]")),
              ElementsAre(testing::HasSubstr("error: peers: fd00::1 is not of the IP version of the address "
                                             "of someip")));
}

std::string with_tls(const std::string& tls) {
  return "someip:\n  address: 10.0.0.1\n  tls: " + tls +
         "\nroutes:\n  - {topic: /a, type: std_msgs/msg/String, direction: someip_to_dds, service: 1, "
         "instance: "
         "2, eventgroup: 3, event: 0x8004}\n";
}

TEST(TlsKeys, AreRead) {
  if (!someip::has_tls()) {
    GTEST_SKIP() << "built without TLS";
  }
  const auto loaded =
      parse_config(with_tls("{certificate: hostname, key: /etc/passwd, ca: ../etc/group, peer_name: front, "
                            "handshake_timeout: 2 s}"),
                   "/etc/b.yaml");
  ASSERT_TRUE(loaded) << to_string(loaded.error().front());
  const someip::TlsSettings expected{.certificate_file = "/etc/hostname",
                                     .key_file = "/etc/passwd",
                                     .ca_file = "/etc/group",
                                     .peer_name = "front",
                                     .handshake_timeout = std::chrono::seconds{2}};
  EXPECT_EQ(loaded->config.someip.tls, expected);
  EXPECT_EQ(node_config(loaded->config).tls, expected);
  EXPECT_FALSE(node_config(config_of(with_route("direction: someip_to_dds"))).tls);
}

TEST(TlsKeys, HaveTheirMistakesToldWithTheirPlaces) {
  if (!someip::has_tls()) {
    EXPECT_THAT(problems_of(with_tls("{psk_identity: a, psk_key: /etc/passwd}")),
                ElementsAre(testing::HasSubstr("was built without TLS")));
    return;
  }
  EXPECT_THAT(problems_of(with_tls("{psk_identity: a, psk_key: none.hex}")),
              ElementsAre("b.yaml:3:35: error: psk_key: there is no file 'none.hex'"));
  EXPECT_THAT(problems_of(with_tls("{psk_identity: a}")),
              ElementsAre("b.yaml:3:8: error: tls: needs both psk_identity and psk_key"));
  EXPECT_THAT(
      problems_of(with_tls("{certificate: /etc/passwd, psk_identity: a}")),
      ElementsAre("b.yaml:3:8: error: tls: either certificates or a key that both ends know, not both"));
}

/// The only rule of a configuration.
sd::AccessRule rule_of(const std::string& text) {
  const sd::NodeConfig node = node_config(config_of(text));
  EXPECT_THAT(node.access.policies, SizeIs(1));
  if (node.access.policies.empty()) {
    return {};
  }
  EXPECT_TRUE(node.access.policies[0].allow_others);
  EXPECT_THAT(node.access.policies[0].rules, SizeIs(1));
  return node.access.policies[0].rules[0];
}

TEST(PeersOfARoute, MaySubscribeToItsEventgroup) {
  const sd::AccessRule rule = rule_of(with_route("direction: dds_to_someip, port: 40001, peers: [10.1.2.3]"));
  EXPECT_THAT(rule.allow, ElementsAre(Access::subscribe));
  EXPECT_EQ(rule.first_service, ServiceId{1});
  EXPECT_EQ(rule.last_service, ServiceId{1});
  EXPECT_EQ(rule.instance, InstanceId{2});
  EXPECT_THAT(rule.eventgroups, ElementsAre(EventgroupId{3}));
  EXPECT_THAT(rule.peers, ElementsAre(host));
}

TEST(PeersOfARoute, MayOfferItsService) {
  const sd::AccessRule rule = rule_of(with_route("direction: someip_to_dds, peers: [10.1.0.0/16]"));
  EXPECT_THAT(rule.allow, ElementsAre(Access::offer));
  EXPECT_EQ(rule.instance, InstanceId{2});
  EXPECT_THAT(rule.eventgroups, IsEmpty());
  EXPECT_THAT(rule.peers, ElementsAre(office));
}

TEST(PeersOfAMethod, MayCallOrOfferIt) {
  const std::string method =
      "someip: {address: 10.0.0.1}\nmethods:\n  - {ros_service: /a, type: std_srvs/srv/Trigger, service: 1, "
      "instance: 2, method: 5, peers: [10.1.2.3], ";
  const sd::AccessRule called = rule_of(method + "server: ros, port: 40001}\n");
  EXPECT_THAT(called.allow, ElementsAre(Access::call));
  EXPECT_THAT(called.methods, ElementsAre(MethodId{5}));
  EXPECT_EQ(called.instance, InstanceId{2});
  const sd::AccessRule offered = rule_of(method + "server: someip}\n");
  EXPECT_THAT(offered.allow, ElementsAre(Access::offer));
  EXPECT_THAT(offered.methods, IsEmpty());
}

TEST(PeersOfAField, MaySubscribeGetAndSet) {
  const sd::NodeConfig node =
      node_config(config_of("someip: {address: 10.0.0.1}\nfields:\n  - {topic: /a, type: "
                            "std_msgs/msg/String, server: ros, service: "
                            "1, instance: 2, port: 40001, event: 0x8001, eventgroup: 3, getter: 5, setter: "
                            "6, peers: [10.1.2.3]}\n"));
  ASSERT_THAT(node.access.policies, SizeIs(1));
  const auto& rules = node.access.policies[0].rules;
  ASSERT_THAT(rules, SizeIs(3));
  EXPECT_THAT(rules[0].eventgroups, ElementsAre(EventgroupId{3}));
  EXPECT_THAT(rules[1].methods, ElementsAre(MethodId{5}));
  EXPECT_THAT(rules[2].methods, ElementsAre(MethodId{6}));
}

TEST(PeersOfAPattern, MaySubscribeToWhateverItFinds) {
  const sd::AccessRule rule = rule_of(
      "someip: {address: 10.0.0.1}\nlock_file: none_such.lock\npatterns:\n  - {topics: /a/**, direction: "
      "dds_to_someip, services: 0x6000-0x6fff, port: 40001, peers: [10.1.2.3]}\n");
  EXPECT_THAT(rule.allow, ElementsAre(Access::subscribe));
  EXPECT_EQ(rule.first_service, ServiceId{0x6000});
  EXPECT_EQ(rule.last_service, ServiceId{0x6fff});
}

// The rules of the file and those of the routes must both allow.
TEST(PeersOfARoute, NarrowWhatTheFileAllows) {
  const sd::NodeConfig node = node_config(config_of(
      "someip: {address: 10.0.0.1, access: {rules: [{service: 1, peers: [10.1.0.0/16]}]}}\nroutes:\n  - "
      "{topic: "
      "/a, type: std_msgs/msg/String, service: 1, instance: 2, eventgroup: 3, event: 0x8004, direction: "
      "someip_to_dds, peers: [10.1.2.3]}\n"));
  EXPECT_THAT(node.access.policies, SizeIs(2));
}

}  // namespace
}  // namespace trestle::test::access_test
