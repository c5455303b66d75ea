#include "bridge/describe/interfaces.hpp"

#include <gmock/gmock.h>

#include "bridge/describe/eventgroup_title.hpp"
#include "bridge/describe/read/fidl/read_fidl.hpp"
#include "test/bridge/describe/lowered.hpp"

namespace trestle::describe {
namespace {

using messages::ValueForm;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr const char* fidl = R"(package car
interface Door {
  version { major 3 minor 7 }
  attribute UInt8 opening readonly
  attribute Level locked
  method open {
    in { Level speed UInt8 opening }
    out { Boolean done }
    error { OK BLOCKED }
  }
  method put { in { Everything all } }
  method wash fireAndForget { }
  broadcast moved { out { Place whereTo } }
  enumeration Level { LOW = 1 veryHigh = 200 }
  struct Place { Double x Level level }
  union Shape { Place place String name UInt8[] raw }
  map Wheels { String to Level }
  array Row of UInt8
  struct Everything {
    Shape aShape
    Shape[] shapes
    Wheels wheels
    Row[] grid
    Level[] levels
    ByteBuffer blob
    String text
    UInt8 few
    Level some
    Int64 wide
  }
}
)";
constexpr const char* fdepl = R"(
import "platform:/plugin/org.genivi.commonapi.someip/deployment/CommonAPI-4-SOMEIP_deployment_spec.fdepl"
import "Door.fidl"
define org.genivi.commonapi.someip.deployment for interface car.Door {
  SomeIpServiceID = 0x4711
  SomeIpEventGroups = { 1, 2 }
  attribute opening { SomeIpGetterID = 1 SomeIpSetterID = 0 SomeIpNotifierID = 0x8001 SomeIpNotifierEventGroups = { 1 } }
  attribute locked { SomeIpGetterID = 4 SomeIpSetterID = 5 SomeIpNotifierID = 0x8003 SomeIpNotifierEventGroups = { 1 } }
  method open { SomeIpMethodID = 0x10 }
  method put { SomeIpMethodID = 0x11 }
  method wash { SomeIpMethodID = 0x12 }
  broadcast moved { SomeIpEventID = 0x8010 SomeIpEventGroups = { 2 } }
  struct Everything {
    text { SomeIpStringEncoding = utf16be }
    few { SomeIpIntegerBitWidth = 3 }
    some { SomeIpEnumBitWidth = 5 }
  }
}
define org.genivi.commonapi.someip.deployment for provider as Car {
  instance car.Door { InstanceId = "car.Door" SomeIpInstanceID = 1 SomeIpUnreliableUnicastPort = 30711 }
}
)";

Interfaces of_model(Model model) {
  IdLock lock;
  System system = make_system({.model = std::move(model)}, lock);
  EXPECT_TRUE(system.good);
  return Interfaces{std::move(system)};
}

const Interfaces& door() {
  static const Interfaces made = [] {
    const std::vector<SourceText> sources{{"Door.fidl", fidl}, {"Door.fdepl", fdepl}};
    Reading reading = read_fidl(sources, [](const std::string&) -> tl::expected<std::string, std::string> {
      return tl::unexpected{std::string{"there is no such file"}};
    });
    for (const documents::Problem& problem : reading.problems) {
      ADD_FAILURE() << to_string(problem);
    }
    return of_model(std::move(reading.model));
  }();
  return made;
}

std::vector<std::string> names_of(const std::vector<const ServiceElement*>& elements) {
  std::vector<std::string> names;
  for (const ServiceElement* element : elements) {
    names.push_back(element->name);
  }
  return names;
}

std::vector<std::string> found(std::string_view text) {
  const auto meaning = door().find(text);
  return meaning ? names_of(meaning->elements) : std::vector{meaning.error()};
}

const ServiceElement& only(std::string_view text) {
  return *door().find(text)->elements.at(0);
}

