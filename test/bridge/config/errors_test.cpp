#include <gmock/gmock.h>

#include <algorithm>

#include "bridge/check/explain.hpp"
#include "bridge/config/load.hpp"
#include "test/bridge/config/good_config.hpp"
#include "test/covers.hpp"

namespace trestle::test {
namespace {

using namespace bridge;
using testing::ElementsAre;
using testing::ElementsAreArray;

std::vector<std::string> lines(const std::vector<Problem>& problems) {
  std::vector<std::string> result(problems.size());
  std::ranges::transform(problems, result.begin(), [](const Problem& problem) { return to_string(problem); });
  return result;
}

/// What is said about a text that is not a good configuration.
std::vector<std::string> problems_of(const std::string& text, const TypeCheck& check = {}) {
  const auto loaded = parse_config(text, "b.yaml", check);
  return loaded ? std::vector<std::string>{"no errors"} : lines(loaded.error());
}

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
            {"b.yaml:2:12: error: address: expected this host's own IPv4 or IPv6 address, which services are "
             "offered at, found '192.0.2.256'"}},
        Mistake{
            "AddressIsMulticast",
            "192.0.2.1",
            "224.0.0.1",
            {"b.yaml:2:12: error: address: expected this host's own IPv4 or IPv6 address, which services are "
             "offered at, found '224.0.0.1'"}},
        Mistake{"AddressIsMissing",
                "  address: 192.0.2.1\n",
                "",
                {"b.yaml:2:3: error: someip: 'address' is missing: expected this host's own IPv4 or IPv6 "
                 "address, "
                 "which services are offered at"}},
        Mistake{
            "AddressOfAnotherIpVersion",
            "192.0.2.1",
            "fd00::1",
            {"b.yaml:2:12: error: address: fd00::1 and the multicast address of sd, 239.1.2.3, are of "
             "different "
             "IP versions",
             "b.yaml:66:7: error: multicast: its address and that of someip are of different IP versions"}},
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
        Mistake{"Folder",
                "/usr",
                "/no/such/folder",
                {"b.yaml:20:11: error: paths: there is no folder '/no/such/folder'"}}),
    name_of);

