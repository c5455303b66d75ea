// What is said about each single mistake in a configuration.
#include <gmock/gmock.h>

#include "test/bridge/carry/config/problems_of.hpp"

namespace trestle::test::mistakes_test {
namespace {

using namespace carry;
using testing::ElementsAre;
using testing::ElementsAreArray;
using testing::StartsWith;

/// One mistake in the good configuration, and all that is then said.
struct Mistake {
  const char* name;
  const char* from;
  const char* to;
  std::vector<const char*> problems;
};

void PrintTo(const Mistake& mistake, std::ostream* out) {
  *out << mistake.name;
}

class ConfigMistake : public testing::TestWithParam<Mistake> {};

TEST_P(ConfigMistake, IsNamedWithItsPlace) {
  EXPECT_THAT(problems_of(replaced(good_config, GetParam().from, GetParam().to)),
              ElementsAreArray(GetParam().problems));
}

TEST(ConfigMistakes, UnknownAnchor) {
  // yaml-cpp names the anchor from 0.8 on.
  EXPECT_THAT(
      problems_of(replaced(good_config, "domain: 7", "domain: *seven")),
      ElementsAre(StartsWith("b.yaml:16:11: error: not valid YAML: the referenced anchor is not defined")));
}

std::string name_of(const testing::TestParamInfo<Mistake>& info) {
  return info.param.name;
}

INSTANTIATE_TEST_SUITE_P(
    Someip, ConfigMistake,
    testing::Values(
        Mistake{
            "Address",
            "192.0.2.1",
            "192.0.2.256",
            {"b.yaml:2:12: error: address: expected this host's own IPv4 or IPv6 address, at which services "
             "are offered, found '192.0.2.256'"}},
        Mistake{"LimitIsUnknown",
                "  address: 192.0.2.1\n",
                "  address: 192.0.2.1\n  limits: {max_peer: 5}\n",
                {"b.yaml:3:12: error: unknown key 'max_peer' in limits; did you mean 'max_peers'?"}},
        Mistake{"LimitIsNone",
                "  address: 192.0.2.1\n",
                "  address: 192.0.2.1\n  limits: {max_peers: 0}\n",
                {"b.yaml:3:23: error: max_peers: expected a whole number from 1 to 60000, found '0'"}},
        Mistake{
            "AddressIsMulticast",
            "192.0.2.1",
            "224.0.0.1",
            {"b.yaml:2:12: error: address: expected this host's own IPv4 or IPv6 address, at which services "
             "are offered, found '224.0.0.1'"}},
        Mistake{"AddressIsMissing",
                "  address: 192.0.2.1\n",
                "",
                {"b.yaml:2:3: error: someip: 'address' is missing: expected this host's own IPv4 or IPv6 "
                 "address, "
                 "at which services are offered"}},
        Mistake{
            "AddressOfAnotherIpVersion",
            "192.0.2.1",
            "fd00::1",
            {"b.yaml:2:12: error: address: fd00::1 and the multicast address of sd, 239.1.2.3, are of "
             "different "
             "IP versions",
             "b.yaml:73:7: error: multicast: its address and that of someip are of different IP versions"}},
        Mistake{"Interface",
                "eth0",
                "a-name-that-is-too-long",
                {"b.yaml:3:14: error: interface: expected the name of a network interface (1 to 15 "
                 "characters), found "
                 "'a-name-that-is-too-long'"}},
        Mistake{"Multicast",
                "239.1.2.3",
                "192.0.2.3",
                {"b.yaml:5:16: error: multicast: expected a multicast address, found '192.0.2.3'"}},
        Mistake{"SdPort",
                "30491",
                "65536",
                {"b.yaml:6:11: error: port: expected a whole number from 1 to 65535, found '65536'"}},
        Mistake{"TimeWithoutUnit",
                "20 ms",
                "20",
                {"b.yaml:7:24: error: initial_delay_min: expected a time from 0 ns to 60 s, with its unit "
                 "(ns, us, "
                 "ms, s), found '20'"}},
        Mistake{"DelaysTheWrongWayRound",
                "20 ms",
                "300 ms",
                {"b.yaml:7:24: error: initial_delay_min: 300 ms is above initial_delay_max, 200 ms"}},
        Mistake{"ResponseDelaysTheWrongWayRound",
                "5 ms",
                "16 ms",
                {"b.yaml:12:33: error: request_response_delay_min: 16 ms is above "
                 "request_response_delay_max, 15 ms"}},
        Mistake{"Repetitions",
                "repetitions_max: 4",
                "repetitions_max: 11",
                {"b.yaml:10:22: error: repetitions_max: expected a whole number from 0 to 10, found '11'"}},
        Mistake{"CyclicOfferDelay",
                "cyclic_offer_delay: 2 s",
                "cyclic_offer_delay: 1 ms",
                {"b.yaml:11:25: error: cyclic_offer_delay: expected a time from 10 ms to 3600 s, with its "
                 "unit (ns, "
                 "us, ms, s), found '1 ms'"}},
        Mistake{"TtlZero",
                "10 s",
                "0 s",
                {"b.yaml:14:10: error: ttl: expected a whole number of seconds from 1 s to 16777214 s, or "
                 "until_reboot, found '0 s'"}},
        Mistake{"TtlBeyondItsField",
                "10 s",
                "16777215 s",
                {"b.yaml:14:10: error: ttl: expected a whole number of seconds from 1 s to 16777214 s, or "
                 "until_reboot, found '16777215 s'"}},
        Mistake{"TtlInParts",
                "10 s",
                "1.5 s",
                {"b.yaml:14:10: error: ttl: expected a whole number of seconds from 1 s to 16777214 s, or "
                 "until_reboot, found '1.5 s'"}}),
    name_of);

INSTANTIATE_TEST_SUITE_P(
    DdsAndTypes, ConfigMistake,
    testing::Values(
        Mistake{"Domain",
                "domain: 7",
                "domain: 233",
                {"b.yaml:16:11: error: domain: expected a whole number from 0 to 232, found '233'"}},
        Mistake{"Interfaces",
                "[127.0.0.1, 192.0.2.7]",
                "127.0.0.1",
                {"b.yaml:17:15: error: interfaces: expected a list, found '127.0.0.1'"}},
        Mistake{"OneOfTheInterfaces",
                "192.0.2.7",
                "lo",
                {"b.yaml:17:27: error: interfaces: expected an IPv4 address of this host, found 'lo'"}},
        Mistake{"Truth",
                "shared_memory: true",
                "shared_memory: yes",
                {"b.yaml:18:18: error: shared_memory: expected true or false, found 'yes'"}},
        Mistake{"Node",
                "node: /front/trestle",
                "node: trestle",
                {"b.yaml:19:9: error: node: expected the absolute name of a ROS 2 node such as /trestle "
                 "(letters, "
                 "digits, '_'), found 'trestle'"}},
        Mistake{"RosDistro",
                "ros_distro: humble",
                "ros_distro: Humble",
                {"b.yaml:20:15: error: ros_distro: expected the name of a ROS 2 distribution such as jazzy, "
                 "found "
                 "'Humble'"}},
        Mistake{"Folder",
                "/usr",
                "/no/such/folder",
                {"b.yaml:22:11: error: paths: there is no folder '/no/such/folder'"}}),
    name_of);

INSTANTIATE_TEST_SUITE_P(
    Routes, ConfigMistake,
    testing::Values(
        Mistake{"Topic",
                "/points",
                "points",
                {"b.yaml:24:12: error: topic: expected a topic such as /sensing/points (absolute; letters, "
                 "digits, "
                 "'_'), found 'points'"}},
        Mistake{
            "TypeName",
            "sensor_msgs/msg/PointCloud2",
            "sensor_msgs/PointCloud2",
            {"b.yaml:25:11: error: type: expected a message type such as sensor_msgs/msg/PointCloud2, found "
             "'sensor_msgs/PointCloud2'"}},
        Mistake{"Direction",
                "dds_to_someip",
                "someip_to_ddss",
                {"b.yaml:26:16: error: direction: expected one of dds_to_someip, someip_to_dds, found "
                 "'someip_to_ddss'"}},
        Mistake{"ServiceTooWide",
                "0x1111",
                "0x10000",
                {"b.yaml:27:14: error: service: expected an id from 0x0001 to 0xfffd, found '0x10000'"}},
        Mistake{"ServiceZero",
                "0x1111",
                "0",
                {"b.yaml:27:14: error: service: expected an id from 0x0001 to 0xfffd, found '0'"}},
        Mistake{"ServiceOfSd",
                "0x1111",
                "0xffff",
                {"b.yaml:27:14: error: service: expected an id from 0x0001 to 0xfffd, found '0xffff'"}},
        Mistake{"EveryInstance",
                "0x0022",
                "0xffff",
                {"b.yaml:28:15: error: instance: expected an id from 0x0001 to 0xfffe, found '0xffff'"}},
        Mistake{"Eventgroup",
                "0x0033",
                "-1",
                {"b.yaml:29:17: error: eventgroup: expected an id from 0x0001 to 0xfffe, found '-1'"}},
        Mistake{"Event",
                "0x8044",
                "0xffff",
                {"b.yaml:30:12: error: event: expected an id from 0x0001 to 0xfffe, found '0xffff'"}},
        Mistake{"Major",
                "major: 5",
                "major: 255",
                {"b.yaml:31:12: error: major: expected a whole number from 0 to 254, found '255'"}},
        Mistake{"AnyMinorOfAServer",
                "minor: 6",
                "minor: any",
                {"b.yaml:32:12: error: minor: expected a whole number from 0 to 4294967294, found 'any'"}},
        Mistake{"PortOfATcpClient",
                "event: 32769",
                "event: 32769\n    transport: tcp\n    port: 40002",
                {"b.yaml:84:11: error: port: the system chooses our port of a TCP connection to a server"}},
        Mistake{"MulticastGroup",
                "239.1.2.4",
                "192.0.2.4",
                {"b.yaml:73:16: error: address: expected a multicast address, found '192.0.2.4'"}},
        Mistake{
            "MulticastOfAnotherVersion",
            "239.1.2.4",
            "ff02::17",
            {"b.yaml:73:7: error: multicast: its address and that of someip are of different IP versions"}},
        Mistake{"MulticastPort",
                "port: 40100",
                "port: 65536",
                {"b.yaml:74:13: error: port: expected a whole number from 1 to 65535, found '65536'"}},
        Mistake{"MulticastThreshold",
                "threshold: 3",
                "threshold: 0",
                {"b.yaml:75:18: error: threshold: expected a whole number from 1 to 65535, found '0'"}},
        Mistake{"MulticastOverTcp",
                "transport: udp",
                "transport: tcp",
                {"b.yaml:73:7: error: multicast: needs transport: udp"}},
        Mistake{"MulticastOfAClient",
                "event: 32769",
                "event: 32769\n    multicast: {address: 239.1.2.4, port: 5}",
                {"b.yaml:83:16: error: multicast: the server names the group; a route from SOME/IP cannot "
                 "set it"}},
        Mistake{"Transport",
                "transport: udp",
                "transport: can",
                {"b.yaml:33:16: error: transport: expected one of udp, tcp, by_reliability, found 'can'"}},
        Mistake{"PortZero",
                "port: 40001",
                "port: 0",
                {"b.yaml:34:11: error: port: expected a whole number from 1 to 65535, found '0'"}},
        Mistake{"PortIsMissing",
                "    port: 40001\n",
                "",
                {"b.yaml:24:5: error: route: 'port' is missing: expected a whole number from 1 to 65535"}},
        Mistake{"PortOfSd",
                "port: 40001",
                "port: 30491",
                {"b.yaml:34:11: error: port: 30491 is service discovery's own port"}},
        Mistake{
            "Segment",
            "segment_bytes: 1024",
            "segment_bytes: 1400",
            {"b.yaml:36:22: error: segment_bytes: expected a multiple of 16 from 16 to 1392 (bytes), found "
             "'1400'"}},
        Mistake{"Burst",
                "burst: 16",
                "burst: 0",
                {"b.yaml:37:14: error: burst: expected a whole number from 1 to 65535, found '0'"}},
        Mistake{"Separation",
                "250 us",
                "2 s",
                {"b.yaml:38:19: error: separation: expected a time from 0 ns to 1 s, with its unit (ns, us, "
                 "ms, s), "
                 "found '2 s'"}},
        Mistake{"MaxMessage",
                "8 MiB",
                "1 GiB",
                {"b.yaml:39:20: error: max_message: expected a size from 1 KiB to 256 MiB (in B, KiB or "
                 "MiB), found "
                 "'1 GiB'"}},
        Mistake{"Profile",
                "commonapi",
                "capi",
                {"b.yaml:41:16: error: profile: expected commonapi, found 'capi'"}},
        Mistake{"ByteOrder",
                "byte_order: little",
                "byte_order: middle",
                {"b.yaml:42:19: error: byte_order: expected one of big, little, found 'middle'"}},
        Mistake{"LengthOrder",
                "length_order: big",
                "length_order: little",
                {"b.yaml:43:21: error: length_order: expected one of big, as_payload, found 'little'"}},
        Mistake{"Width",
                "array_length: 16",
                "array_length: 24",
                {"b.yaml:44:21: error: array_length: expected a width in bits: 0 (no such field), 8, 16 or "
                 "32, found "
                 "'24'"}},
        Mistake{"UnionOrder",
                "type_first",
                "data_first",
                {"b.yaml:50:20: error: union_order: expected one of length_first, type_first, found "
                 "'data_first'"}},
        Mistake{
            "Encoding",
            "utf16be",
            "latin1",
            {"b.yaml:51:24: error: string_encoding: expected one of utf8, utf16le, utf16be, found 'latin1'"}},
        Mistake{"Alignment",
                "alignment: 64",
                "alignment: 4",
                {"b.yaml:54:18: error: alignment: expected an alignment in bits: 8 (none), 16, 32, 64, 128 "
                 "or 256, "
                 "found '4'"}},
        Mistake{"UnionNull",
                "union_null: true",
                "union_null: maybe",
                {"b.yaml:55:19: error: union_null: expected true or false, found 'maybe'"}},
        Mistake{
            "TaggedLength",
            "tagged_length: 16",
            "tagged_length: 24",
            {"b.yaml:56:22: error: tagged_length: expected a width in bits: 0 (no such field), 8, 16 or 32, "
             "found '24'"}},
        Mistake{"TaggedLengths",
                "smallest",
                "small",
                {"b.yaml:57:23: error: tagged_lengths: expected one of configured, smallest, found 'small'"}},
        Mistake{"LongerArrays",
                "longer_arrays: refuse",
                "longer_arrays: drop",
                {"b.yaml:58:22: error: longer_arrays: expected one of cut, refuse, found 'drop'"}},
        Mistake{"MissingFields",
                "missing_fields: default",
                "missing_fields: zero",
                {"b.yaml:59:23: error: missing_fields: expected one of refuse, default, found 'zero'"}},
        Mistake{
            "TypeOfRules",
            "std_msgs/msg/Header:",
            "Header:",
            {"b.yaml:62:17: error: types: expected a message type such as sensor_msgs/msg/PointCloud2, found "
             "'Header'"}},
        Mistake{"RulesOfType",
                "{form: union}",
                "union",
                {"b.yaml:62:30: error: std_msgs/msg/Header: expected a mapping (key: value), found 'union'"}},
        Mistake{
            "Form",
            "form: union",
            "form: variant",
            {"b.yaml:62:37: error: form: expected one of struct, union, bits8, bits16, bits32, empty, found "
             "'variant'"}},
        Mistake{"KeyOfType",
                "form: union",
                "frm: union",
                {"b.yaml:62:31: error: unknown key 'frm' in std_msgs/msg/Header; did you mean 'form'?"}},
        Mistake{"DataId",
                "offset: 0xfff",
                "offset: 0x1000",
                {"b.yaml:61:62: error: offset: expected an id from 0x0000 to 0x0fff, found '0x1000'"}},
        Mistake{"FixedString",
                "name: 32",
                "name: 0",
                {"b.yaml:61:92: error: name: expected a whole number from 1 to 65535, found '0'"}},
        Mistake{"ByteOrderOfField",
                "offset: big",
                "offset: middle",
                {"b.yaml:61:119: error: offset: expected one of big, little, found 'middle'"}},
        Mistake{"ByteOrdersOfType",
                "{offset: big}",
                "big",
                {"b.yaml:61:110: error: byte_orders: expected a mapping (key: value), found 'big'"}},
        Mistake{"Reliability",
                "reliability: reliable",
                "reliability: best",
                {"b.yaml:64:20: error: reliability: expected one of as_published, reliable, best_effort, "
                 "found 'best'"}},
        Mistake{"Durability",
                "transient_local",
                "persistent",
                {"b.yaml:65:19: error: durability: expected one of as_published, volatile, transient_local, "
                 "found "
                 "'persistent'"}},
        Mistake{"LatchedButNotReliable",
                "reliability: reliable",
                "reliability: best_effort",
                {"b.yaml:65:19: error: durability: transient_local needs reliability: reliable"}},
        Mistake{"Depth",
                "depth: 3",
                "depth: 10001",
                {"b.yaml:66:14: error: depth: expected a whole number from 1 to 10000, found '10001'"}},
        Mistake{"History",
                "history: keep_all",
                "history: all",
                {"b.yaml:67:16: error: history: expected one of keep_last, keep_all, found 'all'"}},
        Mistake{"Deadline",
                "deadline: 250 ms",
                "deadline: 250",
                {"b.yaml:68:17: error: deadline: expected a time from 1 ms to 86400 s, with its unit (ns, "
                 "us, ms, s), found '250'"}},
        Mistake{"Lifespan",
                "lifespan: 2 s",
                "lifespan: 25 h",
                {"b.yaml:69:17: error: lifespan: expected a time from 1 ms to 86400 s, with its unit (ns, "
                 "us, ms, s), found '25 h'"}},
        Mistake{
            "Liveliness",
            "manual_by_topic",
            "manual",
            {"b.yaml:70:19: error: liveliness: expected one of automatic, manual_by_topic, found 'manual'"}},
        Mistake{"LivelinessLease",
                "liveliness_lease: 0.5 s",
                "liveliness_lease: 0",
                {"b.yaml:71:25: error: liveliness_lease: expected a time from 1 ms to 86400 s, with its unit "
                 "(ns, us, ms, s), found '0'"}}),
    name_of);

INSTANTIATE_TEST_SUITE_P(
    Form, ConfigMistake,
    testing::Values(
        Mistake{"UnknownKeyLikeAKnownOne",
                "domain: 7",
                "domian: 7",
                {"b.yaml:16:3: error: unknown key 'domian' in dds; did you mean 'domain'?"}},
        Mistake{
            "UnknownKey",
            "domain: 7",
            "colour: 7",
            {"b.yaml:16:3: error: unknown key 'colour' in dds; known here: domain, interfaces, "
             "shared_memory, types, lease, node, ros_distro, profiles, profile, discovery_server, security"}},
        Mistake{"UnknownKeyOfTheFile",
                "types:",
                "type:",
                {"b.yaml:21:1: error: unknown key 'type'; did you mean 'types'?"}},
        Mistake{"UnknownKeyOfARoute",
                "event: 0x8044",
                "event: 0x8044\n    service_id: 1",
                {"b.yaml:31:5: error: unknown key 'service_id' in route; did you mean 'service'?"}},
        Mistake{"KeyTwice",
                "domain: 7",
                "domain: 7\n  domain: 8",
                {"b.yaml:17:3: error: 'domain' is given twice, first in line 16"}},
        Mistake{
            "ListForAKey", "domain: 7", "[1, 2]: 7", {"b.yaml:16:3: error: expected a key, found a list"}},
        Mistake{"NothingForAValue",
                "domain: 7",
                "domain:",
                {"b.yaml:16:3: error: domain: expected a whole number from 0 to 232, found nothing"}},
        Mistake{"ListForAValue",
                "domain: 7",
                "domain: [7]",
                {"b.yaml:16:11: error: domain: expected a whole number from 0 to 232, found a list"}},
        Mistake{"ValueForAMapping",
                "    tp:\n      segment_bytes: 1024\n      burst: 16\n      separation: 250 us\n"
                "      max_message: 8 MiB\n",
                "    tp: fast\n",
                {"b.yaml:35:9: error: tp: expected a mapping (key: value), found 'fast'"}},
        Mistake{
            "EmptyRoute", "routes:\n", "routes:\n  -\n", {"b.yaml:24:3: error: routes: element 1 is empty"}},
        Mistake{"TextForARoute",
                "routes:\n",
                "routes:\n  - all\n",
                {"b.yaml:24:5: error: route: expected a mapping (key: value), found 'all'"}},
        Mistake{
            "ControlCharacters",
            "domain: 7",
            "domain: \"\\x1b[31m\\0\"",
            {"b.yaml:16:11: error: domain: expected a whole number from 0 to 232, found '\\x1b[31m\\x00'"}},
        Mistake{"LongValue",
                "domain: 7",
                "domain: 1234567890123456789012345678901234567890123456789012345678901234567890",
                {"b.yaml:16:11: error: domain: expected a whole number from 0 to 232, found "
                 "'123456789012345678901234567890123456789012345678901234567890...'"}},
        Mistake{"BadYaml",
                "  domain: 7",
                "  domain: [7\n  interfaces: {",
                {"b.yaml:17:15: error: not valid YAML: this '{' is not closed; expected '}'"}},
        Mistake{
            "MergeOfAValue", "domain: 7", "<<: 7", {"b.yaml:16:3: error: '<<' merges mappings, found '7'"}},
        Mistake{"MergeOfItself",
                "  domain: 7",
                "  &dds\n  domain: 7\n  <<: *dds",
                {"b.yaml:18:3: error: too much is merged here: at most 64 mappings, 8 deep"}}),
    name_of);

}  // namespace
}  // namespace trestle::test::mistakes_test