std::string hex(ByteView bytes) {
  std::string text;
  for (const std::byte byte : bytes) {
    text += "0123456789abcdef"[std::to_integer<unsigned>(byte >> 4U)];
    text += "0123456789abcdef"[std::to_integer<unsigned>(byte & std::byte{15})];
  }
  return text;
}

std::string bytes_of(const Content& content, std::string_view text) {
  const auto bytes = content.values->parse(text, ValueForm::yaml);
  return bytes ? hex(*bytes) : to_string(bytes.error());
}

std::string json_of(const Content& content, const std::vector<std::byte>& bytes) {
  const auto text = content.values->print(bytes, ValueForm::json);
  return text ? *text : text.error();
}

TEST(Interfaces, FindsWhatNamesMean) {
  EXPECT_THAT(found("Door"), IsEmpty());
  EXPECT_THAT(found("car.Door"), IsEmpty());
  EXPECT_THAT(found("Door.moved"), ElementsAre("Door.moved"));
  EXPECT_THAT(found("car.Door.open"), ElementsAre("Door.open"));
  EXPECT_THAT(found("Door.locked"), ElementsAre("Door.locked.get", "Door.locked.set", "Door.locked.notify"));
  EXPECT_THAT(found("Door.locked.set"), ElementsAre("Door.locked.set"));
  EXPECT_THAT(found("Door.opening"), ElementsAre("Door.opening.get", "Door.opening.notify"));  // readonly
  EXPECT_EQ(door().find("Door")->instance, std::nullopt);
  EXPECT_EQ(door().find("Door.0x0002")->instance, someip::InstanceId{2});
  EXPECT_EQ(door().find("car.Door.7.moved")->instance, someip::InstanceId{7});
  EXPECT_THAT(found("Door.7.moved"), ElementsAre("Door.moved"));
}

TEST(Interfaces, SaysWhatANameMayHaveMeant) {
  EXPECT_THAT(found("Dor"),
              ElementsAre("the interfaces have no service 'Dor'; did you mean 'Door'?; there is: Door"));
  EXPECT_THAT(found("Door.moveed"),
              ElementsAre("Door has no 'moveed'; did you mean 'moved'?; there are: moved, open, put, wash, "
                          "opening, locked"));
  EXPECT_THAT(found("Door.opening.set"), ElementsAre(HasSubstr("Door has no 'opening.set'")));
  EXPECT_THAT(found("Window"), ElementsAre("the interfaces have no service 'Window'; there is: Door"));
  EXPECT_THAT(found(""), ElementsAre(HasSubstr("no service ''")));
}

TEST(Interfaces, FindsByIds) {
  ASSERT_NE(door().service(someip::ServiceId{0x4711}), nullptr);
  EXPECT_EQ(door().service(someip::ServiceId{0x4712}), nullptr);
  const auto name = [](std::uint16_t id) {
    const ServiceElement* const element = door().element(someip::ServiceId{0x4711}, 3, someip::MethodId{id});
    return element == nullptr ? "" : element->name;
  };
  EXPECT_EQ(name(0x10), "Door.open");
  EXPECT_EQ(name(0x05), "Door.locked.set");
  EXPECT_EQ(name(0x8001), "Door.opening.notify");
  EXPECT_EQ(name(0x99), "");
  EXPECT_EQ(door().name_of(someip::ServiceId{0x4711}), "Door");
  EXPECT_EQ(door().name_of(someip::ServiceId{0x4712}), "0x4712");
  EXPECT_THAT(door().instances_of(0), SizeIs(1));
}