INSTANTIATE_TEST_SUITE_P(
    Routes, ConfigMistake,
    testing::Values(
        Mistake{"Topic",
                "/points",
                "points",
                {"b.yaml:22:12: error: topic: expected a topic such as /sensing/points (absolute; letters, "
                 "digits, "
                 "'_'), found 'points'"}},
        Mistake{
            "TypeName",
            "sensor_msgs/msg/PointCloud2",
            "sensor_msgs/PointCloud2",
            {"b.yaml:23:11: error: type: expected a message type such as sensor_msgs/msg/PointCloud2, found "
             "'sensor_msgs/PointCloud2'"}},
        Mistake{"Direction",
                "dds_to_someip",
                "someip_to_ddss",
                {"b.yaml:24:16: error: direction: expected one of dds_to_someip, someip_to_dds, found "
                 "'someip_to_ddss'"}},
        Mistake{"ServiceTooWide",
                "0x1111",
                "0x10000",
                {"b.yaml:25:14: error: service: expected an id from 0x0001 to 0xfffd, found '0x10000'"}},
        Mistake{"ServiceZero",
                "0x1111",
                "0",
                {"b.yaml:25:14: error: service: expected an id from 0x0001 to 0xfffd, found '0'"}},
        Mistake{"ServiceOfSd",
                "0x1111",
                "0xffff",
                {"b.yaml:25:14: error: service: expected an id from 0x0001 to 0xfffd, found '0xffff'"}},
        Mistake{"EveryInstance",
                "0x0022",
                "0xffff",
                {"b.yaml:26:15: error: instance: expected an id from 0x0001 to 0xfffe, found '0xffff'"}},
        Mistake{"Eventgroup",
                "0x0033",
                "-1",
                {"b.yaml:27:17: error: eventgroup: expected an id from 0x0001 to 0xfffe, found '-1'"}},
        Mistake{"Event",
                "0x8044",
                "0xffff",
                {"b.yaml:28:12: error: event: expected an id from 0x0001 to 0xfffe, found '0xffff'"}},
        Mistake{"Major",
                "major: 5",
                "major: 255",
                {"b.yaml:29:12: error: major: expected a whole number from 0 to 254, found '255'"}},
        Mistake{"AnyMinorOfAServer",
                "minor: 6",
                "minor: any",
                {"b.yaml:30:12: error: minor: expected a whole number from 0 to 4294967294, found 'any'"}},
        Mistake{"PortOfATcpClient",
                "event: 32769",
                "event: 32769\n    transport: tcp\n    port: 40002",
                {"b.yaml:77:11: error: port: of a TCP connection to a server, the system chooses ours"}},
        Mistake{"MulticastGroup",
                "239.1.2.4",
                "192.0.2.4",
                {"b.yaml:66:16: error: address: expected a multicast address, found '192.0.2.4'"}},
        Mistake{
            "MulticastOfAnotherVersion",
            "239.1.2.4",
            "ff02::17",
            {"b.yaml:66:7: error: multicast: its address and that of someip are of different IP versions"}},
        Mistake{"MulticastPort",
                "port: 40100",
                "port: 65536",
                {"b.yaml:67:13: error: port: expected a whole number from 1 to 65535, found '65536'"}},
        Mistake{"MulticastThreshold",
                "threshold: 3",
                "threshold: 0",
                {"b.yaml:68:18: error: threshold: expected a whole number from 1 to 65535, found '0'"}},
        Mistake{"MulticastOverTcp",
                "transport: udp",
                "transport: tcp",
                {"b.yaml:66:7: error: multicast: needs transport: udp"}},
        Mistake{"MulticastOfAClient",
                "event: 32769",
                "event: 32769\n    multicast: {address: 239.1.2.4, port: 5}",
                {"b.yaml:76:16: error: multicast: the server names the group; of a route from SOME/IP it "
                 "cannot be set"}},
        Mistake{"Transport",
                "transport: udp",
                "transport: can",
                {"b.yaml:31:16: error: transport: expected one of udp, tcp, found 'can'"}},
        Mistake{"PortZero",
                "port: 40001",
                "port: 0",
                {"b.yaml:32:11: error: port: expected a whole number from 1 to 65535, found '0'"}},
        Mistake{"PortIsMissing",
                "    port: 40001\n",
                "",
                {"b.yaml:22:5: error: route: 'port' is missing: expected a whole number from 1 to 65535"}},
        Mistake{"PortOfSd",
                "port: 40001",
                "port: 30491",
                {"b.yaml:32:11: error: port: 30491 is service discovery's own port"}},
        Mistake{
            "Segment",
            "segment_bytes: 1024",
            "segment_bytes: 1400",
            {"b.yaml:34:22: error: segment_bytes: expected a multiple of 16 from 16 to 65472 (bytes), found "
             "'1400'"}},
        Mistake{"Burst",
                "burst: 16",
                "burst: 0",
                {"b.yaml:35:14: error: burst: expected a whole number from 1 to 65535, found '0'"}},
        Mistake{"Separation",
                "250 us",
                "2 s",
                {"b.yaml:36:19: error: separation: expected a time from 0 ns to 1 s, with its unit (ns, us, "
                 "ms, s), "
                 "found '2 s'"}},
        Mistake{"MaxMessage",
                "8 MiB",
                "1 GiB",
                {"b.yaml:37:20: error: max_message: expected a size from 1 KiB to 256 MiB (in B, KiB or "
                 "MiB), found "
                 "'1 GiB'"}},
        Mistake{"Profile",
                "commonapi",
                "capi",
                {"b.yaml:39:16: error: profile: expected commonapi, found 'capi'"}},
        Mistake{"ByteOrder",
                "byte_order: little",
                "byte_order: middle",
                {"b.yaml:40:19: error: byte_order: expected one of big, little, found 'middle'"}},
        Mistake{"LengthOrder",
                "length_order: big",
                "length_order: little",
                {"b.yaml:41:21: error: length_order: expected one of big, as_payload, found 'little'"}},
        Mistake{"Width",
                "array_length: 16",
                "array_length: 24",
                {"b.yaml:42:21: error: array_length: expected a width in bits: 0 (no such field), 8, 16 or "
                 "32, found "
                 "'24'"}},
        Mistake{"UnionOrder",
                "type_first",
                "data_first",
                {"b.yaml:48:20: error: union_order: expected one of length_first, type_first, found "
                 "'data_first'"}},
        Mistake{
            "Encoding",
            "utf16be",
            "latin1",
            {"b.yaml:49:24: error: string_encoding: expected one of utf8, utf16le, utf16be, found 'latin1'"}},
        Mistake{"Alignment",
                "alignment: 64",
                "alignment: 4",
                {"b.yaml:52:18: error: alignment: expected an alignment in bits: 8 (none), 16, 32, 64, 128 "
                 "or 256, "
                 "found '4'"}},
        Mistake{"UnionNull",
                "union_null: true",
                "union_null: maybe",
                {"b.yaml:53:19: error: union_null: expected true or false, found 'maybe'"}},
        Mistake{
            "TaggedLength",
            "tagged_length: 16",
            "tagged_length: 24",
            {"b.yaml:54:22: error: tagged_length: expected a width in bits: 0 (no such field), 8, 16 or 32, "
             "found '24'"}},
        Mistake{"TaggedLengths",
                "smallest",
                "small",
                {"b.yaml:55:23: error: tagged_lengths: expected one of configured, smallest, found 'small'"}},
        Mistake{"LongerArrays",
                "longer_arrays: refuse",
                "longer_arrays: drop",
                {"b.yaml:56:22: error: longer_arrays: expected one of cut, refuse, found 'drop'"}},
        Mistake{"MissingFields",
                "missing_fields: default",
                "missing_fields: zero",
                {"b.yaml:57:23: error: missing_fields: expected one of refuse, default, found 'zero'"}},
        Mistake{
            "TypeOfRules",
            "std_msgs/msg/Header:",
            "Header:",
            {"b.yaml:60:17: error: types: expected a message type such as sensor_msgs/msg/PointCloud2, found "
             "'Header'"}},
        Mistake{"RulesOfType",
                "{form: union}",
                "union",
                {"b.yaml:60:30: error: std_msgs/msg/Header: expected a mapping (key: value), found 'union'"}},
        Mistake{"Form",
                "form: union",
                "form: variant",
                {"b.yaml:60:37: error: form: expected one of struct, union, bits8, bits16, bits32, found "
                 "'variant'"}},
        Mistake{"KeyOfType",
                "form: union",
                "frm: union",
                {"b.yaml:60:31: error: unknown key 'frm' in std_msgs/msg/Header; did you mean 'form'?"}},
        Mistake{"DataId",
                "offset: 0xfff",
                "offset: 0x1000",
                {"b.yaml:59:62: error: offset: expected an id from 0x0000 to 0x0fff, found '0x1000'"}},
        Mistake{"FixedString",
                "name: 32",
                "name: 0",
                {"b.yaml:59:92: error: name: expected a whole number from 1 to 65535, found '0'"}},
        Mistake{"Reliability",
                "reliability: reliable",
                "reliability: best",
                {"b.yaml:62:20: error: reliability: expected one of reliable, best_effort, found 'best'"}},
        Mistake{"Durability",
                "transient_local",
                "persistent",
                {"b.yaml:63:19: error: durability: expected one of volatile, transient_local, found "
                 "'persistent'"}},
        Mistake{"LatchedButNotReliable",
                "reliability: reliable",
                "reliability: best_effort",
                {"b.yaml:63:19: error: durability: transient_local needs reliability: reliable"}},
        Mistake{"Depth",
                "depth: 3",
                "depth: 10001",
                {"b.yaml:64:14: error: depth: expected a whole number from 1 to 10000, found '10001'"}}),
    name_of);

