#include <gmock/gmock.h>

#include <algorithm>

#include "bridge/carry/commands/explain.hpp"
#include "test/bridge/carry/config/problems_of.hpp"

namespace trestle::test::errors_test {
namespace {

using namespace carry;
using testing::ElementsAre;

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
          "at which services are offered",
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
              ElementsAre("b.yaml:83:1: error: the file should end here: it is one YAML document"));
  // Of some such ends yaml-cpp's LoadAll() makes documents without end, as the fuzzer found.
  EXPECT_THAT(problems_of(good_config + "}\n"),
              ElementsAre("b.yaml:83:1: error: not valid YAML: illegal flow end"));
  // A bracket that is never closed: where it was opened, whatever stands in texts and comments.
  EXPECT_THAT(problems_of("someip:\n  {address: 127.0.0.1\nroutes: [{a: ']}'}] # }\n"),
              ElementsAre("b.yaml:2:3: error: not valid YAML: this '{' is not closed; expected '}'"));
  EXPECT_THAT(problems_of("a: {b: [1, 2}\n"), ElementsAre(testing::HasSubstr("not valid YAML")));
  EXPECT_THAT(problems_of("{gear: 2"),
              ElementsAre("b.yaml:1:1: error: not valid YAML: this '{' is not closed; expected '}'"));
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
  const TypeCheck check = [](const TypeUse& use, const messages::MessageRules&, const messages::TypePlaces&) {
    return TypeVerdict{.fault = use.type == "geometry_msgs/msg/Point" ? use.type + " is not known" : ""};
  };
  EXPECT_THAT(problems_of(good_config, check),
              ElementsAre("b.yaml:77:11: error: type: geometry_msgs/msg/Point is not known"));
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

TEST(ExplainProblems, ShowsTheLineAndThePlace) {
  const std::string text = "someip: {address: 127.0.0.1}\ndds:\n\tdomain: 7\n";
  const std::vector<documents::Problem> problems{
      {documents::Problem::Severity::error, "b.yaml", {1, 19}, "first"},
      {documents::Problem::Severity::error, "b.yaml", {1, 19}, "second"},
      {documents::Problem::Severity::warning, "b.yaml", {3, 2}, "third"},
      {documents::Problem::Severity::error, "b.yaml", {9, 2}, "beyond the end"},
      {documents::Problem::Severity::error, "b.yaml", {}, "of the file"}};
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
  const std::vector<documents::Problem> problems(
      1000, {documents::Problem::Severity::error, "b.yaml", {1, 1}, "wrong"});
  const std::string text = explain(problems, "", {});
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 51);
  EXPECT_THAT(text, testing::EndsWith("wrong\n1000 errors in b.yaml, not all of them shown\n"));
}

TEST(ExplainProblems, ColoursTheSeverity) {
  const std::vector<documents::Problem> problems{
      {documents::Problem::Severity::error, "b.yaml", {2, 1}, "wrong"}};
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
}  // namespace trestle::test::errors_test