TEST(Interfaces, NeedsTheFullNameWhereServicesShareOne) {
  Model model;
  model.services.push_back({.name = "Door", .scope = "a", .id = someip::ServiceId{1}});
  model.services.push_back({.name = "Door", .scope = "b", .id = someip::ServiceId{2}});
  model.services.push_back({.name = "Door", .scope = "/Services", .id = someip::ServiceId{3}});
  const Interfaces interfaces = of_model(std::move(model));
  EXPECT_THAT(interfaces.find("Door").error(), HasSubstr("there are a.Door and b.Door: write the full name"));
  EXPECT_EQ(interfaces.find("b.Door")->service, 1U);
  EXPECT_EQ(interfaces.find("/Services/Door")->service, 2U);
  EXPECT_EQ(interfaces.name_of(someip::ServiceId{2}), "b.Door");
}

TEST(Interfaces, TakesANameWithoutSelectorWhereOnlyOneHasIt) {
  Model model;
  Service service{.name = "Lamp", .scope = "a", .id = someip::ServiceId{1}};
  service.methods = {{.name = "dim", .id = someip::MethodId{1}, .selector = "slowly"},
                     {.name = "flash", .id = someip::MethodId{2}, .selector = "once"},
                     {.name = "flash", .id = someip::MethodId{3}, .selector = "twice"}};
  model.services.push_back(service);
  service.scope = "a.Lamp";
  model.services.push_back(service);
  const Interfaces interfaces = of_model(std::move(model));
  ASSERT_TRUE(interfaces.find("a.Lamp.dim")) << interfaces.find("a.Lamp.dim").error();
  EXPECT_EQ(interfaces.find("a.Lamp.dim")->service, 0U);
  EXPECT_EQ(interfaces.find("a.Lamp.Lamp.*.dim:slowly")->service, 1U);
  EXPECT_THAT(interfaces.find("a.Lamp.flash").error(), HasSubstr("has no 'flash'"));
  // Parts of a method are for `explain` alone.
  EXPECT_FALSE(interfaces.find("a.Lamp.dim:slowly.response"));
}

TEST(Interfaces, TellsVersionsOfAServiceApart) {
  Model model;
  for (const std::uint8_t major : {std::uint8_t{1}, std::uint8_t{2}}) {
    Service service{.name = major == 1 ? "Old" : "New", .id = someip::ServiceId{1}, .major = major};
    service.events.push_back({.name = "moved", .id = someip::MethodId{0x8001}});
    model.services.push_back(std::move(service));
  }
  const Interfaces interfaces = of_model(std::move(model));
  EXPECT_EQ(interfaces.element(someip::ServiceId{1}, 1, someip::MethodId{0x8001})->name, "Old.moved");
  EXPECT_EQ(interfaces.element(someip::ServiceId{1}, 2, someip::MethodId{0x8001})->name, "New.moved");
  EXPECT_EQ(interfaces.name_of(someip::ServiceId{1}, std::uint8_t{2}), "New");
}

TEST(Interfaces, HasArgumentsByName) {
  const Content& request = door().content(only("Door.open"));
  EXPECT_EQ(bytes_of(request, "{speed: veryHigh, opening: 80}"), "c850");
  EXPECT_EQ(bytes_of(request, "{speed: 200, opening: 80}"), "c850");
  EXPECT_EQ(json_of(request, {std::byte{0xc8}, std::byte{80}}), R"({"speed":"veryHigh","opening":80})");
  EXPECT_EQ(json_of(request, {std::byte{7}, std::byte{80}}), R"({"speed":7,"opening":80})");  // no name
  EXPECT_THAT(bytes_of(request, "{sped: LOW}"),
              HasSubstr("'sped' is no field of Door.open; expected speed, opening"));
  EXPECT_EQ(bytes_of(request, "{speed: veryHihg}"),
            "1:9: speed: expected one of LOW (1), veryHigh (200), found 'veryHihg'; did you mean veryHigh?");
  EXPECT_THAT(json_of(request, {std::byte{1}}), HasSubstr("not a Door.open: truncated at byte 1 in opening"));
}