INSTANTIATE_TEST_SUITE_P(
    Form, ConfigMistake,
    testing::Values(
        Mistake{"UnknownKeyLikeAKnownOne",
                "domain: 7",
                "domian: 7",
                {"b.yaml:16:3: error: unknown key 'domian' in dds; did you mean 'domain'?"}},
        Mistake{"UnknownKey",
                "domain: 7",
                "colour: 7",
                {"b.yaml:16:3: error: unknown key 'colour' in dds; known here: domain, interfaces, "
                 "shared_memory"}},
        Mistake{"UnknownKeyOfTheFile",
                "types:",
                "type:",
                {"b.yaml:19:1: error: unknown key 'type'; did you mean 'types'?"}},
        Mistake{"UnknownKeyOfARoute",
                "event: 0x8044",
                "event: 0x8044\n    service_id: 1",
                {"b.yaml:29:5: error: unknown key 'service_id' in route; did you mean 'service'?"}},
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
                {"b.yaml:33:9: error: tp: expected a mapping (key: value), found 'fast'"}},
        Mistake{
            "EmptyRoute", "routes:\n", "routes:\n  -\n", {"b.yaml:22:3: error: routes: element 1 is empty"}},
        Mistake{"TextForARoute",
                "routes:\n",
                "routes:\n  - all\n",
                {"b.yaml:22:5: error: route: expected a mapping (key: value), found 'all'"}},
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
                {"b.yaml:17:13: error: not valid YAML: end of sequence flow not found"}},
        Mistake{"UnknownAnchor",
                "domain: 7",
                "domain: *seven",
                {"b.yaml:16:11: error: not valid YAML: the referenced anchor is not defined"}},
        Mistake{
            "MergeOfAValue", "domain: 7", "<<: 7", {"b.yaml:16:3: error: '<<' merges mappings, found '7'"}},
        Mistake{"MergeOfItself",
                "  domain: 7",
                "  &dds\n  domain: 7\n  <<: *dds",
                {"b.yaml:18:3: error: too much is merged here: at most 64 mappings, 8 deep"}}),
    name_of);

