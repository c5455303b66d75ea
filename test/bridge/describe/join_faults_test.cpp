// What join() finds wrong in a model, of one source or of several.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <functional>
#include <limits>

#include "bridge/describe/join.hpp"
#include "test/bridge/describe/described.hpp"

namespace trestle::describe {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::StartsWith;

TEST(Join, TellsOfIdsThatAreThereTwice) {
  Model model = described();
  model.services.push_back({.name = "Window", .scope = "car", .id = someip::ServiceId{0x1234}});
  model.services.front().events.push_back({.name = "bent", .id = someip::MethodId{0x8002}});
  model.services.front().methods = {{.name = "open", .id = someip::MethodId{1}}};
  model.services.front().fields[0].getter = someip::MethodId{1};
  const auto problems = join(model);
  ASSERT_THAT(problems, SizeIs(3));
  EXPECT_THAT(problems[0].text, HasSubstr("service Window has the id 0x1234 of Door"));
  EXPECT_THAT(problems[1].text, HasSubstr("Door.angle (getter) has the id 0x0001 of Door.open"));
  EXPECT_THAT(problems[2].text, HasSubstr("Door.angle (notifier) has the id 0x8002 of Door.bent"));
}

/// In a FDEPL file, say, and not in the FIDL.
TEST(Join, TellsOfIdsWhereTheyStand) {
  Model model = described();
  model.files.push_back("Door.fdepl");
  const auto at = [](int line) { return Place{.file = 1, .mark = {line, 9}}; };
  Service& door = model.services[0];
  door.id_place = at(1);
  door.events.push_back({.name = "bent", .id = someip::MethodId{0x8001}, .id_place = at(2)});
  door.events[0].id_place = at(3);
  door.methods = {{.name = "open", .id = someip::MethodId{1}, .id_place = at(4)}};
  door.fields[0].getter = door.fields[0].setter = someip::MethodId{1};
  door.fields[0].getter_place = at(5);
  door.fields[0].setter_place = at(6);
  door.fields[0].notifier = someip::MethodId{0x8001};
  door.fields[0].notifier_place = at(7);
  // What extends it has the same ids from the same lines: they are told once.
  Service front = door;
  front.name = "Front";
  front.base = "car.Door";
  model.services.push_back(front);
  model.services.push_back(
      {.name = "Window", .scope = "car", .id = someip::ServiceId{0x1234}, .id_place = at(8)});
  std::vector<std::string> told;
  for (const documents::Problem& problem : join(model)) {
    told.push_back(to_string(problem));
  }
  EXPECT_THAT(told,
              ElementsAre("Door.fdepl:8:9: error: service Window has the id 0x1234 of Door, at "
                          "Door.fdepl:1:9",
                          "Door.fdepl:2:9: error: Door.bent has the id 0x8001 of Door.moved, at "
                          "Door.fdepl:3:9",
                          "Door.fdepl:5:9: error: Door.angle (getter) has the id 0x0001 of Door.open, at "
                          "Door.fdepl:4:9",
                          "Door.fdepl:6:9: error: Door.angle (setter) has the id 0x0001 of Door.open, at "
                          "Door.fdepl:4:9",
                          "Door.fdepl:7:9: error: Door.angle (notifier) has the id 0x8001 of Door.moved, "
                          "at Door.fdepl:3:9"));
  // They stay right in a larger model.
  Model other{.files = {"a", "b"}};
  append(other, model);
  EXPECT_EQ(other.services[0].id_place.file, 3U);
  EXPECT_EQ(other.services[0].events[0].id_place.file, 3U);
  EXPECT_EQ(other.services[0].methods[0].id_place.file, 3U);
  EXPECT_EQ(other.services[0].fields[0].getter_place.file, 3U);
  EXPECT_EQ(other.services[0].fields[0].setter_place.file, 3U);
  EXPECT_EQ(other.services[0].fields[0].notifier_place.file, 3U);
}

TEST(Join, TellsOfEachHeirThatHasAnIdOfItsBase) {
  Model model{.files = {"D.fdepl"}};
  const auto at = [](int line) { return Place{.mark = {line, 1}}; };
  Service door{.name = "Door"};
  door.fields = {{.name = "angle", .getter = someip::MethodId{1}, .getter_place = at(1)}};
  for (const int line : {2, 3}) {
    Service heir = door;
    heir.name = fmt::format("Heir{}", line);
    heir.base = "Door";
    heir.methods = {{.name = "open", .id = someip::MethodId{1}, .id_place = at(line)}};
    model.services.push_back(std::move(heir));
  }
  model.services.push_back(door);
  const auto problems = join(model);
  ASSERT_THAT(problems, SizeIs(2));
  EXPECT_THAT(problems[0].text,
              HasSubstr("Heir2.angle (getter) has the id 0x0001 of Heir2.open, at D.fdepl:2:1"));
  EXPECT_THAT(problems[1].text,
              HasSubstr("Heir3.angle (getter) has the id 0x0001 of Heir3.open, at D.fdepl:3:1"));
}

TEST(Join, TellsOfAThirdServiceWithTheIdAndVersionOfTheSecond) {
  Model model = described();
  for (const char* name : {"Second", "Third"}) {
    model.services.push_back({.name = name, .scope = "car", .id = someip::ServiceId{0x1234}, .major = 2});
  }
  const auto problems = join(model);
  ASSERT_THAT(problems, SizeIs(1));
  EXPECT_THAT(problems[0].text, HasSubstr("service Third has the id 0x1234 of Second"));
}

/// [feat_req_someipids_505] [feat_req_someipids_555] [feat_req_someipids_636]
TEST(Join, TellsOfIdsThatAreReserved) {
  Model model{.files = {"a.fdepl"}};
  const auto at = [](int line) { return Place{.mark = {line, 1}}; };
  Service door{.name = "Door", .id = someip::ServiceId{0xffff}, .id_place = at(1)};
  door.eventgroups = {{.id = someip::EventgroupId{0}, .place = at(2)},
                      {.id = someip::EventgroupId{0xffff}, .place = at(3)}};
  int line = 4;
  using Ids = std::initializer_list<std::uint16_t>;
  for (const std::uint16_t id : Ids{0x7fff, 0x0001, 0x7ffe, 0x8001, 0xffff, 0x9000}) {
    door.methods.push_back({.name = "m", .id = someip::MethodId{id}, .id_place = at(line++)});
  }
  for (const std::uint16_t id : Ids{0x8000, 0x8001, 0xfffe, 0x0005}) {
    door.events.push_back({.name = "e", .id = someip::MethodId{id}, .id_place = at(line++)});
  }
  model.services = {door,
                    {.name = "Zero", .id = someip::ServiceId{0}, .id_place = at(20)},
                    {.name = "Other", .id = someip::ServiceId{0xfffe}, .id_place = at(21)}};
  std::vector<std::string> told;
  for (const documents::Problem& problem : join(model)) {
    told.push_back(to_string(problem));
  }
  EXPECT_THAT(
      told,
      ElementsAre(
          "a.fdepl:1:1: error: service Door has the id 0xffff, which is that of service discovery and magic "
          "cookies: give it another one",
          "a.fdepl:2:1: error: service Door has the eventgroup 0x0000, which is reserved: give it another id",
          "a.fdepl:3:1: error: service Door has the eventgroup 0xffff, which is that of all eventgroups: "
          "give "
          "it another id",
          "a.fdepl:4:1: warning: Door.m has the id 0x7fff, which is reserved: other stacks may refuse it",
          "a.fdepl:7:1: warning: Door.m has the id 0x8001, and 1 more like it: methods have no bit 15, from "
          "0x0001 to 0x7ffe",
          "a.fdepl:8:1: warning: Door.m has the id 0xffff, which is reserved: other stacks may refuse it",
          "a.fdepl:10:1: warning: Door.e has the id 0x8000, which is reserved: other stacks may refuse it",
          "a.fdepl:13:1: warning: Door.e has the id 0x0005: events have bit 15, from 0x8001 on",
          "a.fdepl:20:1: error: service Zero has the id 0x0000, which is reserved: give it another one",
          "a.fdepl:21:1: warning: service Other has the id 0xfffe, by which service discovery announces "
          "services of other protocols"));
  // Told once, also where a model is joined again.
  std::vector<documents::Problem> again = join(model);
  const std::size_t before = again.size();
  model.services.push_back({.name = "Late", .id = someip::ServiceId{0xfffe}, .major = 2, .id_place = at(22)});
  join_again(model, again);
  EXPECT_EQ(again.size(), before + 1);
}

TEST(Join, LetsAnInterfaceAndItsHeirHaveOneId) {
  Model model = described();
  model.services.push_back(
      {.name = "Window", .scope = "car", .id = someip::ServiceId{0x1234}, .base = "car.Door"});
  EXPECT_THAT(join(model), IsEmpty());
  EXPECT_THAT(model.services, SizeIs(2));
}

/// ARXML does not say that an interface extends another one: the members of that one are copied.
TEST(Join, LetsAServiceAndOneWithAllItsMembersHaveOneId) {
  Model model = described();
  Service window = model.services[0];
  window.name = "Window";
  window.methods = {{.name = "open", .id = someip::MethodId{1}}};
  for (const bool heir_first : {false, true}) {
    Model both = model;
    both.services.insert(heir_first ? both.services.begin() : both.services.end(), window);
    const auto problems = join(both);
    ASSERT_THAT(problems, SizeIs(1));
    EXPECT_EQ(problems[0].severity, documents::Problem::Severity::warning);
    EXPECT_THAT(problems[0].text, HasSubstr(heir_first ? "service Door has the id 0x1234 of Window, at "
                                                       : "service Window has the id 0x1234 of Door, at "));
    EXPECT_THAT(both.services, SizeIs(2));
  }
  // Not where a member has another id, nor where both have the same.
  Service other = window;
  other.events[0].id = someip::MethodId{0x8003};
  Service copy = model.services[0];
  copy.name = "Copy";
  for (const Service& service : {other, copy}) {
    Model both = model;
    both.services.push_back(service);
    const auto problems = join(both);
    ASSERT_THAT(problems, SizeIs(1));
    EXPECT_EQ(problems[0].severity, documents::Problem::Severity::error);
  }
}

/// As those of CommonAPI's ti_datatypes_combined: the message type tells them apart.
TEST(Join, LetsAMethodAndAnEventHaveOneId) {
  Model model = described();
  model.services.front().methods = {{.name = "open", .id = someip::MethodId{0x8002}},
                                    {.name = "shut", .id = someip::MethodId{0x8001}}};
  const auto problems = join(model);
  ASSERT_THAT(problems, SizeIs(1));
  EXPECT_EQ(problems[0].severity, documents::Problem::Severity::warning);
  EXPECT_EQ(problems[0].text,
            "Door.open has the id 0x8002, and 1 more like it: methods have no bit 15, from 0x0001 to 0x7ffe");
}

TEST(Join, RefusesNamesThatSteerATerminal) {
  const auto problem_of = [](const std::function<void(Model&)>& edit) {
    Model model = described();
    edit(model);
    const auto problems = join(model);
    return problems.size() == 1 ? to_string(problems[0]) : std::to_string(problems.size()) + " problems";
  };
  EXPECT_THAT(
      problem_of([](Model& model) { model.services[0].name = "Do\x1b[31mor"; }),
      StartsWith("Door.fidl:3:1: error: a control character, or one that is not UTF-8, is in the name "
                 "'Do\\x1b[31mor'"));
  for (const std::string bad : {"\xc2\x9b"
                                "31m",
                                "\xe2\x80\xae", "\xff"}) {
    EXPECT_THAT(problem_of([&](Model& model) { model.services[0].events[0].name += bad; }),
                HasSubstr("in the name 'moved\\"));
    EXPECT_THAT(problem_of([&](Model& model) { model.services[0].events[0].payload.values[0].name = bad; }),
                HasSubstr("in the name"));
    EXPECT_THAT(problem_of([&](Model& model) {
                  model.types[0].enumerators = {{bad, 1}};
                }),
                HasSubstr("in the name"));
    EXPECT_THAT(problem_of([&](Model& model) { model.instances[0].name = bad; }), HasSubstr("in the name"));
    EXPECT_THAT(problem_of([&](Model& model) {
                  model.services[0].eventgroups = {{.name = bad, .id = someip::EventgroupId{1}}};
                }),
                HasSubstr("in the name"));
  }
  EXPECT_EQ(problem_of([](Model& model) { model.services[0].events[0].name = "T\xc3\xbcr"; }), "0 problems");
}

TEST(Join, RefusesEnumeratorsThatTheWireHasNoRoomFor) {
  using messages::Primitive;
  const auto at = [](int line) { return Place{.mark = {line, 1}}; };
  Model model{.files = {"E.fidl"}};
  const auto add = [&](std::string name, Primitive primitive, std::vector<std::int64_t> values, int line) {
    Type type{.kind = Kind::enumeration, .name = std::move(name), .primitive = primitive, .place = at(line)};
    for (const std::int64_t value : values) {
      type.enumerators.push_back({.name = fmt::format("V{}", value), .value = value, .place = at(++line)});
    }
    return model.add(std::move(type));
  };
  const TypeIndex small = add("Small", Primitive::uint8, {0, 255, 256, -1}, 10);
  add("Signed", Primitive::int8, {127, -128, 128, -129}, 20);
  add("Wide", Primitive::uint64, {-1, std::numeric_limits<std::int64_t>::min()}, 30);
  const TypeIndex word = add("Word", Primitive::uint16, {9}, 40);
  const TypeIndex heir = add("Heir", Primitive::uint8, {}, 50);
  model.at(heir).base = word;
  model.at(heir).wire.bits = 3;
  // Where a use has fewer bits: a field, and a member of a structure.
  Value four{.name = "four", .type = word, .place = at(61)};
  four.wire.bits = 4;
  Value three = four;
  three.wire.bits = 3;
  three.place = at(62);
  model.add({.kind = Kind::structure, .name = "S", .members = {four, three}});
  three.place = {};
  model.services = {{.name = "Door"}};
  model.services[0].fields = {{.name = "f", .payload = {.values = {three}}, .place = at(63)}};
  model.services[0].events = {{.name = "e", .payload = {.values = {{.type = small}}}}};
  std::vector<std::string> told;
  for (const documents::Problem& problem : join(model)) {
    told.push_back(to_string(problem));
  }
  const std::string change = ": make it wider, or the value another one";
  EXPECT_THAT(
      told, ElementsAre(
                "E.fidl:13:1: error: the enumerator V256 = 256 does not fit into the 8 bits, from 0 to 255, "
                "that Small has on the wire" +
                    change,
                "E.fidl:14:1: error: the enumerator V-1 = -1 does not fit into the 8 bits, from 0 to 255, "
                "that Small has on the wire" +
                    change,
                "E.fidl:23:1: error: the enumerator V128 = 128 does not fit into the 8 bits, from -128 to "
                "127, that Signed has on the wire" +
                    change,
                "E.fidl:24:1: error: the enumerator V-129 = -129 does not fit into the 8 bits, from -128 to "
                "127, that Signed has on the wire" +
                    change,
                "E.fidl:50:1: error: the enumerator V9 = 9 of Word, which Heir extends, does not fit into "
                "the 3 bits, from 0 to 7, that this one has on the wire: make it wider",
                "E.fidl:62:1: error: the enumerator V9 = 9 of Word does not fit into the 3 bits, from 0 to "
                "7, that it has here",
                "E.fidl:63:1: error: the enumerator V9 = 9 of Word does not fit into the 3 bits, from 0 to "
                "7, that it has here"));
}

TEST(Join, RefusesTypesThatAreNestedTooDeep) {
  const auto nested = [](std::uint32_t count) {
    Model model;
    model.add({.primitive = messages::Primitive::uint8});
    for (std::uint32_t i = 0; i < count; ++i) {
      model.add({.kind = Kind::array, .element = {.type = TypeIndex{i}}});
    }
    return model;
  };
  Model good = nested(199);
  EXPECT_THAT(join(good), IsEmpty());
  Model deep = nested(30'000);
  ASSERT_THAT(join(deep), SizeIs(1));
  EXPECT_EQ(join(deep).front().text, "types are nested more than 200 deep");
  Model round = nested(3);
  round.types[1].element.type = TypeIndex{3};
  round.types[2].members = {{.name = "a", .type = TypeIndex{2}}, {.name = "b", .type = TypeIndex{1}}};
  EXPECT_THAT(join(round), IsEmpty()) << "a circle has an end";
}

TEST(Join, LetsTwoMajorVersionsHaveOneId) {
  Model model = described();
  model.services.push_back({.name = "Door2", .scope = "car", .id = someip::ServiceId{0x1234}, .major = 2});
  EXPECT_THAT(join(model), IsEmpty());
}

}  // namespace
}  // namespace trestle::describe