TEST(Interfaces, HasTheErrorOfAMethodInItsAnswer) {
  const Content& answer = door().answer(only("Door.open"));
  EXPECT_EQ(json_of(answer, {std::byte{1}, std::byte{0}}), R"({"error":"BLOCKED","done":false})");
  EXPECT_EQ(bytes_of(answer, "{error: BLOCKED}"), "0100");
}

TEST(Interfaces, TakesASingleValueWithAndWithoutItsName) {
  const Content& level = door().content(only("Door.locked.set"));
  EXPECT_EQ(bytes_of(level, "veryHigh"), "c8");
  EXPECT_EQ(bytes_of(level, "{locked: veryHigh}"), "c8");
  EXPECT_EQ(json_of(level, {std::byte{1}}), R"({"locked":"LOW"})");
  EXPECT_TRUE(door().content(only("Door.locked.get")).is_empty);
  EXPECT_EQ(json_of(door().answer(only("Door.locked.get")), {std::byte{1}}), R"({"locked":"LOW"})");
  // A structure is the payload itself.
  const Content& moved = door().content(only("Door.moved"));
  const char* const bytes = "3ff8000000000000c8";
  EXPECT_EQ(bytes_of(moved, "{whereTo: {x: 1.5, level: veryHigh}}"), bytes);
  EXPECT_EQ(bytes_of(moved, "{x: 1.5, level: veryHigh}"), bytes);
  EXPECT_EQ(json_of(moved, *moved.values->parse("{x: 1.5}", ValueForm::yaml)),
            R"({"whereTo":{"x":1.5,"level":"LOW"}})");  // zero would be none of the enumerators
  EXPECT_THAT(json_of(moved, {std::byte{1}}), HasSubstr("truncated at byte 0 in whereTo.x"));
}

constexpr const char* everything = R"(all:
  aShape:
    place:
      x: 1.5
      level: LOW
  shapes:
  - name: abc
  - raw: [1, 2]
  - place:
      x: 0.0
      level: veryHigh
  wheels:
  - key: left
    value: veryHigh
  grid:
  - [1, 2]
  - []
  levels: [LOW, veryHigh, 7]
  blob: "hex:00ff"
  text: hello
  few: 5
  some: LOW
  wide: -3
)";

TEST(Interfaces, ReadsAndPrintsEveryKindOfType) {
  const Content& content = door().content(only("Door.put"));
  const auto bytes = content.values->parse(everything, ValueForm::yaml);
  ASSERT_TRUE(bytes) << to_string(bytes.error());
  EXPECT_EQ(content.values->print(*bytes, ValueForm::yaml), std::string{everything});
  const auto json = content.values->print(*bytes, ValueForm::json);
  EXPECT_EQ(*json,
            R"({"all":{"aShape":{"place":{"x":1.5,"level":"LOW"}},"shapes":[{"name":"abc"},{"raw":[1,2]},)"
            R"({"place":{"x":0.0,"level":"veryHigh"}}],"wheels":[{"key":"left","value":"veryHigh"}],)"
            R"("grid":[[1,2],[]],"levels":["LOW","veryHigh",7],"blob":"hex:00ff","text":"hello","few":5,)"
            R"("some":"LOW","wide":-3}})");
  EXPECT_EQ(hex(*content.values->parse(*json, ValueForm::json)), hex(*bytes));
}

TEST(Interfaces, WritesTheBytesOfTheDeployment) {
  const Content& content = door().content(only("Door.put"));
  EXPECT_EQ(bytes_of(content,
                     "{aShape: {raw: [7]}, wheels: {a: LOW}, grid: [[1, 2]], blob: \"hex:0a\", text: A, "
                     "few: 5, some: LOW, wide: 1}"),
            "00000005"
            "00000003"
            "00000001"
            "07"        // the union's third member, an array of one byte
            "00000000"  // shapes
            "0000000a"  // a map of 10 bytes
            "00000005"
            "efbbbf6100"
            "01"
            "00000006"  // an array of arrays
            "00000002"
            "0102"
            "00000000"  // levels
            "00000001"
            "0a"
            "00000006"  // UTF-16 with BOM and terminator
            "feff00410000"
            "0d"  // 3 bits of 5, and 5 bits of LOW
            "0000000000000001");
}