TEST(ConfigErrors, ComeAllAtOnceAndInOrder) {
  const std::string text = R"(rutes: []
dds: {domain: -1}
someip: {adress: 127.0.0.1}
)";
  EXPECT_THAT(
      problems_of(text),
      ElementsAre(
          "b.yaml:1:1: error: 'routes' is missing: expected a list of routes",
          "b.yaml:1:1: error: unknown key 'rutes'; did you mean 'routes'?",
          "b.yaml:2:15: error: domain: expected a whole number from 0 to 232, found '-1'",
          "b.yaml:3:9: error: someip: 'address' is missing: expected this host's own IPv4 or IPv6 address, "
          "which services are offered at",
          "b.yaml:3:10: error: unknown key 'adress' in someip; did you mean 'address'?"));
}

TEST(ConfigErrors, NameEveryMissingKeyOfARoute) {
  EXPECT_THAT(
      problems_of("someip: {address: 127.0.0.1}\nroutes:\n  - qos: {depth: 1}\n"),
      ElementsAre("b.yaml:3:5: error: route: 'topic' is missing: expected a topic such as /sensing/points "
                  "(absolute; letters, digits, '_')",
                  "b.yaml:3:5: error: route: 'type' is missing: expected a message type such as "
                  "sensor_msgs/msg/PointCloud2",
                  "b.yaml:3:5: error: route: 'direction' is missing: expected one of dds_to_someip, "
                  "someip_to_dds",
                  "b.yaml:3:5: error: route: 'service' is missing: expected an id from 0x0001 to 0xfffd",
                  "b.yaml:3:5: error: route: 'instance' is missing: expected an id from 0x0001 to 0xfffe",
                  "b.yaml:3:5: error: route: 'eventgroup' is missing: expected an id from 0x0001 to 0xfffe",
                  "b.yaml:3:5: error: route: 'event' is missing: expected an id from 0x0001 to 0xfffe"));
}

TEST(ConfigErrors, TellFilesThatAreNoConfigurationApart) {
  EXPECT_THAT(problems_of(""),
              ElementsAre("b.yaml:1:1: error: the file is empty: expected at least 'someip' and 'routes'"));
  EXPECT_THAT(problems_of("# nothing\n"),
              ElementsAre("b.yaml:1:1: error: the file is empty: expected at least 'someip' and 'routes'"));
  EXPECT_THAT(problems_of("- 1\n"),
              ElementsAre("b.yaml:1:1: error: the file: expected a mapping (key: value), found a list"));
  EXPECT_THAT(problems_of(good_config + "---\nmore: 1\n"),
              ElementsAre("b.yaml:76:1: error: the file should end here: it is one YAML document"));
  // Of some such ends yaml-cpp's LoadAll() makes documents without end, as the fuzzer found.
  EXPECT_THAT(problems_of(good_config + "}\n"),
              ElementsAre("b.yaml:76:1: error: not valid YAML: illegal flow end"));
  EXPECT_THAT(problems_of("a: 1\n]"), ElementsAre("b.yaml:2:1: error: not valid YAML: illegal flow end"));
  EXPECT_THAT(problems_of("someip: {address: 127.0.0.1}\nroutes: []\n"),
              ElementsAre("b.yaml:2:9: error: routes: expected a list of routes, found an empty list"));
  EXPECT_THAT(problems_of("someip:\nroutes: 5\n"),
              ElementsAre("b.yaml:1:1: error: someip: expected a mapping (key: value), found nothing",
                          "b.yaml:2:9: error: routes: expected a list of routes, found '5'"));
  EXPECT_THAT(problems_of(std::string((std::size_t{1} << 20U) + 1, '#')),
              ElementsAre("b.yaml: error: the file is larger than 1 MiB"));
}

