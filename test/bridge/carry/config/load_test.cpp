#include "bridge/carry/config/load.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "test/bridge/carry/config/good_config.hpp"
#include "test/bridge/carry/config/problems_of.hpp"
#include "test/covers.hpp"

namespace trestle::test::load_test {
namespace {

using namespace carry;
using namespace std::chrono_literals;
using someip::EventgroupId;
using someip::FieldWidth;
using someip::InstanceId;
using someip::MethodId;
using someip::PayloadRules;
using someip::ServiceId;
using testing::ElementsAre;
using testing::IsEmpty;

BridgeConfig load_good(const std::string& text, const TypeCheck& check = {}) {
  const auto loaded = parse_config(text, "bridge.yaml", check);
  if (!loaded) {
    ADD_FAILURE() << to_string(loaded.error().front());
    return {};
  }
  EXPECT_THAT(loaded->warnings, IsEmpty());
  return loaded->config;
}

constexpr const char* smallest = R"(
someip: {address: 127.0.0.1}
routes:
  - {topic: /a, type: std_msgs/msg/String, direction: someip_to_dds, service: 1, instance: 2, eventgroup: 3, event: 0x8004}
)";

TEST(LoadConfig, ReadsEveryKey) {
  covers({"feat_req_someip_658", "feat_req_someip_659", "feat_req_someip_733"});
  const BridgeConfig config = load_good(good_config);
  EXPECT_EQ(config.file, "bridge.yaml");
  EXPECT_EQ(config.someip.address, IpAddress::v4(192, 0, 2, 1));
  EXPECT_EQ(config.someip.multicast_interface, "eth0");
  const sd::Timing timing{.initial_delay_min = 20ms,
                          .initial_delay_max = 200ms,
                          .repetitions_base_delay = 40ms,
                          .repetitions_max = 4,
                          .cyclic_offer_delay = 2s,
                          .request_response_delay_min = 5ms,
                          .request_response_delay_max = 15ms,
                          .ttl_s = 10};
  EXPECT_EQ(config.someip.timing, timing);
  EXPECT_EQ(config.someip.multicast, IpAddress::v4(239, 1, 2, 3));
  EXPECT_EQ(config.someip.port, 30491);
  EXPECT_EQ(config.dds.domain, 7U);
  EXPECT_THAT(config.dds.interfaces, ElementsAre("127.0.0.1", "192.0.2.7"));
  EXPECT_EQ(config.dds.shared_memory, true);
  EXPECT_EQ(config.dds.node, "/front/trestle");
  EXPECT_EQ(config.dds.ros_distro, "humble");
  EXPECT_THAT(config.types.folders, ElementsAre("/usr", "."));

  ASSERT_EQ(config.routes.size(), 2U);
  const Route& points = config.routes[0];
  EXPECT_EQ(points.topic, "/points");
  EXPECT_EQ(points.type, "sensor_msgs/msg/PointCloud2");
  EXPECT_EQ(points.direction, Direction::dds_to_someip);
  EXPECT_EQ(points.service, ServiceId{0x1111});
  EXPECT_EQ(points.instance, InstanceId{0x0022});
  EXPECT_EQ(points.eventgroup, EventgroupId{0x0033});
  EXPECT_EQ(points.event, MethodId{0x8044});
  EXPECT_EQ(points.major, 5);
  EXPECT_EQ(points.minor, 6U);
  EXPECT_EQ(points.transport, Transport::udp);
  EXPECT_EQ(points.port, 40001);
  EXPECT_EQ(points.tp,
            (TpSettings{{.segment_bytes = 1024, .burst = 16, .separation = 250us}, std::size_t{8} << 20U}));
  EXPECT_EQ(points.rules.payload, (PayloadRules{.byte_order = std::endian::little,
                                                .length_fields_always_big = true,
                                                .array_length = FieldWidth::bits16,
                                                .fixed_array_length = FieldWidth::bits8,
                                                .string_length = FieldWidth::bits8,
                                                .struct_length = FieldWidth::bits32,
                                                .union_length = FieldWidth::bits16,
                                                .union_type = FieldWidth::bits8,
                                                .union_length_first = false,
                                                .union_null = true,
                                                .tagged_length = FieldWidth::bits16,
                                                .smallest_tagged_length = true,
                                                .cut_longer_arrays = false,
                                                .string_encoding = someip::StringEncoding::utf16be,
                                                .string_bom = false,
                                                .string_terminator = false,
                                                .alignment = 8}));
  EXPECT_TRUE(points.rules.default_missing);
  ASSERT_EQ(points.rules.types.size(), 2U);
  const messages::TypeRules& field = points.rules.types.at("sensor_msgs/msg/PointField");
  EXPECT_EQ(field,
            (messages::TypeRules{
                .tags = {{"name", someip::DataId{0}}, {"offset", someip::DataId{0xfff}}},
                .fixed_strings = {{"name", 32}},
                .byte_orders = {{"offset", std::endian::big}},
                .fields = {{"name",
                            {.string_length = FieldWidth::bits8,
                             .encoding = someip::StringEncoding::utf16le,
                             .bom = true,
                             .terminator = false}},
                           {"count", {.bits = 3}},
                           {"offset",
                            {.array_length = FieldWidth::none, .variant = "builtin_interfaces/msg/Time#2"}}},
                .itself = {.struct_length = FieldWidth::bits32,
                           .union_length = FieldWidth::bits8,
                           .union_type = FieldWidth::bits16,
                           .union_length_first = false,
                           .union_bytes = 9,
                           .selectors = {3, 5}}}));
  EXPECT_EQ(points.rules.types.at("std_msgs/msg/Header"),
            (messages::TypeRules{.form = messages::TypeRules::Form::choice}));
  EXPECT_EQ(points.qos, (QosSettings{{.reliable = true,
                                      .transient_local = true,
                                      .depth = 3,
                                      .keep_all = true,
                                      .deadline = 250ms,
                                      .lifespan = 2s,
                                      .manual_liveliness = true,
                                      .liveliness_lease = 500ms}}));
  EXPECT_EQ(points.multicast,
            (MulticastSettings{.group = {IpAddress::v4(239, 1, 2, 4), 40100}, .threshold = 3}));
  EXPECT_EQ(points.mark, (documents::Mark{24, 5}));
  // Ids may be decimal.
  EXPECT_EQ(config.routes[1].service, ServiceId{0x2222});
  EXPECT_EQ(config.routes[1].event, MethodId{0x8001});
  EXPECT_EQ(config.routes[1].mark, (documents::Mark{76, 5}));
}

TEST(LoadConfig, LeavesDefaultsWhereNothingIsSaid) {
  const BridgeConfig config = load_good(smallest);
  EXPECT_EQ(config.someip.timing, sd::Timing{});
  EXPECT_EQ(config.someip.multicast, IpAddress::v4(224, 244, 224, 245));
  EXPECT_EQ(config.someip.port, 30490);
  EXPECT_EQ(config.someip.multicast_interface, "");
  EXPECT_FALSE(config.dds.has_domain);
  EXPECT_EQ(config.dds.domain, 0U);
  EXPECT_THAT(config.dds.interfaces, IsEmpty());
  EXPECT_EQ(config.dds.shared_memory, std::nullopt);
  EXPECT_THAT(config.types.folders, IsEmpty());
  ASSERT_EQ(config.routes.size(), 1U);
  EXPECT_EQ(config.routes[0].rules, messages::MessageRules{});
  EXPECT_EQ(config.routes[0].tp, TpSettings{});
  EXPECT_EQ(config.routes[0].qos, QosSettings{});
  EXPECT_EQ(config.routes[0].major, 1);
  EXPECT_EQ(config.routes[0].minor, 0xffff'ffffU);  // a client takes any, a server has 0
  EXPECT_EQ(config.routes[0].port, 0);
}

TEST(LoadConfig, OffersMinorVersionZeroUnlessTold) {
  const BridgeConfig config = load_good(
      replaced(replaced(smallest, "someip_to_dds", "dds_to_someip"), "instance", "port: 40000, instance"));
  EXPECT_EQ(config.routes.at(0).minor, 0U);
}

TEST(LoadConfig, MergesAnchoredMappings) {
  const BridgeConfig config = load_good(R"(
someip: {address: 127.0.0.1}
routes:
  - &first
    topic: /a
    type: std_msgs/msg/String
    direction: dds_to_someip
    service: 1
    instance: 1
    eventgroup: 1
    event: 0x8001
    port: 40000
    wire: &wire {byte_order: little, array_length: 16}
    qos: &latched {durability: transient_local}
  - <<: *first
    topic: /b
    event: 0x8002
    wire:
      <<: [*wire, {array_length: 8, string_length: 8}]
      struct_length: 32
    qos: *latched
)");
  ASSERT_EQ(config.routes.size(), 2U);
  const Route& merged = config.routes[1];
  EXPECT_EQ(merged.topic, "/b");
  EXPECT_EQ(merged.event, MethodId{0x8002});
  EXPECT_EQ(merged.service, ServiceId{1});
  EXPECT_EQ(merged.port, 40000);
  EXPECT_TRUE(merged.qos.transient_local);
  // Own keys win over merged ones, earlier sources over later ones.
  EXPECT_EQ(merged.rules.payload, (PayloadRules{.byte_order = std::endian::little,
                                                .array_length = FieldWidth::bits16,
                                                .string_length = FieldWidth::bits8,
                                                .struct_length = FieldWidth::bits32}));
}

/// The rules of a route with these settings.
someip::PayloadRules rules_of(const std::string& wire) {
  return load_good(replaced(smallest, "instance", "wire: {" + wire + "}, instance"))
      .routes.at(0)
      .rules.payload;
}

TEST(LoadConfig, KeepsLengthFieldsBigUnlessTheyFollowThePayload) {
  covers({"feat_req_someip_675"});
  constexpr auto little = std::endian::little;
  EXPECT_EQ(rules_of("byte_order: little"),
            (PayloadRules{.byte_order = little, .length_fields_always_big = true}));
  EXPECT_EQ(rules_of("byte_order: little, length_order: as_payload"),
            (PayloadRules{.byte_order = little, .length_fields_always_big = false}));
  // CommonAPI's follow the payload, wherever the profile stands; but what is said counts more.
  EXPECT_EQ(rules_of("profile: commonapi"), (PayloadRules{.length_fields_always_big = false}));
  EXPECT_EQ(rules_of("byte_order: little, profile: commonapi"),
            (PayloadRules{.byte_order = little, .length_fields_always_big = false}));
  EXPECT_EQ(rules_of("length_order: big, byte_order: little, profile: commonapi"),
            (PayloadRules{.byte_order = little, .length_fields_always_big = true}));
}

TEST(LoadConfig, TakesIpv6WithAMulticastAddressOfItsOwn) {
  const BridgeConfig config =
      load_good(replaced(smallest, "127.0.0.1", "'fd00::1', sd: {multicast: 'ff14::4:c'}"));
  EXPECT_TRUE(config.someip.address.v6);
  EXPECT_EQ(config.someip.address.bytes[0], 0xfd);
  EXPECT_EQ(config.someip.address.bytes[15], 0x01);
  EXPECT_TRUE(config.someip.multicast.is_multicast());
}

TEST(LoadConfig, KeepsAnOfferUntilTheNextReboot) {
  const BridgeConfig config = load_good(replaced(good_config, "ttl: 10 s", "ttl: until_reboot"));
  EXPECT_EQ(config.someip.timing.ttl_s, 0xff'ffffU);
}

TEST(LoadConfig, LeavesBuffersToTheSizeOfMessagesUnlessTold) {
  const BridgeConfig by_size = load_good(good_config);
  EXPECT_EQ(by_size.someip.receive_buffer, std::nullopt);
  EXPECT_EQ(by_size.someip.send_buffer, std::nullopt);
  EXPECT_EQ(by_size.someip.busy_poll, Duration{0});
  EXPECT_EQ(by_size.someip.tcp_idle_timeout, std::chrono::minutes{5});
  const BridgeConfig told = load_good(replaced(smallest, "127.0.0.1",
                                               "127.0.0.1, receive_buffer: 1 MiB, send_buffer: 64 KiB, "
                                               "busy_poll: 50 us, tcp_idle_timeout: 60 s"));
  EXPECT_EQ(told.someip.receive_buffer, std::size_t{1} << 20U);
  EXPECT_EQ(told.someip.send_buffer, std::size_t{64} << 10U);
  EXPECT_EQ(told.someip.busy_poll, std::chrono::microseconds{50});
  EXPECT_EQ(told.someip.tcp_idle_timeout, std::chrono::minutes{1});
}

TEST(LoadConfig, LetsReliabilityChooseTheTransport) {
  const auto transport = [](const std::string& lines) {
    return load_good(replaced(smallest, "direction", lines + "direction")).routes[0].transport;
  };
  const std::string best_effort = "qos: {reliability: best_effort}, ";
  EXPECT_EQ(transport(""), Transport::udp);
  EXPECT_EQ(transport("transport: by_reliability, "), Transport::tcp);
  EXPECT_EQ(transport("transport: by_reliability, " + best_effort), Transport::udp);
  EXPECT_EQ(transport("transport: tcp, " + best_effort), Transport::tcp);
}

TEST(LoadConfig, TurnsTheCheckOfTheSubnetOff) {
  covers({"feat_req_someipsd_1149"});
  EXPECT_TRUE(load_good(good_config).someip.check_subnet);
  const BridgeConfig config =
      load_good(replaced(good_config, "ttl: 10 s", "ttl: 10 s\n    check_subnet: false"));
  EXPECT_FALSE(config.someip.check_subnet);
}

TEST(Load, ReadsWhoMayNameEndpointsOfOthers) {
  EXPECT_TRUE(load_good(good_config).someip.discovery.own_endpoints_only);
  const BridgeConfig config = load_good(
      replaced(good_config, "ttl: 10 s",
               "ttl: 10 s\n    own_endpoints_only: false\n    foreign_endpoints: [10.0.0.1 -> 10.0.0.7]"));
  EXPECT_FALSE(config.someip.discovery.own_endpoints_only);
  ASSERT_EQ(config.someip.foreign_endpoints.size(), 1U);
  EXPECT_EQ(config.someip.foreign_endpoints[0].peer, IpAddress::v4(10, 0, 0, 1));
  EXPECT_EQ(config.someip.foreign_endpoints[0].named, IpAddress::v4(10, 0, 0, 7));
  EXPECT_THAT(problems_of(replaced(good_config, "ttl: 10 s",
                                   "ttl: 10 s\n    foreign_endpoints: [10.0.0.1 10.0.0.7]")),
              testing::Contains(testing::HasSubstr("192.168.1.2 -> 10.0.0.2")));
}

TEST(Load, ReadsWhetherOffersTellTheDomain) {
  EXPECT_TRUE(load_good(good_config).someip.tell_dds_domain);
  EXPECT_FALSE(load_good(replaced(good_config, "ttl: 10 s", "ttl: 10 s\n    tell_dds_domain: false"))
                   .someip.tell_dds_domain);
}

TEST(LoadConfig, LetsServicesShareAPort) {
  covers({"feat_req_someip_445"});
  const BridgeConfig config = load_good(R"(
someip: {address: 127.0.0.1}
routes:
  - {topic: /a, type: std_msgs/msg/String, direction: dds_to_someip, service: 1, instance: 1, eventgroup: 1, event: 0x8001, port: 40000}
  - {topic: /b, type: std_msgs/msg/String, direction: dds_to_someip, service: 1, instance: 1, eventgroup: 1, event: 0x8002, port: 40000}
  - {topic: /c, type: std_msgs/msg/String, direction: dds_to_someip, service: 2, instance: 9, eventgroup: 1, event: 0x8001, port: 40000}
)");
  EXPECT_EQ(config.routes.size(), 3U);
}

TEST(LoadConfig, LetsATopicGoBothWaysByTwoServices) {
  const BridgeConfig config = load_good(R"(
someip: {address: 127.0.0.1}
routes:
  - {topic: /a, type: std_msgs/msg/String, direction: dds_to_someip, service: 1, instance: 1, eventgroup: 1, event: 0x8001, port: 40000}
  - {topic: /a, type: std_msgs/msg/String, direction: someip_to_dds, service: 2, instance: 1, eventgroup: 1, event: 0x8001}
)");
  EXPECT_EQ(config.routes.size(), 2U);
}

TEST(LoadConfig, WarnsOfWhatTheTypeCheckWarnsOf) {
  const auto loaded =
      parse_config(good_config, "/etc/bridge.yaml",
                   [](const TypeUse& use, const messages::MessageRules&, const messages::TypePlaces&) {
                     return TypeVerdict{.fault = "", .warning = use.type + " is odd"};
                   });
  ASSERT_TRUE(loaded);
  ASSERT_FALSE(loaded->warnings.empty());
  EXPECT_EQ(to_string(loaded->warnings.front()),
            "/etc/bridge.yaml:25:11: warning: type: sensor_msgs/msg/PointCloud2 is odd");
}

TEST(LoadConfig, AsksTheTypeCheckWithRulesAndPaths) {
  std::vector<std::string> asked;
  load_good(good_config, [&](const TypeUse& use, const messages::MessageRules& rules,
                             const messages::TypePlaces& places) {
    asked.push_back(use.type + (rules.payload.byte_order == std::endian::little ? " little " : " big ") +
                    places.folders.at(0));
    return TypeVerdict{};
  });
  EXPECT_THAT(asked,
              ElementsAre("sensor_msgs/msg/PointCloud2 little /usr", "geometry_msgs/msg/Point big /usr"));
}

TEST(LoadConfig, FindsTypeFoldersBesideTheFile) {
  const std::filesystem::path folder = testing::TempDir() + "load_config_test_" + std::to_string(getpid());
  std::filesystem::create_directories(folder / "messages");
  const std::string file = folder / "bridge.yaml";
  std::ofstream{file} << smallest << "types: {paths: [messages]}\n";
  const auto loaded = load_config(file);
  ASSERT_TRUE(loaded.has_value()) << to_string(loaded.error().front());
  EXPECT_THAT(loaded->config.types.folders, ElementsAre((folder / "messages").lexically_normal().string()));
}

/// As for other files that are not UTF-8: that of the configuration itself, and descriptions.
TEST(LoadConfig, WarnsOfTypesInFoldersThatAreNotUtf8) {
  const std::filesystem::path folder =
      testing::TempDir() + "load_config_latin1_test_" + std::to_string(getpid());
  std::filesystem::create_directories(folder / "std_msgs" / "msg");
  const std::string type = folder / "std_msgs" / "msg" / "String.msg";
  std::ofstream{type} << "# Text.\nstring data  # gr\xfcn\n";
  const std::string file = folder / "bridge.yaml";
  std::ofstream{file} << smallest << "types: {paths: ['.']}\n";
  const auto loaded = load_config(file, [](const auto&...) { return TypeVerdict{}; });
  ASSERT_TRUE(loaded.has_value()) << to_string(loaded.error().front());
  ASSERT_EQ(loaded->warnings.size(), 1U);
  EXPECT_EQ(to_string(loaded->warnings.front()),
            type +
                ":2:18: warning: here the file is not UTF-8: such bytes are taken as Windows-1252 (ISO "
                "8859-1)");
  EXPECT_TRUE(load_config(file)->warnings.empty()) << "types are not looked at";
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace trestle::test::load_test