TEST(Interfaces, RefusesAChoiceThatIsNoneOrSeveral) {
  const Content& content = door().content(only("Door.put"));
  EXPECT_THAT(bytes_of(content, "{}"),
              HasSubstr("all.aShape: expected exactly one of place, name, raw, found none"));
  EXPECT_THAT(bytes_of(content, "{aShape: {name: a, raw: []}}"),
              HasSubstr("1:10: all.aShape: expected exactly one of place, name, raw, found 2"));
  EXPECT_THAT(bytes_of(content, "{aShape: {circle: 1}}"),
              HasSubstr("'circle' is no field of door/msg/Shape"));
}

TEST(Interfaces, NamesTheFieldThatAPayloadHasNot) {
  const Content& content = door().content(only("Door.put"));
  auto bytes = *content.values->parse(everything, ValueForm::yaml);
  bytes.resize(30);
  const auto fault = content.values->fault_of(bytes);
  ASSERT_TRUE(fault);
  EXPECT_EQ(fault->field, "all.shapes");
  EXPECT_EQ(fault->offset, 17U);
  bytes[7] = std::byte{9};  // a selector that names none
  EXPECT_EQ(content.values->fault_of(bytes)->field, "all.aShape");
}

TEST(Interfaces, LeavesOutOptionalMembersThatAreMissing) {
  Model model;
  const TypeIndex number = lowered::number(model, messages::Primitive::uint8);
  Value need = lowered::value(model, "need", number);
  need.tag = someip::DataId{1};
  Value maybe = lowered::value(model, "mayBe", number);
  maybe.tag = someip::DataId{2};
  maybe.optional = true;
  Event& event = lowered::event(model, {need, maybe});
  event.eventgroups = {someip::EventgroupId{1}};
  const Interfaces interfaces = of_model(std::move(model));
  const Content& content = interfaces.content(*interfaces.find("Door.changed")->elements.at(0));
  ASSERT_TRUE(content.values) << content.unknown;
  EXPECT_EQ(bytes_of(content, "{need: 5}"), "000105");
  EXPECT_EQ(bytes_of(content, "{need: 5, mayBe: null}"), "000105");
  EXPECT_EQ(bytes_of(content, "{need: 5, mayBe: 6}"), "000105000206");
  EXPECT_EQ(json_of(content, {std::byte{0}, std::byte{1}, std::byte{5}}), R"({"need":5})");
  EXPECT_EQ(
      json_of(content, {std::byte{0}, std::byte{1}, std::byte{5}, std::byte{0}, std::byte{2}, std::byte{6}}),
      R"({"need":5,"mayBe":6})");
}

TEST(Interfaces, QuotesNamesThatYamlWouldTakeForSomethingElse) {
  Model model;
  const TypeIndex number = lowered::number(model, messages::Primitive::uint8);
  lowered::event(model, {lowered::value(model, "a: b", number), lowered::value(model, "# c", number)});
  const Interfaces interfaces = of_model(std::move(model));
  const Content& content = interfaces.content(*interfaces.find("Door.changed")->elements.at(0));
  ASSERT_TRUE(content.values) << content.unknown;
  EXPECT_EQ(content.values->print(std::vector<std::byte>{std::byte{1}, std::byte{2}}, ValueForm::yaml),
            std::string{"\"a: b\": 1\n\"# c\": 2\n"});
}