TEST(ConfigErrors, SayWhyAFileCannotBeRead) {
  const auto missing = load_config("/no/such/file.yaml");
  ASSERT_FALSE(missing);
  EXPECT_THAT(lines(missing.error()),
              ElementsAre("/no/such/file.yaml: error: cannot be read: No such file or directory"));
  const auto folder = load_config("/usr");
  ASSERT_FALSE(folder);
  EXPECT_THAT(lines(folder.error()), ElementsAre("/usr: error: cannot be read: it is a folder"));
  const auto endless = load_config("/dev/zero");
  ASSERT_FALSE(endless);
  EXPECT_THAT(lines(endless.error()), ElementsAre("/dev/zero: error: the file is larger than 1 MiB"));
}

TEST(ConfigErrors, PassOnWhatIsWrongWithAType) {
  const TypeCheck check = [](const std::string& type, const MessageRules&, const std::vector<std::string>&) {
    return TypeVerdict{.fault = type == "geometry_msgs/msg/Point" ? type + " is not known" : ""};
  };
  EXPECT_THAT(problems_of(good_config, check),
              ElementsAre("b.yaml:70:11: error: type: geometry_msgs/msg/Point is not known"));
}

TEST(ConfigErrors, SayOnceWhatIsWrongInAnAnchoredPiece) {
  const std::string text = R"(someip: {address: 127.0.0.1}
routes:
  - {topic: /a, event: 0x8001, port: 40000, <<: &rest {type: std_msgs/msg/String, direction: dds_to_someip, service: 0, instance: 1, eventgroup: 1}}
  - {topic: /b, event: 0x8002, port: 40000, <<: *rest}
)";
  EXPECT_THAT(problems_of(text),
              ElementsAre("b.yaml:3:118: error: service: expected an id from 0x0001 to 0xfffd, found '0'"));
}

// Two routes that differ in what a test gives them.
std::string two_routes(const std::string& first, const std::string& second) {
  const std::string common = "type: std_msgs/msg/String, eventgroup: 1, ";
  return "someip: {address: 127.0.0.1}\nroutes:\n  - {" + first + ", " + common + "major: 1}\n  - {" +
         second + ", " + common + "major: 1}\n";
}

TEST(ConfigConflict, OfOneTopicRoutedTwice) {
  EXPECT_THAT(
      problems_of(two_routes(
          "topic: /a, service: 1, instance: 1, event: 0x8001, direction: dds_to_someip, port: 40000",
          "topic: /a, service: 2, instance: 1, event: 0x8001, direction: dds_to_someip, port: 40000")),
      ElementsAre("b.yaml:4:13: error: topic: /a is already routed dds_to_someip by the route in line 3"));
}

TEST(ConfigConflict, OfOneTopicWithTwoTypes) {
  EXPECT_THAT(problems_of(R"(someip: {address: 127.0.0.1}
routes:
  - {topic: /a, type: std_msgs/msg/Bool, direction: someip_to_dds, service: 1, instance: 1, eventgroup: 1, event: 0x8001}
  - {topic: /a, type: std_msgs/msg/Byte, direction: dds_to_someip, service: 2, instance: 1, eventgroup: 1, event: 0x8001, port: 40000}
)"),
              ElementsAre("b.yaml:4:23: error: type: /a is std_msgs/msg/Bool in the route in line 3"));
}

TEST(ConfigConflict, OfOneEventRoutedTwice) {
  EXPECT_THAT(
      problems_of(two_routes("topic: /a, service: 1, instance: 1, event: 0x8001, direction: someip_to_dds",
                             "topic: /b, service: 1, instance: 1, event: 0x8001, direction: someip_to_dds")),
      ElementsAre(
          "b.yaml:4:49: error: event: service 0x0001 instance 0x0001 event 0x8001 is already routed by the "
          "route in line 3"));
}

