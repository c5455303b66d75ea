#include "bridge/generate/explanation.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "bridge/describe/e2e_profiles.hpp"
#include "bridge/describe/sources/ros_types.hpp"
#include "bridge/describe/sources/sources.hpp"
#include "bridge/generate/service_explanation.hpp"

namespace trestle::generate {
namespace {

using ::testing::ContainsRegex;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

describe::System system_of(const std::string& fidl, const std::string& fdepl = {}) {
  std::vector<describe::SourceText> texts{
      {"Car.fidl", "package car\ninterface Door {\nversion { major 1 minor 0 }\n" + fidl + "}\n"}};
  if (!fdepl.empty()) {
    texts.push_back({"Car.fdepl",
                     "import \"platform:/plugin/org.genivi.commonapi.someip/deployment/"
                     "CommonAPI-4-SOMEIP_deployment_spec.fdepl\"\nimport \"Car.fidl\"\ndefine "
                     "org.genivi.commonapi.someip.deployment for interface car.Door {\n" +
                         fdepl + "}\n"});
  }
  describe::IdLock lock;
  return make_system(describe::read_sources(texts, {}), lock);
}

/// "offset size field type value"
std::vector<std::string> lines_of(const Explanation& explanation) {
  std::vector<std::string> lines;
  for (const describe::ByteRange& one : explanation.layout.ranges) {
    lines.push_back(one.offset_text + " " + one.size_text + " " + one.path + " " + one.type +
                    (one.value.empty() ? "" : " " + one.value));
  }
  return lines;
}

constexpr const char* door =
    "enumeration Side { LEFT = 0 RIGHT = 1 }\n"
    "struct Opening { Side side UInt16 angle String label }\n"
    "union Any { UInt8 small UInt32 large }\n"
    "method open { in { Opening opening } out { Boolean done } }\n"
    "broadcast moved { out { Opening opening } }\n"
    "broadcast chosen { out { Any any } }\n";

TEST(Explain, TakesValuesOfTypesOfEachKind) {
  const describe::System system = system_of(std::string{door} +
                                            "array Numbers of UInt16\nmap Places { Side to UInt8 }\n"
                                            "typedef Angle is UInt16\nattribute Numbers numbers\n");
  const auto bytes = [&](const char* type, const char* values) {
    const auto made = explain(system, type, values);
    std::string text;
    for (const std::byte one : made ? made->at(0).bytes : std::vector<std::byte>{}) {
      text += fmt::format("{:02x}", static_cast<unsigned>(one));
    }
    return made ? text : made.error();
  };
  EXPECT_EQ(bytes("Side", "RIGHT"), "01");
  EXPECT_EQ(bytes("Any", "{large: 7}"), "000000040000000200000007");
  EXPECT_EQ(bytes("Numbers", "[1, 2]"), "0000000400010002");
  EXPECT_EQ(bytes("Places", "{RIGHT: 3}"), "000000020103");
  EXPECT_EQ(bytes("Angle", "258"), "0102");
  EXPECT_EQ(bytes("car.Door.Opening", "{side: RIGHT, angle: 1}").substr(0, 6), "010001");
}

TEST(Explain, FindsMembersByTheirSelectors) {
  const describe::System system = system_of(
      "method m { in { UInt8 a } }\nmethod m:one { in { UInt16 b } }\nmethod m:two { in { UInt32 c } }\n"
      "broadcast b:one { out { UInt8 d } }\n");
  const auto one = explain(system, "Door.m:one.request", {});
  ASSERT_TRUE(one) << one.error();
  ASSERT_THAT(*one, SizeIs(1));
  EXPECT_THAT(lines_of(one->front()), ElementsAre("0 2 b uint16"));
  ASSERT_TRUE(explain(system, "car.Door.b:one", {}));
  const auto none = explain(system, "Door.something_else", {});
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error(), HasSubstr("Door.m:one"));
  EXPECT_THAT(none.error(), HasSubstr("Door.m:two"));
}

TEST(Explain, ShowsRealBytesWithTheirValues) {
  const describe::System system = system_of(door);
  ASSERT_TRUE(system.good);
  const auto moved = explain(system, "Door.moved", "{side: 1, angle: 258, label: ab}");
  ASSERT_TRUE(moved) << moved.error();
  ASSERT_THAT(*moved, SizeIs(1));
  EXPECT_THAT(lines_of(moved->front()),
              ElementsAre("0 1 opening.side Side RIGHT (1)", "1 2 opening.angle uint16 258",
                          "3 4 opening.label length 6", "7 6 opening.label string \"ab\""));
  EXPECT_THAT(moved->front().bytes, SizeIs(13));
  const std::string text = to_text(moved->front());
  EXPECT_THAT(text, HasSubstr("01 02"));
  EXPECT_THAT(text, HasSubstr("RIGHT (1)"));
}

TEST(Explain, ShowsWhatMayBeThereWithoutValues) {
  const auto open = explain(system_of(door), "car.Door.open", "");
  ASSERT_TRUE(open);
  ASSERT_THAT(*open, SizeIs(2));
  EXPECT_EQ((*open)[0].part, "request");
  EXPECT_EQ((*open)[1].part, "response");
  EXPECT_THAT(lines_of((*open)[1]), ElementsAre("0 1 done bool"));
  const auto chosen = explain(system_of(door), "Door.chosen", "");
  EXPECT_THAT(to_text(chosen->front()), HasSubstr("if the selector is 2"));
}

TEST(Explain, TakesValuesOfUnions) {
  const auto chosen = explain(system_of(door), "Door.chosen", "{any_value: {large: [7]}}");
  ASSERT_TRUE(chosen) << chosen.error();
  EXPECT_THAT(lines_of(chosen->front()),
              ElementsAre("0 4 any length 4", "4 4 any selector 2", "8 4 any.large uint32 7"));
}

TEST(Explain, TakesValuesOfMethodsWhoseResponseHasRulesOfItsOwn) {
  const describe::System system = system_of(std::string{door} +
                                            "union Other { UInt8 tiny }\n"
                                            "method ask { in { Any any } out { Other other } }\n"
                                            "method tell { in { UInt8 what } out { Other other } }\n");
  const auto ask = explain(system, "Door.ask", "{any: {large: 7}}");
  ASSERT_TRUE(ask) << ask.error();
  EXPECT_THAT(lines_of(ask->front()),
              ElementsAre("0 4 any length 4", "4 4 any selector 2", "8 4 any.large uint32 7"));
  for (const char* const element : {"Door.ask.response", "Door.tell.response"}) {
    const auto answer = explain(system, element, "{other: {tiny: 1}}");
    ASSERT_TRUE(answer) << answer.error();
    EXPECT_THAT(answer->front().bytes, SizeIs(9));
  }
  EXPECT_TRUE(explain(system, "Door.tell", "{what: 3}"));
}

TEST(Explain, KnowsTypesByTheirNames) {
  const auto type = explain(system_of(door), "Opening", "{angle: 3}");
  ASSERT_TRUE(type) << type.error();
  EXPECT_EQ(type->front().part, "type");
  EXPECT_THAT(type->front().bytes, SizeIs(11));
  messages::TypeLibrary library;
  const std::vector<describe::RosInterface> wanted{{.type = "geometry_msgs/Point"}};
  describe::IdLock lock;
  const describe::System ros = make_system(describe_ros(wanted, library), lock);
  const auto point = explain(ros, "geometry_msgs/Point", "{x: 1.5}");
  ASSERT_TRUE(point) << point.error();
  EXPECT_THAT(lines_of(point->front()),
              ElementsAre("0 8 x float64 1.5", "8 8 y float64 0", "16 8 z float64 0"));
}

TEST(Explain, ShowsTheHeaderOfProtection) {
  describe::System system = system_of(door);
  system.model.services[0].events[0].e2e = {.profile = "5", .numbers = {{"data_id", 1}}};
  const auto moved = explain(system, "Door.moved", "{label: ab}");
  ASSERT_TRUE(moved);
  EXPECT_THAT(lines_of(moved->front()),
              ElementsAre("0 2 (E2E CRC) header", "2 1 (E2E counter) header",
                          "3 1 opening.side Side LEFT (0)", "4 2 opening.angle uint16 0",
                          "6 4 opening.label length 6", "10 6 opening.label string \"ab\""));
  EXPECT_THAT(moved->front().bytes, SizeIs(16));
}

TEST(Explain, ShowsTheHeaderOfEachE2eProfile) {
  for (const describe::E2eProfile& profile : describe::e2e_profiles()) {
    describe::System system = system_of(door);
    system.model.services[0].events[0].e2e = {.profile = profile.name, .numbers = {{"data_id", 1}}};
    const auto moved = explain(system, "Door.moved", {});
    ASSERT_TRUE(moved) << profile.name;
    std::size_t bytes = 0;
    for (const describe::ByteRange& one : moved->front().layout.ranges) {
      bytes += one.path.starts_with("(E2E ") ? one.bytes.value_or(0) : 0;
    }
    EXPECT_EQ(bytes, profile.header_bytes) << profile.name;
  }
}

TEST(Explain, SaysWhyProtectionCannotBeDone) {
  const auto first = [](const describe::Protection& e2e) {
    describe::System system = system_of(door);
    system.model.services[0].events[0].e2e = e2e;
    const auto moved = explain(system, "Door.moved", {});
    EXPECT_TRUE(moved);
    const describe::ByteRange& range = moved->front().layout.ranges.at(0);
    return range.offset_text + " " + range.path + " " + range.rule;
  };
  EXPECT_THAT(first({.profile = "9"}),
              testing::StartsWith("? (E2E header) profile 9, which cannot be done: "));
  EXPECT_THAT(
      first({.profile = "5", .numbers = {{"data_id", 1}}}),
      testing::StartsWith("0 (E2E CRC) profile 5, which cannot be done: e2e: 'data_bits' is missing: "));
  EXPECT_EQ(first({.profile = "4", .numbers = {{"data_id", 1}}}),
            "0 (E2E length) profile 4, written when it is sent");
  // Instances may differ, also in where their header is.
  describe::Protection e2e{.profile = "4", .numbers = {{"data_id", 1}}};
  e2e.set(someip::InstanceId{2}, {.profile = "4", .numbers = {{"data_id", 2}}});
  EXPECT_EQ(first(e2e),
            "0 (E2E length) profile 4, written when it is sent; in instance 0x0002 data_id 0x0002");
  e2e.set(someip::InstanceId{3}, {.profile = "7", .numbers = {{"data_id", 3}}});
  EXPECT_THAT(first(e2e),
              testing::StartsWith("? (E2E header) profile 4, written when it is sent; in instance "));
}

TEST(Explain, TellsOfACrcBehindAHeader) {
  describe::System system =
      system_of(door, "SomeIpServiceID = 1\nbroadcast moved { SomeIpBroadcastCRCWidth = four }\n");
  system.model.services[0].events[0].e2e = {.profile = "4", .numbers = {{"data_id", 1}}};
  const auto moved = explain(system, "Door.moved", {});
  ASSERT_TRUE(moved);
  EXPECT_EQ(lines_of(moved->front()).back(), "? 4 (CRC) CRC");
  const auto values = explain(system, "Door.moved", "{label: ab}");
  ASSERT_FALSE(values);
  EXPECT_EQ(
      values.error(),
      "values of Door.moved cannot be given: a CRC of 4 bytes in the payload, which Trestle does not make");
  EXPECT_THAT(to_text(**explain_service(system, "Door")), HasSubstr(", CRC of 4 bytes)\n"));
}

TEST(Explain, PrintsJson) {
  const auto moved = explain(system_of(door), "Door.moved", "{label: ab}");
  const auto json = nlohmann::json::parse(to_json_text(*moved));
  EXPECT_EQ(json[0]["element"], "Door.moved");
  EXPECT_EQ(json[0]["bytes"], "00000000000006efbbbf616200");
  EXPECT_EQ(json[0]["ranges"][1]["field"], "opening.angle");
  EXPECT_EQ(json[0]["ranges"][1]["at"], 1);
  EXPECT_EQ(json[0]["ranges"][1]["bytes"], 2);
}

TEST(Explain, TakesTheNamesThatOtherToolsTake) {
  const describe::System system =
      system_of(std::string{door} + "attribute UInt8 tilt readonly\nbroadcast b:one { out { UInt8 d } }\n");
  for (const char* name : {"Door.0x0001.open", "car.Door.1.moved", "Door.*.tilt.get", "Door.tilt.notify",
                           "Door.b", "Door.open.request"}) {
    const auto explained = explain(system, name, {});
    EXPECT_TRUE(explained) << explained.error();
  }
  EXPECT_FALSE(explain(system, "Door.tilt.set", {}));
  describe::System two = system;
  two.model.services.push_back(two.model.services.front());
  two.model.services.back().scope = "bus";
  EXPECT_THAT(explain(two, "Door.moved", {}).error(),
              HasSubstr("there are car.Door and bus.Door: write the full name"));
  EXPECT_TRUE(explain(two, "bus.Door.moved", {}));
}

TEST(Explain, TellsThePlaceInTheValues) {
  const describe::System system = system_of(door);
  EXPECT_THAT(explain(system, "Door.moved", "side: 1\nangle: 70000\n", "moved.yaml").error(),
              HasSubstr("moved.yaml:2:8: "));
  EXPECT_THAT(explain(system, "Door.moved", "{side: 1", "moved.yaml").error(), HasSubstr("moved.yaml:1:9: "));
}

TEST(ExplainService, ShowsMembersWithIdsAndValues) {
  const describe::System system = system_of(
      std::string{door} + "method ring fireAndForget { in { String[] tunes } }\nattribute UInt8 level\n",
      "SomeIpServiceID = 0x4711\nmethod open { SomeIpMethodID = 1 }\nmethod ring { SomeIpMethodID = 2 }\n"
      "broadcast moved { SomeIpEventID = 0x8001 }\nbroadcast chosen { SomeIpEventID = 0x8002 }\n"
      "attribute level { SomeIpGetterID = 3 SomeIpSetterID = 4 SomeIpNotifierID = 0x8003 }\n");
  const auto made = explain_service(system, "Door");
  ASSERT_TRUE(made && *made);
  EXPECT_EQ(to_text(**made),
            "car.Door 0x4711, version 1.0:\n"
            "  method  open    0x0001                                 request(car.Door.Opening opening) "
            "response(bool done)\n"
            "  method  ring    0x0002                                 request(string[] tunes)\n"
            "  event   moved   0x8001                                 payload(car.Door.Opening opening)\n"
            "  event   chosen  0x8002                                 payload(car.Door.Any any)\n"
            "  field   level   get 0x0003, set 0x0004, notify 0x8003  payload(uint8 level)\n");
  const auto json = nlohmann::json::parse(to_json_text(**made));
  EXPECT_EQ(json["id"], "0x4711");
  EXPECT_EQ(json["members"][0]["response"], "bool done");
  EXPECT_FALSE(json.contains("id_is_chosen") || json["members"][0].contains("chosen_ids"));
  EXPECT_FALSE(explain_service(system, "Door.open")->has_value());
  EXPECT_FALSE(explain_service(system, "Dor")->has_value());
}

TEST(Explain, NamesTheEnumeratorsOfAllEnumerations) {
  const describe::System system = system_of(
      "enumeration Gear { PARK = 1 DRIVE = 2 }\nenumeration Wide extends Gear { REVERSE = 4 }\n"
      "struct Inner { Wide wide UInt8 x }\n"
      "method shift { in { Gear gear Inner[] inners Gear again } error { OK FAILED = 7 } }\n");
  const auto made = explain(system, "Door.shift", "");
  ASSERT_TRUE(made);
  ASSERT_THAT(*made, SizeIs(2));
  EXPECT_THAT(to_text(made->at(0)), HasSubstr("\n  Gear: PARK = 1, DRIVE = 2\n"
                                              "  Wide: PARK = 1, DRIVE = 2, REVERSE = 4\n"));
  // FIDL gives it no name.
  EXPECT_THAT(to_text(made->at(1)), HasSubstr("\n  error: OK = 0, FAILED = 7\n"));
  const auto json = nlohmann::json::parse(to_json_text(*made));
  ASSERT_EQ(json[0]["enumerations"].size(), 2);
  EXPECT_EQ(json[0]["enumerations"][0]["type"], "Gear");
  EXPECT_EQ(json[0]["enumerations"][1]["enumerators"][2],
            nlohmann::json({{"name", "REVERSE"}, {"value", 4}}));
  EXPECT_FALSE(nlohmann::json::parse(to_json_text(*explain(system_of(door), "Door.chosen", "")))[0].contains(
      "enumerations"));
  // Two of one name.
  describe::IdLock lock;
  const describe::System twice =
      make_system(describe::read_sources(
                      std::vector{describe::SourceText{
                          "Two.fidl",
                          "package car\ntypeCollection Front { version { major 1 minor 0 } enumeration Mode "
                          "{ OFF = 0 } }\n"
                          "typeCollection Rear { version { major 1 minor 0 } enumeration Mode { OFF = 3 } }\n"
                          "interface Two { version { major 1 minor 0 }\n"
                          "method set { in { Front.Mode front Rear.Mode rear Rear.Mode[] more } } }\n"}},
                      {}),
                  lock);
  const auto both = explain(twice, "Two.set", "");
  ASSERT_TRUE(both);
  const std::string text_of_both = to_text(both->at(0));
  EXPECT_THAT(text_of_both, HasSubstr("\n  car.Front.Mode: OFF = 0\n  car.Rear.Mode: OFF = 3\n"));
  EXPECT_THAT(text_of_both, HasSubstr(" front  car.Front.Mode"));
  EXPECT_THAT(text_of_both, HasSubstr(" rear   car.Rear.Mode"));
  EXPECT_THAT(text_of_both, HasSubstr("car.Rear.Mode[]"));
  // Many of them stand in several lines.
  std::string many = "enumeration Many {";
  for (int i = 0; i < 40; ++i) {
    many += fmt::format(" VALUE_{}", i);
  }
  const std::string wide = to_text(
      explain(system_of(many + " }\nbroadcast moved { out { Many many } }\n"), "Door.moved", "")->at(0));
  EXPECT_THAT(wide, HasSubstr(",\n    VALUE_"));
  EXPECT_THAT(wide, HasSubstr("VALUE_39 = 39\n"));
}

TEST(ExplainAll, ListsServicesWithMembersAndTypes) {
  const Contents contents = contents_of(system_of(door));
  EXPECT_THAT(to_text(contents),
              ContainsRegex("^car.Door 0x[0-9a-f]{4} chosen, version 1.0:\n  method  open "));
  EXPECT_THAT(to_text(contents), HasSubstr("\ntypes:\n"
                                           "  car.Door.Side     enumeration\n"
                                           "  car.Door.Opening  structure\n"
                                           "  car.Door.Any      choice\n"));
  const auto json = nlohmann::json::parse(to_json_text(contents));
  EXPECT_EQ(json["services"][0]["service"], "car.Door");
  EXPECT_EQ(json["types"][2], nlohmann::json({{"name", "car.Door.Any"}, {"kind", "choice"}}));
  for (const Contents::NamedType& type : contents.types) {
    EXPECT_TRUE(explain(system_of(door), type.name, "")) << type.name;
  }
}

TEST(ExplainService, MarksIdsThatNobodyGave) {
  const std::string fidl = "method open { }\nattribute UInt8 level noSubscriptions\n";
  const auto bare = explain_service(system_of(fidl), "Door");
  ASSERT_TRUE(bare && *bare);
  EXPECT_THAT(to_text(**bare),
              ContainsRegex("^car.Door 0x[0-9a-f]{4} chosen, version 1.0:\n"
                            "  method  open   0x0001 chosen  .*\n"
                            "  field   level  get 0x0002 chosen, set 0x0003 chosen  .*\n"
                            "chosen: Trestle chose this id, because no description gives it\n$"));
  const auto some = explain_service(
      system_of(fidl,
                "SomeIpServiceID = 0x4711\nattribute level { SomeIpGetterID = 5 SomeIpSetterID = 6 }\n"),
      "Door");
  ASSERT_TRUE(some && *some);
  EXPECT_THAT(to_text(**some), AllOf(HasSubstr("car.Door 0x4711, version"), HasSubstr("0x0001 chosen"),
                                     HasSubstr("get 0x0005, set 0x0006 ")));
  const auto json = nlohmann::json::parse(to_json_text(**some));
  EXPECT_FALSE(json.contains("id_is_chosen"));
  EXPECT_EQ(json["members"][0]["ids"], "0x0001");
  EXPECT_EQ(json["members"][0]["chosen_ids"], nlohmann::json::array({"0x0001"}));
  EXPECT_TRUE(nlohmann::json::parse(to_json_text(**bare))["id_is_chosen"]);
}

TEST(Explain, TellsWhatIsWrong) {
  const describe::System system = system_of(door);
  EXPECT_THAT(explain(system, "Door.mved", "").error(), HasSubstr("did you mean 'Door.moved'?"));
  EXPECT_THAT(explain(system, "Zebra", "").error(), HasSubstr("there are: Door.moved"));
  EXPECT_THAT(explain(system, "Door.moved", "{angle: 70000}").error(), HasSubstr("70000"));
}

}  // namespace
}  // namespace trestle::generate