TEST(Interfaces, PrintsAMessageOfWhichNothingIsThere) {
  Model model;
  const TypeIndex number = lowered::number(model, messages::Primitive::uint8);
  Value maybe = lowered::value(model, "mayBe", number);
  maybe.tag = someip::DataId{2};
  maybe.optional = true;
  lowered::event(model, {maybe});
  const Interfaces interfaces = of_model(std::move(model));
  const Content& content = interfaces.content(*interfaces.find("Door.changed")->elements.at(0));
  ASSERT_TRUE(content.values) << content.unknown;
  EXPECT_EQ(content.values->print({}, ValueForm::yaml), std::string{"{}\n"});
  EXPECT_EQ(content.values->print({}, ValueForm::json), std::string{"{}"});
}

TEST(Interfaces, KnowsNoValuesWhereTheDescriptionHasNoTypes) {
  Model model;
  lowered::event(model, {});
  const Interfaces interfaces = of_model(std::move(model));
  const Content& content = interfaces.content(*interfaces.find("Door.changed")->elements.at(0));
  EXPECT_FALSE(content.values);
  EXPECT_FALSE(content.is_empty);
  EXPECT_EQ(content.unknown, "the description has no types");
}

/// Also where nothing but the CRC is sent.
TEST(Interfaces, HasNoValuesOfAPayloadWithACrc) {
  Model model;
  const TypeIndex number = lowered::number(model, messages::Primitive::uint8);
  lowered::event(model, {lowered::value(model, "a", number)}).payload.crc_bytes = 4;
  model.services[0].methods.push_back(
      {.name = "ask", .id = someip::MethodId{1}, .request = {.crc_bytes = 1}});
  model.services[0].fields.push_back(
      {.name = "level",
       .payload = {.values = {lowered::value(model, "level", number)}, .crc_bytes = 4},
       .getter = someip::MethodId{2},
       .setter = someip::MethodId{3},
       .has_notifier = false});
  const Interfaces interfaces = of_model(std::move(model));
  const auto element = [&](const char* name) -> const ServiceElement& {
    return *interfaces.find(name)->elements.at(0);
  };
  constexpr const char* four = "a CRC of 4 bytes in the payload, which Trestle does not make";
  for (const auto& [name, content, unknown] :
       {std::tuple{"event", interfaces.content(element("Door.changed")), four},
        {"method", interfaces.content(element("Door.ask")),
         "a CRC of 1 byte in the payload, which Trestle does not make"},
        {"setter", interfaces.content(element("Door.level.set")), four},
        {"answer of getter", interfaces.answer(element("Door.level.get")), four}}) {
    EXPECT_FALSE(content.values) << name;
    EXPECT_FALSE(content.is_empty) << name;
    EXPECT_TRUE(content.has_crc) << name;
    EXPECT_EQ(content.unknown, unknown);
  }
  EXPECT_TRUE(interfaces.content(element("Door.level.get")).is_empty);
  EXPECT_FALSE(interfaces.content(element("Door.level.get")).has_crc);
}

TEST(Interfaces, SkipsTheHeaderOfE2eProtection) {
  Model model;
  const TypeIndex number = lowered::number(model, messages::Primitive::uint8);
  Event& event =
      lowered::event(model, {lowered::value(model, "a", number), lowered::value(model, "b", number)});
  event.e2e = {.profile = "5", .numbers = {{"offset_bits", 72}}};
  const Interfaces interfaces = of_model(std::move(model));
  const Content& content = interfaces.content(*interfaces.find("Door.changed")->elements.at(0));
  EXPECT_EQ(content.e2e.at, 1U);
  EXPECT_EQ(content.e2e.bytes, 3U);
  const std::vector<std::byte> payload{std::byte{1}, std::byte{0xaa}, std::byte{0xbb}, std::byte{0xcc},
                                       std::byte{2}};
  std::vector<std::byte> header;
  EXPECT_EQ(hex(content.without_header(payload, &header)), "0102");
  EXPECT_EQ(hex(header), "aabbcc");
  EXPECT_EQ(hex(content.without_header(ByteView{payload}.first(3), &header)), "01aabb");
}