TEST(ConfigConflict, OfAnEventThatWouldComeBack) {
  EXPECT_THAT(
      problems_of(two_routes(
          "topic: /a, service: 1, instance: 1, event: 0x8001, direction: someip_to_dds",
          "topic: /b, service: 1, instance: 1, event: 0x8001, direction: dds_to_someip, port: 40000")),
      ElementsAre(
          "b.yaml:4:49: error: event: service 0x0001 instance 0x0001 event 0x8001 is also routed the other "
          "way, so it would come back here, by the route in line 3"));
}

TEST(ConfigConflict, OfOneServiceAtTwoPortsOrVersions) {
  EXPECT_THAT(
      problems_of(two_routes("topic: /a, service: 1, instance: 1, event: 0x8001, direction: dds_to_someip, "
                             "port: 40000, minor: 1",
                             "topic: /b, service: 1, instance: 1, event: 0x8002, direction: dds_to_someip, "
                             "port: 40001, minor: 2")),
      ElementsAre("b.yaml:4:89: error: port: service 0x0001 instance 0x0001 has 40000 in the route in line 3",
                  "b.yaml:4:103: error: minor: service 0x0001 instance 0x0001 has 1 in the route in line 3"));
}

TEST(ConfigConflict, OfOneEventgroupSentTwoWays) {
  EXPECT_THAT(
      problems_of(two_routes("topic: /a, service: 1, instance: 1, event: 0x8001, direction: dds_to_someip, "
                             "port: 40000, multicast: {address: 239.0.0.1, port: 1}",
                             "topic: /b, service: 1, instance: 1, event: 0x8002, direction: dds_to_someip, "
                             "port: 40000, multicast: {address: 239.0.0.1, port: 2}")),
      ElementsAre(
          "b.yaml:4:107: error: multicast: service 0x0001 instance 0x0001 eventgroup 0x0001 has another "
          "in the route in line 3"));
}

TEST(ConfigConflict, OfTwoInstancesAtOnePort) {
  covers({"feat_req_someip_445", "feat_req_someip_967", "feat_req_someipsd_782"});
  EXPECT_THAT(
      problems_of(two_routes(
          "topic: /a, service: 1, instance: 1, event: 0x8001, direction: dds_to_someip, port: 40000",
          "topic: /b, service: 1, instance: 2, event: 0x8001, direction: dds_to_someip, port: 40000")),
      ElementsAre(
          "b.yaml:4:89: error: port: 40000 already belongs to service 0x0001 instance 0x0001 (line 3); "
          "instances of one service need ports of their own"));
}

TEST(ConfigConflict, OfAPortUsedBothWays) {
  EXPECT_THAT(
      problems_of(two_routes(
          "topic: /a, service: 1, instance: 1, event: 0x8001, direction: dds_to_someip, port: 40000",
          "topic: /b, service: 2, instance: 1, event: 0x8001, direction: someip_to_dds, port: 40000")),
      ElementsAre("b.yaml:4:89: error: port: 40000 is used the other way (dds_to_someip) by the route in "
                  "line 3; take "
                  "two ports"));
}

TEST(ConfigConflict, WithThePortOfServiceDiscovery) {
  covers({"feat_req_someip_676"});
  EXPECT_THAT(problems_of(two_routes(
                  "topic: /a, service: 1, instance: 1, event: 0x8001, direction: dds_to_someip, port: 30490",
                  "topic: /b, service: 2, instance: 1, event: 0x8001, direction: someip_to_dds")),
              ElementsAre("b.yaml:3:89: error: port: 30490 is service discovery's own port"));
}

TEST(ConfigConflict, OfMergedKeysIsReportedWhereTheyAreMergedIn) {
  EXPECT_THAT(
      problems_of(R"(someip: {address: 127.0.0.1}
routes:
  - &a {topic: /a, type: std_msgs/msg/Bool, direction: someip_to_dds, service: 1, instance: 1, eventgroup: 1, event: 0x8001}
  - topic: /b
    <<: *a
)"),
      ElementsAre(
          "b.yaml:5:5: error: event: service 0x0001 instance 0x0001 event 0x8001 is already routed by "
          "the route in line 3"));
}

