#include "bridge/describe/lower.hpp"

#include <gmock/gmock.h>

#include <set>

#include "bridge/describe/raise.hpp"
#include "bridge/describe/ros_names.hpp"
#include "bridge/messages/convert/service_plans.hpp"
#include "bridge/messages/types/parsers.hpp"
#include "test/bridge/describe/lost.hpp"
#include "test/bridge/describe/lowered.hpp"
#include "test/bytes.hpp"

namespace trestle::describe::lower_test {
namespace {

using lowered::array_of;
using lowered::event;
using lowered::library_of;
using lowered::number;
using lowered::structure;
using lowered::text;
using lowered::value;
using lowered::values_of;

using messages::Primitive;
using someip::FieldWidth;
using testing::Contains;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;

std::string text_of(const Lowered& lowered, const std::string& name) {
  const auto* const definition = lowered.definition(name);
  return definition == nullptr ? "not there" : msg_text(lowered, *definition);
}

/// The payload of the only event, of a value in JSON.
std::string payload_of(const Model& model, const std::string& json) {
  const Lowered lowered = lower(model);
  if (lowered.members.empty()) {
    return lowered.not_carried.empty() ? "nothing" : lowered.not_carried.back().what;
  }
  const auto values = values_of(lowered, lowered.members[0]);
  const auto payload = values.parse(json, messages::ValueForm::json);
  return payload ? test::to_hex(*payload) : to_string(payload.error());
}

TEST(RosNames, AreWhatRosAllows) {
  EXPECT_EQ(ros_field_name("doorState"), "door_state");
  EXPECT_EQ(ros_field_name("DTCCode"), "dtc_code");
  EXPECT_EQ(ros_field_name("already_good2"), "already_good2");
  EXPECT_EQ(ros_field_name("_x__y_"), "x_y");
  EXPECT_EQ(ros_field_name("2nd"), "n2nd");
  EXPECT_EQ(ros_field_name("class"), "class_value");
  EXPECT_EQ(ros_field_name("\u00e4"), "value");
  EXPECT_EQ(ros_type_name("curve_profile_t"), "CurveProfileT");
  EXPECT_EQ(ros_type_name("CurveProfile"), "CurveProfile");
  EXPECT_EQ(ros_type_name("3D"), "N3D");
  EXPECT_EQ(ros_constant_name("lowLevel"), "LOW_LEVEL");
  EXPECT_EQ(ros_package_name("org.example.DataTypes"), "data_types");
  EXPECT_EQ(ros_package_name("/Services/Body"), "body");
  EXPECT_EQ(ros_package_name("org.interface"), "interface_msgs");
  EXPECT_EQ(ros_package_name("org.install"), "install_msgs") << "CMake has a target of this name";
}

TEST(Lower, MakesMessagesOfEventsAndKeepsWhatTheyWere) {
  Model model;
  const TypeIndex speed = number(model, Primitive::uint16);
  Value value = lowered::value(model, "speedLimit", speed);
  value.notes = {.description = "of the road\nahead", .unit = "km/h"};
  event(model, {value, lowered::value(model, "class", text(model))});
  const Lowered lowered = lower(model);
  ASSERT_EQ(lowered.members.size(), 1U);
  EXPECT_EQ(lowered.members[0].type, "test/msg/DoorChanged");
  EXPECT_EQ(text_of(lowered, "test/msg/DoorChanged"),
            "\n# of the road\n# ahead\n# [km/h]\nuint16 speed_limit\nstring class_value\n");
  EXPECT_EQ(lowered.sources.at("test/msg/DoorChanged"), "org.test.Door.changed");
  EXPECT_EQ(lowered.sources.at("test/msg/DoorChanged.speed_limit"), "speedLimit");
  EXPECT_EQ(lowered.ros_names("org.test.Door.changed"), std::vector<std::string>{"test/msg/DoorChanged"});
  EXPECT_EQ(lower(model, {.package = "car_msgs"}).members[0].type, "car_msgs/msg/DoorChanged");
}

TEST(Lower, TakesASingleStructureAsItIs) {
  Model model;
  const TypeIndex point = structure(model, "Point", {value(model, "x", number(model, Primitive::uint8))});
  const TypeIndex alias = model.add({.kind = Kind::alias, .name = "P", .element = value(model, "", point)});
  Value use = value(model, "p", alias);
  use.wire.length = FieldWidth::bits16;
  event(model, {use});
  EXPECT_EQ(lower(model).members[0].type, "test/msg/Point");
  EXPECT_EQ(payload_of(model, R"({"x": 5})"), "000105");
}

TEST(Lower, MakesConstantsOfEnumerations) {
  Model model;
  Type levels{.kind = Kind::enumeration, .name = "Level", .scope = "org.test", .primitive = Primitive::int16};
  levels.enumerators = {{.name = "veryLow", .value = -1}, {.name = "HIGH", .value = 3}};
  const TypeIndex level = model.add(levels);
  Type more{.kind = Kind::enumeration,
            .name = "More",
            .scope = "org.test",
            .primitive = Primitive::uint64,
            .base = level};
  more.enumerators = {{.name = "TOP", .value = -1}};
  const TypeIndex extended = model.add(more);
  event(model, {value(model, "level", level), value(model, "other", level), value(model, "more", extended)});
  EXPECT_EQ(text_of(lower(model), "test/msg/DoorChanged"),
            "int16 LEVEL_VERY_LOW=-1\nint16 LEVEL_HIGH=3\nuint64 MORE_VERY_LOW=18446744073709551615\nuint64 "
            "MORE_HIGH=3\nuint64 MORE_TOP=18446744073709551615\n"
            "int16 level  # trestle: enumeration Level\nint16 other  # trestle: enumeration Level\n"
            "uint64 more  # trestle: enumeration More\n");
  EXPECT_EQ(lower(model).sources.at("test/msg/DoorChanged.LEVEL_VERY_LOW"), "Level.veryLow");
  // Once for each enumeration, and not for names that stay.
  EXPECT_THAT(lines_of(lower(model).renamed),
              ::testing::ElementsAre(
                  "org.test.Level: names of enumerators, which as constants are in capitals: veryLow is "
                  "LEVEL_VERY_LOW",
                  "org.test.More: names of enumerators, which as constants are in capitals: veryLow is "
                  "MORE_VERY_LOW"));
  model.at(level).enumerators.clear();
  for (int i = 0; i < 25; ++i) {
    model.at(level).enumerators.push_back({.name = "n" + std::to_string(i), .value = i});
  }
  EXPECT_THAT(lines_of(lower(model).renamed)[0], ::testing::EndsWith("n19 is LEVEL_N19 and 5 more"));
}

TEST(Lower, TellsWhichConstantsGetOtherNames) {
  Model model;
  const TypeIndex number = model.add({.kind = Kind::primitive});
  model.constants = {{.name = "LIMIT", .type = number, .value = "1", .scope = "org.test"},
                     {.name = "e0", .type = number, .value = "2", .scope = "org.test", .place = {0, {3, 5}}}};
  const Lowered lowered = lower(model);
  EXPECT_THAT(lines_of(lowered.renamed),
              ::testing::ElementsAre("org.test: names of constants, which are in capitals: e0 is E0"));
  model.constants.pop_back();
  EXPECT_THAT(lower(model).renamed, IsEmpty());
}

TEST(Lower, FlattensInheritance) {
  Model model;
  const TypeIndex byte = number(model, Primitive::uint8);
  const TypeIndex base = structure(model, "Base", {value(model, "a", byte)});
  const TypeIndex derived = structure(model, "Derived", {value(model, "b", byte)});
  model.at(derived).base = base;
  event(model, {value(model, "d", derived)});
  EXPECT_EQ(text_of(lower(model), "test/msg/Derived"), "uint8 a\nuint8 b\n");
}

TEST(Lower, PutsAMessageBetweenArraysOfArrays) {
  Model model;
  Value inner = value(model, "", array_of(model, value(model, "", number(model, Primitive::uint16))));
  inner.wire.length = FieldWidth::bits8;
  event(model, {value(model, "rows", array_of(model, inner))});
  const Lowered lowered = lower(model);
  EXPECT_EQ(text_of(lowered, "test/msg/DoorChanged"), "DoorChangedRows[] rows  # trestle: array\n");
  EXPECT_EQ(text_of(lowered, "test/msg/DoorChangedRows"), "uint16[] elements\n");
  EXPECT_EQ(payload_of(model, R"({"rows": [{"elements": [1, 2]}, {"elements": []}]})"),
            "00000006"
            "0400010002"
            "00");
}

TEST(Lower, MakesPairsOfMaps) {
  Model model;
  Type map{.kind = Kind::map, .name = "Names", .scope = "org.test", .wire = default_wire(Kind::map)};
  map.key = value(model, "", number(model, Primitive::uint8));
  map.element = value(model, "", text(model));
  map.element.wire.bom = false;
  event(model, {value(model, "names", model.add(map))});
  const Lowered lowered = lower(model);
  EXPECT_EQ(text_of(lowered, "test/msg/NamesEntry"), "uint8 key\nstring value\n");
  EXPECT_EQ(payload_of(model, R"({"names": [{"key": 1, "value": "a"}]})"), "0000000701000000026100");
}

TEST(Lower, MakesChoicesOfOptionalFields) {
  Model model;
  const TypeIndex byte = number(model, Primitive::uint8);
  const TypeIndex choice =
      structure(model, "Shape",
                {value(model, "dot", byte), value(model, "line", array_of(model, value(model, "", byte)))});
  model.at(choice).kind = Kind::choice;
  model.at(choice).wire = default_wire(Kind::choice);
  model.at(choice).selectors = {5, 9};
  event(model, {value(model, "shape", choice)});
  EXPECT_EQ(text_of(lower(model), "test/msg/Shape"),
            "# trestle: union 5 9\n\nuint8[<=1] dot\nShapeLine[<=1] line  # trestle: array\n");
  EXPECT_EQ(payload_of(model, R"({"shape": {"line": [{"elements": [1, 2]}]}})"),
            "00000006"
            "00000009"
            "000000020102");
}

TEST(Lower, TagsMembers) {
  Model model;
  const TypeIndex byte = number(model, Primitive::uint8);
  Value optional = value(model, "speed", number(model, Primitive::uint16));
  optional.tag = someip::DataId{2};
  optional.optional = true;
  Value name = value(model, "name", text(model));
  name.tag = someip::DataId{3};
  Value always = value(model, "id", byte);
  always.tag = someip::DataId{1};
  const TypeIndex track = structure(model, "Track", {always, optional, name});
  event(model, {value(model, "track", track)});
  EXPECT_EQ(text_of(lower(model), "test/msg/Track"), "uint8 id\nuint16[<=1] speed\nstring name\n");
  EXPECT_EQ(payload_of(model, R"({"id": 7, "speed": [258], "name": ""})"),
            "000107"
            "10020102"
            "4003"
            "00000004efbbbf00");
  EXPECT_EQ(payload_of(model, R"({"id": 7, "name": ""})"),
            "000107"
            "4003"
            "00000004efbbbf00");
}

TEST(Lower, PacksBits) {
  Model model;
  Value a = value(model, "a", number(model, Primitive::uint8));
  a.wire.bits = 4;
  Value b = value(model, "b", number(model, Primitive::int8));
  b.wire.bits = 4;
  event(model, {a, b});
  EXPECT_EQ(payload_of(model, R"({"a": 10, "b": -1})"), "fa");
}

TEST(Lower, GivesEmptyStructuresNoBytes) {
  Model model;
  const TypeIndex none = structure(model, "None", {});
  event(model, {value(model, "none", none), value(model, "a", number(model, Primitive::uint8))});
  EXPECT_EQ(text_of(lower(model), "test/msg/None"), "");
  EXPECT_EQ(payload_of(model, R"({"a": 7})"), "07");
  Model nothing;
  event(nothing, {});
  EXPECT_EQ(payload_of(nothing, "{}"), "");
}

TEST(Lower, LetsOneTypeHaveOtherRulesElsewhere) {
  Model model;
  const TypeIndex words = text(model);
  const TypeIndex first = structure(model, "Part", {value(model, "a", words)});
  Value shorter = value(model, "a", words);
  shorter.wire.length = FieldWidth::bits8;
  const TypeIndex second = structure(model, "Part", {shorter});
  model.at(second).variant_of = first;
  Value third = value(model, "z", second);
  third.wire.length = FieldWidth::bits16;
  event(model, {value(model, "x", first), value(model, "y", second), third});
  const Lowered lowered = lower(model);
  EXPECT_EQ(text_of(lowered, "test/msg/DoorChanged"), "Part x\nPart y\nPart z\n");
  EXPECT_EQ(payload_of(model, R"({"x": {"a": ""}, "y": {"a": ""}, "z": {"a": ""}})"),
            "00000004efbbbf00"
            "04efbbbf00"
            "0005"
            "04efbbbf00");
}

TEST(Lower, NamesWhatCollides) {
  Model model;
  const TypeIndex byte = number(model, Primitive::uint8);
  structure(model, "Part", {value(model, "theName", byte), value(model, "the_name", byte)});
  const TypeIndex other = structure(model, "part", {value(model, "x", byte)});
  model.at(other).scope = "com.test";
  event(model, {value(model, "p", other)});
  const Lowered lowered = lower(model);
  EXPECT_EQ(text_of(lowered, "test/msg/Part"), "uint8 the_name\nuint8 the_name_2\n");
  EXPECT_EQ(lowered.members[0].type, "test/msg/Part2");
  EXPECT_EQ(lowered.sources.at("test/msg/Part2"), "com.test.part");
}

TEST(Lower, RefusesByName) {
  Model model;
  const TypeIndex bad = structure(model, "Animal", {});
  model.at(bad).polymorphic = true;
  event(model, {value(model, "animal", bad)});
  const TypeIndex heir = structure(model, "Dog", {});
  model.at(heir).base = bad;
  event(model, {value(model, "dog", heir)});
  const TypeIndex round = structure(model, "Round", {});
  model.at(round).members = {value(model, "round", round)};
  event(model, {value(model, "round", round)});
  const TypeIndex alias = model.add({.kind = Kind::alias, .name = "A"});
  model.at(alias).element = value(model, "", alias);
  event(model, {value(model, "a", alias)});
  event(model, {{.name = "missing"}});
  const Lowered lowered = lower(model);
  EXPECT_THAT(lowered.members, IsEmpty());
  const auto has = [&](const char* element, const char* what) {
    EXPECT_THAT(lowered.not_carried, Contains(testing::AllOf(Field(&NotCarried::element, element),
                                                             Field(&NotCarried::what, HasSubstr(what)))));
  };
  has("org.test.Animal", "polymorphic");
  has("org.test.Dog", "polymorphic");
  has("org.test.Round", "contains itself");
  has("org.test.Door.changed.a", "alias of itself");
  has("org.test.Door.changed.missing", "without a type");
}

/// What `trestle check` would refuse is in no route file that was generated.
TEST(Lower, LeavesOutWhatABridgeRefuses) {
  Model model;
  const TypeIndex odd = text(model);
  model.at(odd).wire.length = FieldWidth::none;
  model.at(odd).wire.fixed_bytes = 7;
  model.at(odd).wire.encoding = someip::StringEncoding::utf16le;
  event(model, {value(model, "name", odd)});
  const TypeIndex nothing = structure(model, "Nothing", {});
  std::vector<describe::Field>& fields = model.services[0].fields;
  fields.push_back({.name = "state", .payload = {.values = {value(model, "state", nothing)}}});
  // There is no service for a value without members; it can still be told.
  fields.push_back({.name = "told",
                    .payload = {.values = {value(model, "told", nothing)}},
                    .has_getter = false,
                    .has_setter = false});
  model.services[0].methods.push_back(
      {.name = "call", .request = {.values = {value(model, "name", odd)}}, .place = {.mark = {7, 3}}});
  const Lowered lowered = lower(model);
  ASSERT_EQ(lowered.members.size(), 1U);
  EXPECT_EQ(lowered.members[0].kind, LoweredMember::Kind::field);
  EXPECT_EQ(lowered.members[0].member, 1U);
  ASSERT_EQ(lowered.not_carried.size(), 3U);
  EXPECT_EQ(lowered.not_carried[0].element, "org.test.Door.changed");
  EXPECT_THAT(lowered.not_carried[0].what,
              HasSubstr("name is a string of 7 bytes: in UTF-16 they must be even"));
  EXPECT_EQ(lowered.not_carried[1].element, "org.test.Door.call");
  EXPECT_EQ(lowered.not_carried[1].place.mark.line, 7);
  EXPECT_EQ(lowered.not_carried[2].element, "org.test.Door.state");
  EXPECT_THAT(lowered.not_carried[2].what, HasSubstr("has no fields, so it cannot be the value of a field"));
}

/// A bridge would send such messages without it.
TEST(Lower, LeavesOutWhatHasACrc) {
  Model model;
  const TypeIndex speed = number(model, messages::Primitive::uint8);
  event(model, {value(model, "speed", speed)}).payload.crc_bytes = 4;
  std::vector<Method>& methods = model.services[0].methods;
  methods.push_back({.name = "ask", .request = {.crc_bytes = 1}});
  methods.push_back({.name = "tell", .response = {.crc_bytes = 1}});
  methods.push_back({.name = "plain"});
  model.services[0].fields.push_back(
      {.name = "level", .payload = {.values = {value(model, "level", speed)}, .crc_bytes = 4}});
  const Lowered lowered = lower(model);
  ASSERT_EQ(lowered.members.size(), 1U);
  EXPECT_EQ(lowered.members[0].kind, LoweredMember::Kind::method);
  EXPECT_EQ(lowered.members[0].member, 2U);
  std::vector<std::string> lost;
  for (const NotCarried& one : lowered.not_carried) {
    lost.push_back(one.element + ": " + one.what);
  }
  EXPECT_THAT(lost, testing::ElementsAre(
                        "org.test.Door.changed: a CRC of 4 bytes in the payload, which Trestle does not make",
                        "org.test.Door.ask: a CRC of 1 byte in the payload, which Trestle does not make",
                        "org.test.Door.tell: a CRC of 1 byte in the payload, which Trestle does not make",
                        "org.test.Door.level: a CRC of 4 bytes in the payload, which Trestle does not make"));
  EXPECT_NE(lowered.definition("test/srv/DoorAsk_Request"), nullptr);
}

TEST(Lower, MakesServicesOfMethods) {
  Model model;
  const TypeIndex byte = number(model, Primitive::uint8);
  Type failures{
      .kind = Kind::enumeration, .name = "Failure", .scope = "org.test", .primitive = Primitive::uint8};
  failures.enumerators = {{.name = "OK", .value = 0}, {.name = "STUCK", .value = 1}};
  const TypeIndex failure = model.add(failures);
  Method open{.name = "open", .id = someip::MethodId{7}};
  open.request.values = {value(model, "door", byte)};
  open.response.values = {value(model, "taken", number(model, Primitive::uint16))};
  open.error = failure;
  model.services.push_back({.name = "Door", .scope = "org.test", .id = someip::ServiceId{0x1234}});
  model.services[0].methods = {open, {.name = "close"}};
  const Lowered lowered = lower(model);
  ASSERT_EQ(lowered.members.size(), 2U);
  EXPECT_EQ(lowered.members[0].type, "test/srv/DoorOpen");
  EXPECT_EQ(srv_text(lowered, "test/srv/DoorOpen"),
            "uint8 door\n---\nuint8 FAILURE_OK=0\nuint8 FAILURE_STUCK=1\nuint8 error  # trestle: error "
            "Failure\nuint16 taken\n");
  EXPECT_EQ(srv_text(lowered, "test/srv/DoorClose"), "---\n");
  const auto source = std::make_shared<ModelSource>(lowered, "Door.fidl");
  auto library = messages::TypeLibrary::of({source});
  for (const LoweredMember& member : lowered.members) {
    const auto types = library.resolve_service(member.type);
    ASSERT_TRUE(types) << to_string(types.error());
    const auto plans = messages::compile_service(*types, member.rules);
    EXPECT_TRUE(plans) << plans.error();
  }
}

TEST(Lower, GivesTextsThatTheParsersRead) {
  Model model;
  const TypeIndex byte = number(model, Primitive::uint8);
  const TypeIndex header = structure(model, "Header", {value(model, "a", byte)});
  Value with_default = value(model, "b", byte);
  with_default.default_value = "7";
  model.constants.push_back({.name = "maxSpeed", .type = byte, .value = "5", .scope = "org.test.Door"});
  event(model, {value(model, "h", header), with_default,
                value(model, "t", array_of(model, value(model, "", text(model))))});
  const Lowered lowered = lower(model);
  EXPECT_EQ(text_of(lowered, "test/msg/DoorChanged"), "test/Header h\nuint8 b 7\nstring[] t\n");
  EXPECT_EQ(text_of(lowered, "door/msg/DoorConstants"), "uint8 MAX_SPEED=5\n");
  for (const auto& definition : lowered.definitions) {
    const auto name = messages::interface_name(definition.name);
    ASSERT_TRUE(name);
    const auto parsed = messages::parse_interface(msg_text(lowered, definition), *name, "x");
    ASSERT_TRUE(parsed) << to_string(parsed.error());
    ASSERT_EQ(parsed->front().fields.size(), definition.fields.size());
    for (std::size_t i = 0; i < definition.fields.size(); ++i) {
      EXPECT_EQ(parsed->front().fields[i].name, definition.fields[i].name);
      EXPECT_EQ(parsed->front().fields[i].type.message, definition.fields[i].type.message);
    }
  }
}

TEST(Raise, ComesBackAsTheSameDefinitions) {
  messages::TypeLibrary library;
  Model model;
  RaisedTypes types{model};
  std::map<std::string, messages::MessageDefinition> wanted;
  for (const std::string& name : messages::TypeLibrary::builtin_names()) {
    if (name.find("/msg/") == std::string::npos) {
      continue;
    }
    const auto tree = library.resolve(name);
    ASSERT_TRUE(tree);
    raise(types, *tree);
    for (const auto& definition : tree->messages) {
      wanted.emplace(definition.name, definition);
    }
  }
  const Lowered lowered = lower(model);
  EXPECT_THAT(lowered.not_carried, IsEmpty());
  EXPECT_EQ(lowered.definitions.size(), wanted.size());
  for (const auto& [name, definition] : wanted) {
    const auto* const again = lowered.definition(name);
    ASSERT_NE(again, nullptr) << name;
    EXPECT_EQ(msg_text(lowered, *again), msg_text(lowered, definition)) << name;
  }
}

TEST(Lower, WritesConstantsOfBothMessagesOnce) {
  Model model;
  Type side{.kind = Kind::enumeration, .name = "Side", .scope = "org.test", .primitive = Primitive::uint8};
  side.enumerators = {{.name = "LEFT", .value = 0}, {.name = "RIGHT", .value = 1}};
  const TypeIndex sides = model.add(side);
  side.name = "Speed";
  side.enumerators = {{.name = "SLOW", .value = 0}};
  Method turn{.name = "turn"};
  turn.request.values = {value(model, "to", sides)};
  turn.response.values = {value(model, "to", sides), value(model, "speed", model.add(side))};
  model.services.push_back({.name = "Door", .scope = "org.test"});
  model.services[0].methods = {turn};
  EXPECT_EQ(srv_text(lower(model), "test/srv/DoorTurn"),
            "uint8 SIDE_LEFT=0\nuint8 SIDE_RIGHT=1\nuint8 to  # trestle: enumeration Side\n---\n"
            "uint8 SPEED_SLOW=0\nuint8 to  # trestle: enumeration Side\nuint8 speed  # trestle: enumeration "
            "Speed\n");
}

/// What the files say that lower() makes.
messages::TypeLibrary library_of_texts(const Lowered& lowered) {
  messages::TypeLibrary library;
  for (const auto& definition : lowered.definitions) {
    const std::size_t part = definition.name.rfind("_Request");
    if (definition.name.find("/msg/") != std::string::npos) {
      library.define(*messages::interface_name(definition.name), msg_text(lowered, definition));
    } else if (part != std::string::npos) {
      const std::string service = definition.name.substr(0, part);
      library.define(*messages::interface_name(service), srv_text(lowered, service));
    }
  }
  return library;
}

TEST(Raise, MakesAgainWhatMarksSay) {
  Model model;
  const TypeIndex byte = number(model, Primitive::uint8);
  Type gear{.kind = Kind::enumeration, .name = "Gear", .scope = "org.test", .primitive = Primitive::uint16};
  gear.enumerators = {{.name = "PARK", .value = 0}, {.name = "DRIVE", .value = 3}};
  const TypeIndex gears = model.add(gear);
  Type box{.kind = Kind::enumeration, .name = "GearBox", .scope = "org.test", .primitive = Primitive::uint16};
  box.enumerators = {{.name = "OPEN", .value = 7}};
  const TypeIndex boxes = model.add(box);
  const TypeIndex image = model.add({.kind = Kind::bytes,
                                     .name = "Image",
                                     .scope = "org.test",
                                     .wire = default_wire(Kind::bytes),
                                     .max_size = 9});
  Type seats{.kind = Kind::map, .name = "Seats", .scope = "org.test", .wire = default_wire(Kind::map)};
  seats.key = value(model, "", gears);
  seats.element = value(model, "", text(model));
  const Value row = value(model, "", array_of(model, value(model, "", byte)));
  const TypeIndex all =
      structure(model, "All",
                {value(model, "gear", gears), value(model, "gears", array_of(model, value(model, "", gears))),
                 value(model, "box", boxes), value(model, "image", image),
                 value(model, "seats", model.add(seats)), value(model, "rows", array_of(model, row)),
                 value(model, "plain", array_of(model, value(model, "", byte)))});
  Type any{.kind = Kind::choice, .name = "Any", .scope = "org.test", .wire = default_wire(Kind::choice)};
  any.members = {value(model, "gears", array_of(model, value(model, "", gears))),
                 value(model, "small", byte)};
  const TypeIndex anys = model.add(any);
  model.constants.push_back({.name = "LIMIT", .type = byte, .value = "5", .scope = "org.test"});
  event(model, {value(model, "all", all), value(model, "any", anys)});

  const Lowered first = lower(model);
  Model again;
  auto library = library_of_texts(first);
  const auto tree = library.resolve("test/msg/DoorChanged");
  ASSERT_TRUE(tree) << to_string(tree.error());
  // That of a choice is in the rules.
  std::vector<std::string> without;
  ASSERT_FALSE(first.members.empty());
  RaisedTypes raised{again};
  ASSERT_FALSE(raise(raised, *tree, first.members[0].rules, "data", without).values.empty());
  EXPECT_THAT(without, IsEmpty());
  const auto type_of = [&](const std::string& name) -> const Type& {
    const auto found = std::ranges::find(again.types, name, &Type::name);
    EXPECT_NE(found, again.types.end()) << name;
    return found == again.types.end() ? again.types.front() : *found;
  };
  const auto member = [&](const std::string& type, const std::string& name) -> const Type& {
    const auto& members = type_of(type).members;
    const auto found = std::ranges::find(members, name, &Value::name);
    EXPECT_NE(found, members.end()) << name;
    return resolved(again, found->type);
  };
  EXPECT_EQ(type_of("Gear").kind, Kind::enumeration);
  ASSERT_EQ(type_of("Gear").enumerators.size(), 2U);
  EXPECT_EQ(type_of("Gear").enumerators[1].name, "DRIVE");
  EXPECT_EQ(type_of("Gear").enumerators[1].value, 3);
  EXPECT_EQ(type_of("Gear").primitive, Primitive::uint16);
  ASSERT_EQ(type_of("GearBox").enumerators.size(), 1U);
  EXPECT_EQ(member("All", "gear").name, "Gear");
  EXPECT_EQ(again.at(member("All", "gears").element.type).name, "Gear");
  EXPECT_EQ(member("All", "box").name, "GearBox");
  EXPECT_EQ(type_of("Image").kind, Kind::alias);
  EXPECT_EQ(member("All", "image").kind, Kind::bytes);
  EXPECT_EQ(member("All", "image").max_size, 9U);
  EXPECT_EQ(member("All", "seats").kind, Kind::map);
  EXPECT_EQ(member("All", "seats").name, "Seats");
  EXPECT_EQ(again.at(member("All", "seats").key.type).name, "Gear");
  EXPECT_EQ(member("All", "rows").kind, Kind::array);
  EXPECT_EQ(again.at(member("All", "rows").element.type).kind, Kind::array);
  EXPECT_EQ(member("All", "plain").kind, Kind::array);
  EXPECT_EQ(again.at(member("Any", "gears").element.type).name, "Gear");
  EXPECT_EQ(std::ranges::count(again.types, std::string{"Gear"}, &Type::name), 1);
  EXPECT_THAT(again.constants, IsEmpty());

  // And the same files are made of that.
  again.services.push_back({.name = "Door", .scope = "org.test"});
  const Lowered second = lower(again);
  EXPECT_THAT(second.not_carried, IsEmpty());
  for (const auto& definition : tree->messages) {
    const auto* const there = second.definition(definition.name);
    ASSERT_NE(there, nullptr) << definition.name;
    EXPECT_EQ(msg_text(second, *there), msg_text(first, *first.definition(definition.name)));
  }
}

TEST(Raise, FindsConstantsOfAResponseInTheRequest) {
  Model model;
  Type side{.kind = Kind::enumeration, .name = "Side", .scope = "org.test", .primitive = Primitive::uint8};
  side.enumerators = {{.name = "LEFT", .value = 0}, {.name = "RIGHT", .value = 1}};
  const TypeIndex sides = model.add(side);
  Method turn{.name = "turn"};
  turn.request.values = {value(model, "to", sides)};
  turn.response.values = {value(model, "reached", sides)};
  side.name = "Fault";
  side.enumerators = {{.name = "NONE", .value = 0}};
  turn.error = model.add(side);
  model.services.push_back({.name = "Door", .scope = "org.test"});
  model.services[0].methods = {turn};
  const Lowered lowered = lower(model);
  EXPECT_EQ(srv_text(lowered, "test/srv/DoorTurn"),
            "uint8 SIDE_LEFT=0\nuint8 SIDE_RIGHT=1\nuint8 to  # trestle: enumeration Side\n---\n"
            "uint8 FAULT_NONE=0\nuint8 error  # trestle: error Fault\nuint8 reached  # trestle: enumeration "
            "Side\n");
  auto library = library_of_texts(lowered);
  const auto types = library.resolve_service("test/srv/DoorTurn");
  ASSERT_TRUE(types) << to_string(types.error());
  Model again;
  RaisedTypes raised{again};
  const Method method = raise(raised, *types, "turn");
  const Type& request = again.at(method.request.values.at(0).type);
  const Type& response = again.at(method.response.values.at(0).type);
  EXPECT_EQ(again.at(request.members.at(0).type).name, "Side");
  EXPECT_EQ(response.members.at(1).type, request.members.at(0).type);
  EXPECT_EQ(again.at(response.members.at(0).type).name, "Fault");
}

TEST(Raise, TakesMarksThatDoNotFitForComments) {
  messages::TypeLibrary library;
  library.define(*messages::interface_name("a/msg/B"), "uint8 key\n");
  library.define(*messages::interface_name("a/msg/A"),
                 "string text  # trestle: enumeration Text\nbool[] flags  # trestle: bytes\n"
                 "B[] bs  # trestle: map\nB b  # trestle: array\nuint8 x  # trestle: nonsense\n");
  const auto tree = library.resolve("a/msg/A");
  ASSERT_TRUE(tree) << to_string(tree.error());
  Model model;
  RaisedTypes types{model};
  const Type& type = model.at(raise(types, *tree));
  EXPECT_EQ(model.at(type.members.at(0).type).kind, Kind::string);
  EXPECT_EQ(model.at(type.members.at(1).type).kind, Kind::array);
  EXPECT_EQ(model.at(type.members.at(2).type).kind, Kind::array);
  EXPECT_EQ(model.at(type.members.at(3).type).kind, Kind::structure);
  EXPECT_EQ(model.at(type.members.at(4).type).kind, Kind::primitive);
}

TEST(Raise, KeepsTheBytesOfTheSpecification) {
  messages::TypeLibrary library;
  for (const char* const name :
       {"sensor_msgs/msg/PointCloud2", "std_msgs/msg/Empty", "sensor_msgs/msg/NavSatFix"}) {
    Model model;
    RaisedTypes types{model};
    event(model, {value_of(model, raise(types, *library.resolve(name)), "value")})
        .payload.length_fields_always_big = true;
    const Lowered lowered = lower(model);
    ASSERT_EQ(lowered.members.size(), 1U);
    EXPECT_EQ(lowered.members[0].type, name);
    EXPECT_EQ(lowered.members[0].rules, messages::MessageRules{}) << name;
  }
}

TEST(Raise, ComparesATypeWithFewOthers) {
  messages::TypeLibrary library;
  constexpr std::size_t messages = 5000;
  for (std::size_t i = 0; i < messages; ++i) {
    const std::string number = std::to_string(i);
    library.define(*messages::interface_name("a/msg/M" + number),
                   "uint32 MODE_ON=" + number + "\nuint32 mode  # trestle: enumeration Mode\nfloat64[<=" +
                       std::to_string(i + 1) + "] list\n");
  }
  Model model;
  RaisedTypes types{model};
  for (std::size_t i = 0; i < messages; ++i) {
    const auto tree = library.resolve("a/msg/M" + std::to_string(i));
    ASSERT_TRUE(tree) << to_string(tree.error());
    raise(types, *tree);
  }
  // A structure, an enumeration and an array each, and one number.
  ASSERT_EQ(model.types.size(), 3 * messages + 1);
  EXPECT_EQ(model.types.back().ros_name, "a/msg/M4999");
  const auto last = std::ranges::find(model.types, "Mode5000", &Type::name);
  ASSERT_NE(last, model.types.end());
  EXPECT_EQ(last->enumerators.at(0).value, 4999);
  EXPECT_LE(types.comparisons(), 4 * messages);
}

TEST(Lower, ShortensNamesThatNoFileCanHave) {
  Model model;
  const std::string longer(260, 'a');
  const TypeIndex byte = number(model, Primitive::uint8);
  for (const char* end : {"x", "y"}) {
    const TypeIndex type =
        structure(model, "State" + longer + end, {value(model, std::string{"of"} + end, byte)});
    event(model, {value(model, "state", type)}).name = "moved" + longer + end;
    event(model, {value(model, "state", type), value(model, "again", byte)}).name = "both" + longer + end;
    model.services[0].methods.push_back({.name = "open" + longer + end, .id = someip::MethodId{1}});
  }
  const Lowered lowered = lower(model);
  ASSERT_EQ(lowered.members.size(), 6U);
  std::set<std::string> names;
  for (const messages::MessageDefinition& one : lowered.definitions) {
    EXPECT_LE(one.name.size(), std::string{"test/msg/"}.size() + 128 + std::string{"_Response"}.size());
    names.insert(one.name);
  }
  EXPECT_EQ(names.size(), 2U + 2U + 4U);
  // A name that ends with a checksum: the same at each time.
  const std::string first = "State" + std::string(114, 'a') + "H";
  EXPECT_EQ(lowered.members[0].type.substr(0, 9 + first.size()), "test/msg/" + first);
  EXPECT_EQ(lowered.members[0].type.size(), 9U + 128U);
  EXPECT_NE(lowered.definition(lowered.members[4].type + "_Request"), nullptr);
  EXPECT_EQ(lowered.sources.at(lowered.members[0].type), "org.test.State" + longer + "x");
  std::size_t told = 0;
  for (const NotCarried& one : lowered.not_carried) {
    told += one.what.starts_with("its whole name, which is too long for a file: ") ? 1U : 0U;
  }
  EXPECT_EQ(told, 2U + 2U + 2U + 2U);  // of types, of events (also where it is not needed), of methods
}

TEST(Lower, ShortensThePackageOfALongScope) {
  Model model;
  const TypeIndex byte = number(model, Primitive::uint8);
  event(model, {value(model, "a", byte)});
  model.services[0].scope = "org." + std::string(300, 'b');
  const Lowered lowered = lower(model);
  ASSERT_EQ(lowered.members.size(), 1U);
  EXPECT_EQ(lowered.members[0].type.find('/'), 128U);
  EXPECT_TRUE(messages::interface_name(lowered.members[0].type)) << lowered.members[0].type;
  ASSERT_EQ(lowered.not_carried.size(), 1U);
  EXPECT_EQ(lowered.not_carried[0].element, model.services[0].scope);
}

TEST(Lower, LeavesOutEnumeratorsThatHaveNoRoom) {
  Model model;
  const TypeIndex level = model.add({.kind = Kind::enumeration,
                                     .name = "Level",
                                     .scope = "org.test",
                                     .primitive = Primitive::int8,
                                     .enumerators = {{"low", -128}, {"high", 128, {}, {.mark = {4, 2}}}}});
  event(model, {value(model, "level", level)});
  const Lowered lowered = lower(model);
  ASSERT_EQ(lowered.members.size(), 1U);
  EXPECT_THAT(text_of(lowered, lowered.members[0].type), HasSubstr("int8 LEVEL_LOW=-128\n"));
  EXPECT_THAT(lines_of(lowered.not_carried),
              testing::ElementsAre("org.test.Level.high: its value 128, which int8 has no room for"));
  EXPECT_EQ(lowered.not_carried[0].place.mark.line, 4);
}

TEST(Lower, TellsWhereAnEventStandsThatItCannotCarry) {
  Model model;
  event(model, {});
  model.services[0].events[0].payload.known = false;
  model.services[0].events[0].place = {.mark = {5, 7}};
  const Lowered lowered = lower(model);
  ASSERT_EQ(lowered.not_carried.size(), 1U);
  EXPECT_EQ(lowered.not_carried[0].what, "what it carries is not known");
  EXPECT_EQ(lowered.not_carried[0].place.mark.line, 5);
}

TEST(Raise, KeepsServices) {
  messages::TypeLibrary library;
  Model model;
  const auto types = library.resolve_service("std_srvs/srv/SetBool");
  ASSERT_TRUE(types);
  model.services.push_back({.name = "Door"});
  RaisedTypes raised{model};
  model.services[0].methods.push_back(raise(raised, *types, "set"));
  const auto trigger = library.resolve_service("std_srvs/srv/Trigger");
  ASSERT_TRUE(trigger);
  model.services[0].methods.push_back(raise(raised, *trigger, "trigger"));
  const Lowered lowered = lower(model);
  ASSERT_EQ(lowered.members.size(), 2U);
  EXPECT_EQ(lowered.members[0].type, "std_srvs/srv/SetBool");
  EXPECT_EQ(srv_text(lowered, "std_srvs/srv/SetBool"), "bool data\n---\nbool success\nstring message\n");
  EXPECT_EQ(lowered.members[1].type, "std_srvs/srv/Trigger");
}

}  // namespace
}  // namespace trestle::describe::lower_test