TEST(Interfaces, HaveTheProtectionOfAnInstance) {
  const auto with = [](const Protection& its) {
    Model model;
    const TypeIndex number = lowered::number(model, messages::Primitive::uint8);
    Event& event = lowered::event(model, {lowered::value(model, "a", number)});
    event.e2e = {.profile = "4", .numbers = {{"data_id", 1}}};
    event.e2e.set(someip::InstanceId{2}, its);
    return of_model(std::move(model));
  };
  const Interfaces interfaces = with({.profile = "4", .numbers = {{"data_id", 2}}});
  const ServiceElement& changed = *interfaces.find("Door.changed")->elements.at(0);
  EXPECT_EQ(interfaces.protection(changed, someip::InstanceId{1})->numbers.at("data_id"), 1U);
  EXPECT_EQ(interfaces.protection(changed, someip::InstanceId{2})->numbers.at("data_id"), 2U);
  EXPECT_EQ(interfaces.content(changed).e2e.bytes, 12U);
  // A message does not say of which instance it is: then nobody knows where the values are.
  const Interfaces none = with({});
  const ServiceElement& open = *none.find("Door.changed")->elements.at(0);
  EXPECT_EQ(none.protection(open, someip::InstanceId{2}), nullptr);
  EXPECT_EQ(none.content(open).unknown,
            "E2E protection that is not the same in all instances: in instance 0x0002 none");
}

TEST(ProtectionHeader, StandsWhereTheProfileSays) {
  const auto at = [](const Protection& e2e) {
    const auto header = protection_header(e2e);
    return header ? std::pair{header->at, header->bytes} : std::pair{std::size_t{99}, std::size_t{99}};
  };
  EXPECT_EQ(at({}), (std::pair<std::size_t, std::size_t>{0, 0}));
  EXPECT_EQ(at({.profile = "4"}), (std::pair<std::size_t, std::size_t>{0, 12}));
  EXPECT_EQ(at({.profile = "7m"}), (std::pair<std::size_t, std::size_t>{0, 24}));
  EXPECT_EQ(at({.profile = "1",
                .numbers = {{"crc_offset_bits", 8}, {"counter_offset_bits", 16}},
                .words = {{"payload_only", "true"}}}),
            (std::pair<std::size_t, std::size_t>{1, 2}));
  EXPECT_EQ(at({.profile = "4", .numbers = {{"offset_bits", 8}}}),
            (std::pair<std::size_t, std::size_t>{99, 99}));
  EXPECT_EQ(at({.profile = "9"}), (std::pair<std::size_t, std::size_t>{99, 99}));
}

TEST(Eventgroups, HaveTheNamesOfWhatIsInThem) {
  const someip::EventgroupId group{2};
  Service service;
  EXPECT_EQ(title_of(nullptr, group).text, "");
  EXPECT_EQ(title_of(&service, group).text, "");
  for (const char* name : {"a", "b", "c"}) {
    service.events.push_back({.name = name, .eventgroups = {someip::EventgroupId{1}, group}});
  }
  service.events.push_back({.name = "other", .eventgroups = {someip::EventgroupId{1}}});
  service.fields.push_back({.name = "d", .eventgroups = {group}});
  EXPECT_EQ(title_of(&service, group).text, "a, b, c, d");
  service.fields.push_back({.name = "e", .eventgroups = {group}});
  service.fields.push_back({.name = "f", .eventgroups = {group}});
  EXPECT_EQ(title_of(&service, group).text, "a, b, c, d, \xe2\x80\xa6");
  EXPECT_FALSE(title_of(&service, group).is_name);
  service.eventgroups = {{.name = "", .id = someip::EventgroupId{1}}, {.name = "motion", .id = group}};
  EXPECT_EQ(title_of(&service, group).text, "motion");
  EXPECT_TRUE(title_of(&service, group).is_name);
  EXPECT_EQ(title_of(&service, someip::EventgroupId{1}).text, "a, b, c, other");
}

}  // namespace
}  // namespace trestle::describe