TEST(ConfigConflict, IsNotSoughtInWhatCouldNotBeRead) {
  // Both services are wrong, and would be the same if they were taken as they are by default.
  EXPECT_THAT(
      problems_of(two_routes("topic: /a, service: x, instance: 1, event: 0x8001, direction: someip_to_dds",
                             "topic: /b, service: y, instance: 1, event: 0x8001, direction: someip_to_dds")),
      ElementsAre("b.yaml:3:26: error: service: expected an id from 0x0001 to 0xfffd, found 'x'",
                  "b.yaml:4:26: error: service: expected an id from 0x0001 to 0xfffd, found 'y'"));
}

TEST(ConfigWarning, ForAnEventIdThatLooksLikeAMethod) {
  covers({"feat_req_someip_626"});
  const auto loaded = parse_config(replaced(good_config, "0x8044", "0x0044"), "b.yaml");
  ASSERT_TRUE(loaded.has_value());
  EXPECT_THAT(lines(loaded->warnings),
              ElementsAre("b.yaml:28:12: warning: event: ids below 0x8000 are meant for methods; is "
                          "this the one the peer uses?"));
}

TEST(ConfigWarning, ForOffersThatExpireBeforeTheyAreRenewed) {
  const auto loaded = parse_config(replaced(good_config, "10 s", "2 s"), "b.yaml");
  ASSERT_TRUE(loaded.has_value());
  EXPECT_THAT(lines(loaded->warnings),
              ElementsAre("b.yaml:14:10: warning: ttl: offers live 2 s but are renewed only every 2 s "
                          "(cyclic_offer_delay)"));
}

TEST(ExplainProblems, ShowsTheLineAndThePlace) {
  const std::string text = "someip: {address: 127.0.0.1}\ndds:\n\tdomain: 7\n";
  const std::vector<Problem> problems{{Problem::Severity::error, "b.yaml", {1, 19}, "first"},
                                      {Problem::Severity::error, "b.yaml", {1, 19}, "second"},
                                      {Problem::Severity::warning, "b.yaml", {3, 2}, "third"},
                                      {Problem::Severity::error, "b.yaml", {9, 2}, "beyond the end"},
                                      {Problem::Severity::error, "b.yaml", {}, "of the file"}};
  EXPECT_EQ(explain(problems, text, {}),
            "b.yaml:1:19: error: first\n"
            "b.yaml:1:19: error: second\n"
            "    1 | someip: {address: 127.0.0.1}\n"
            "      |                   ^\n"
            "b.yaml:3:2: warning: third\n"
            "    3 | \tdomain: 7\n"
            "      | \t^\n"
            "b.yaml:9:2: error: beyond the end\n"
            "b.yaml: error: of the file\n"
            "4 errors in b.yaml\n");
}

TEST(ExplainProblems, StopsBeforeNobodyReadsOn) {
  const std::vector<Problem> problems(1000, {Problem::Severity::error, "b.yaml", {1, 1}, "wrong"});
  const std::string text = explain(problems, "", {});
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 51);
  EXPECT_THAT(text, testing::EndsWith("wrong\n1000 errors in b.yaml, not all of them shown\n"));
}

TEST(ExplainProblems, ColoursTheSeverity) {
  const std::vector<Problem> problems{{Problem::Severity::error, "b.yaml", {2, 1}, "wrong"}};
  EXPECT_EQ(explain(problems, "a\nb\n", {.red = "<red>", .green = "<green>", .off = "<off>"}),
            "b.yaml:2:1: <red>error: <off>wrong\n    2 | b\n      | <green>^<off>\n");
}

TEST(LinkLocalAddresses, AreRefusedAsAnOfferCannotNameTheirInterface) {
  const auto of = [](const std::string& address) {
    return problems_of("someip: {address: '" + address +
                       "', interface: eth0, sd: {multicast: 'ff02::4:c0de'}}\nroutes:\n"
                       "  - {topic: /p, type: a/msg/B, direction: someip_to_dds, service: 1, instance: 1, "
                       "eventgroup: 1, event: 0x8001}\n");
  };
  for (const std::string address : {"fe80::1", "febf:ffff::2"}) {
    EXPECT_THAT(of(address),
                ElementsAre("b.yaml:1:19: error: address: " + address +
                            " is link-local: it means another host on each interface, and an offer "
                            "cannot say which; take a global or unique local address (fd00::/8)"));
  }
  for (const std::string address : {"fd00::1", "fec0::1", "2001:db8::1", "::1"}) {
    EXPECT_THAT(of(address), ElementsAre("no errors"));
  }
}

}  // namespace
}  // namespace trestle::test
