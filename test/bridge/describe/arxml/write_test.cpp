#include "bridge/describe/write/arxml/write_arxml.hpp"

#include <gmock/gmock.h>

#include <chrono>
#include <cstdlib>
#include <fstream>

#include "bridge/describe/model_json.hpp"
#include "someip/net/address_text.hpp"
#include "test/bridge/describe/arxml/arxml_text.hpp"
#include "test/bridge/describe/lost.hpp"

namespace trestle::describe {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using namespace std::chrono_literals;

Value value(std::string name, TypeIndex type, Wire wire = {}) {
  return {.name = std::move(name), .type = type, .wire = wire};
}

Wire length(someip::FieldWidth width) {
  Wire wire;
  wire.length = width;
  return wire;
}

/// Every kind of type and of element, with wire rules that differ from member to member.
Model everything() {
  using someip::FieldWidth;
  Model model;
  const TypeIndex u8 = model.add({.kind = Kind::primitive});
  const TypeIndex u16 = model.add({.kind = Kind::primitive, .primitive = messages::Primitive::uint16});
  const TypeIndex limited = model.add({.kind = Kind::primitive,
                                       .primitive = messages::Primitive::int16,
                                       .invalid_value = -1,
                                       .minimum = 0,
                                       .maximum = 99});
  const Wire text_wire = length(FieldWidth::bits16);
  const TypeIndex text = model.add({.kind = Kind::string, .wire = text_wire});
  const TypeIndex bytes = model.add({.kind = Kind::bytes, .wire = length(FieldWidth::bits8)});
  const TypeIndex speed = model.add({.kind = Kind::alias,
                                     .name = "Speed",
                                     .scope = "/car/Types",
                                     .element = value("", limited),
                                     .notes = {.description = "how fast & far"}});
  // Limits that are open on one side.
  const auto open_limit = [&](std::string name, std::optional<std::int64_t> least,
                              std::optional<std::int64_t> most) {
    const TypeIndex type = model.add({.kind = Kind::primitive,
                                      .primitive = messages::Primitive::int16,
                                      .minimum = least,
                                      .maximum = most});
    return model.add(
        {.kind = Kind::alias, .name = std::move(name), .scope = "/car/Types", .element = value("", type)});
  };
  const TypeIndex at_least = open_limit("AtLeast", -5, std::nullopt);
  const TypeIndex at_most = open_limit("AtMost", std::nullopt, 77);
  const TypeIndex gear = model.add({.kind = Kind::enumeration,
                                    .name = "Gear",
                                    .scope = "/car/Types",
                                    .primitive = messages::Primitive::uint8,
                                    .enumerators = {{"PARK", 0}, {"DRIVE", 4}}});
  const TypeIndex four = model.add({.kind = Kind::array,
                                    .name = "Four",
                                    .scope = "/car/Types",
                                    .element = value("", u16),
                                    .max_size = 4,
                                    .fixed_size = true});
  const TypeIndex many =
      model.add({.kind = Kind::array, .wire = length(FieldWidth::bits16), .element = value("", gear)});
  const TypeIndex map = model.add({.kind = Kind::map,
                                   .name = "Map",
                                   .scope = "/car/Types",
                                   .wire = length(FieldWidth::bits16),
                                   .element = value("", speed),
                                   .key = value("", u8)});
  Wire choice_wire = length(FieldWidth::bits32);
  choice_wire.selector = FieldWidth::bits8;
  const TypeIndex either = model.add({.kind = Kind::choice,
                                      .name = "Either",
                                      .scope = "/car/Types",
                                      .wire = choice_wire,
                                      .members = {value("number", u16), value("text", text, text_wire)}});
  Type all{.kind = Kind::structure, .name = "All", .scope = "/car/Types"};
  all.wire = length(FieldWidth::bits16);
  all.members = {value("speed", speed),
                 value("four", four),
                 value("many", many, length(FieldWidth::bits16)),
                 value("map", map, length(FieldWidth::bits16)),
                 value("raw", bytes, length(FieldWidth::bits8)),
                 value("either", either, choice_wire),
                 value("text", text, text_wire)};
  all.members[0].tag = someip::DataId{1};
  all.members[0].notes.unit = "km/h";
  all.members[6].tag = someip::DataId{2};
  all.members[6].optional = true;
  const TypeIndex whole = model.add(all);

  Service service{.name = "Door",
                  .scope = "/car",
                  .id = someip::ServiceId{0x1234},
                  .major = 2,
                  .minor = 3,
                  .has_version = true};
  service.namespaces = {"car", "body"};
  service.notes.description = "line 1\nline <2>";
  service.notes.others["details"] = "x";
  service.eventgroups = {{.name = "Group", .id = someip::EventgroupId{7}}};
  Event one{.name = "changed", .id = someip::MethodId{0x8001}};
  one.payload.values = {value("all", whole, length(FieldWidth::bits16))};
  one.payload.tagged_length = FieldWidth::bits16;
  one.eventgroups = {someip::EventgroupId{7}};
  one.transfer = {.segment_bytes = 1392, .separation = 2ms};
  Event two{.name = "two", .id = someip::MethodId{0x8002}};
  two.payload.byte_order = std::endian::little;
  two.payload.length_fields_always_big = true;
  two.payload.values = {value("a", u16), value("b", text, text_wire), value("c", at_least),
                        value("d", at_most)};
  Event none{.name = "none", .id = someip::MethodId{0x8003}};
  service.events = {one, two, none};
  Method open{.name = "open", .id = someip::MethodId{1}};
  open.request.values = {value("gear", gear), value("both", u8)};
  open.response.values = {value("both", u8), value("done", text, text_wire)};
  open.inout = {"both"};
  open.response_transfer.segment_bytes = 64;
  Method shut{.name = "shut", .id = someip::MethodId{2}, .fire_and_forget = true};
  service.methods = {open, shut};
  describe::Field level{.name = "level",
                        .getter = someip::MethodId{3},
                        .notifier = someip::MethodId{0x8004},
                        .has_setter = false};
  level.payload.values = {value("level", speed)};
  level.eventgroups = {someip::EventgroupId{7}};
  level.getter_transfer.transport = Transport::tcp;
  service.fields = {level};
  // Protection of each kind of element; profiles that are alike are one in the file.
  service.events[0].e2e = {.profile = "4",
                           .numbers = {{"data_id", 0x0100'002d},
                                       {"max_data_bits", 8192},
                                       {"max_delta_counter", 3},
                                       {"max_error_init", 1},
                                       {"max_error_invalid", 0},
                                       {"max_error_valid", 2},
                                       {"min_data_bits", 256},
                                       {"min_ok_init", 1},
                                       {"min_ok_invalid", 1},
                                       {"min_ok_valid", 2},
                                       {"window_size_init", 5},
                                       {"window_size_invalid", 6},
                                       {"window_size_valid", 7}},
                           .words = {{"clear_to_invalid", "true"}, {"transit_to_invalid_extended", "true"}}};
  service.events[1].e2e = service.events[0].e2e;
  service.events[1].e2e.numbers["data_id"] = 0xffff'ffff;
  service.events[2].e2e = {.profile = "1",
                           .numbers = {{"data_bits", 80}, {"data_id", 0x123}, {"max_delta_counter", 2}},
                           .words = {{"data_id_mode", "nibble"}}};
  service.methods[0].e2e = {.profile = "44m",
                            .numbers = {{"data_id", 7}, {"source_id", 0x0abc'def0}},
                            .words = {{"transit_to_invalid_extended", "false"}}};
  service.methods[1].e2e = {.profile = "22",
                            .numbers = {{"data_bits", 80}, {"max_delta_counter", 1}},
                            .words = {{"data_id_list", "1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 255"}}};
  service.fields[0].e2e = {.profile = "11", .numbers = {{"data_bits", 80}, {"data_id", 1}}};
  service.fields[0].getter_e2e = {.profile = "7m", .numbers = {{"data_id", 9}}};
  model.services = {service};

  Instance left{.role = Instance::Role::provided,
                .name = "Left",
                .service = "/car/Door",
                .service_id = service.id,
                .id = someip::InstanceId{1}};
  left.address = IpAddress::v4(10, 0, 0, 1);
  left.udp_port = 30501;
  left.tcp_port = 30502;
  left.multicast = {
      {.eventgroup = someip::EventgroupId{7}, .group = {IpAddress::v4(239, 0, 0, 1), 30600}, .threshold = 3}};
  left.multicast.push_back({.eventgroup = someip::EventgroupId{7},
                            .group = {*someip::parse_address("ff02::1:2"), 30601},
                            .threshold = 1});
  left.timing = sd::Timing{.repetitions_max = 5, .ttl_s = 10};
  left.priority = 1;
  left.weight = 2;
  left.configuration = {{"side", "left"}};
  left.machine = "Ecu";
  left.notes = {.description = "Of the driver", .others = {{"Domain", "\"local\""}}};
  Instance any{
      .role = Instance::Role::required, .name = "Any", .service = "/car/Door", .service_id = service.id};
  any.eventgroups = {someip::EventgroupId{7}};
  model.instances = {left, any};
  model.machines = {
      {.name = "Ecu", .address = left.address, .sd_multicast = IpAddress::v4(224, 0, 0, 1), .sd_port = 30490},
      {.name = "Six", .address = someip::parse_address("fe80::1")}};
  return model;
}

TEST(WriteArxml, IsReadBackAsItWas) {
  const Model model = everything();
  const ArxmlFile file = write_arxml(model);
  for (const NotCarried& lost : file.not_carried) {
    ADD_FAILURE() << lost.element << ": " << lost.what;
  }
  // For written_test.py, which has others read it.
  if (const char* const out = std::getenv("TRESTLE_ARXML_OUT"); out != nullptr) {
    std::ofstream{out} << file.text;
  }
  const Reading reading = read_texts({file.text});
  EXPECT_EQ(problems_of(reading), "");
  EXPECT_EQ(canonical(reading.model), canonical(model));
}

TEST(WriteArxml, IsTheSameEachTime) {
  EXPECT_EQ(write_arxml(everything()).text, write_arxml(everything()).text);
}

TEST(WriteArxml, WritesAllGroupsOfIpv6Addresses) {
  const std::string text = write_arxml(everything()).text;
  // The schema's pattern has no "::".
  EXPECT_THAT(text, HasSubstr("<IPV-6-ADDRESS>fe80:0:0:0:0:0:0:1</IPV-6-ADDRESS>"));
  EXPECT_THAT(text, HasSubstr(">ff02:0:0:0:0:0:1:2</IPV-6-MULTICAST-IP-ADDRESS>"));
}

/// A service with an event for each value, "e0", "e1" …
Model with_events(Model model, const std::vector<Value>& values) {
  Service service{.name = "A", .scope = "/car", .id = someip::ServiceId{1}};
  for (const Value& one : values) {
    const auto number = static_cast<std::uint16_t>(service.events.size());
    Event event{.name = "e" + std::to_string(number),
                .id = static_cast<someip::MethodId>(static_cast<std::uint16_t>(0x8001U + number))};
    event.payload.values = {one};
    service.events.push_back(std::move(event));
  }
  model.services = {service};
  return model;
}

std::size_t count(std::string_view text, std::string_view part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string_view::npos; at = text.find(part, at + 1)) {
    ++found;
  }
  return found;
}

TEST(WriteArxml, GivesAVariantWithOtherBytesATypeOfItsOwn) {
  Model model;
  Type side{.kind = Kind::enumeration,
            .name = "Side",
            .scope = "/car/Types",
            .primitive = messages::Primitive::uint16,
            .enumerators = {{"L", 0}, {"R", 1}}};
  // Used first: the name still is that of the type it is a variant of.
  Type wide = side;
  wide.primitive = messages::Primitive::uint32;
  wide.variant_of = TypeIndex{1};
  const TypeIndex u32 = model.add(wide);
  const TypeIndex u16 = model.add(side);
  // What holds it differs as well.
  Type pair{.kind = Kind::structure, .name = "Pair", .scope = "/car/Types", .members = {value("side", u16)}};
  const TypeIndex narrow_pair = model.add(pair);
  pair.members[0].type = u32;
  pair.variant_of = narrow_pair;
  const TypeIndex wide_pair = model.add(pair);
  model = with_events(std::move(model),
                      {value("e0", u32), value("e1", u16), value("e2", narrow_pair), value("e3", wide_pair)});

  const ArxmlFile file = write_arxml(model);
  const Reading reading = read_texts({file.text});
  EXPECT_EQ(problems_of(reading), "");
  const std::vector<Event>& events = reading.model.services.at(0).events;
  const auto type_of = [&](std::size_t event) -> const Type& {
    return reading.model.at(events.at(event).payload.values.at(0).type);
  };
  EXPECT_EQ(type_of(0).primitive, messages::Primitive::uint32);
  EXPECT_EQ(type_of(0).name, "Side_2");
  EXPECT_EQ(type_of(1).primitive, messages::Primitive::uint16);
  EXPECT_EQ(type_of(1).name, "Side");
  EXPECT_EQ(reading.model.at(type_of(2).members.at(0).type).name, "Side");
  EXPECT_EQ(reading.model.at(type_of(3).members.at(0).type).name, "Side_2");
  EXPECT_THAT(file.not_carried,
              Contains(testing::AllOf(Field(&NotCarried::element, "/car/Types/Side"),
                                      Field(&NotCarried::what, HasSubstr("its name: it is Side_2")))));
}

TEST(WriteArxml, GivesStringsWithoutLengthFieldTheirSizes) {
  Model model;
  const TypeIndex u8 = model.add({.kind = Kind::primitive});
  const Wire usual = default_wire(Kind::string);
  const TypeIndex text = model.add({.kind = Kind::string, .wire = usual});
  const TypeIndex name = model.add({.kind = Kind::alias,
                                    .name = "Name",
                                    .scope = "/car/Types",
                                    .wire = usual,
                                    .element = value("", text, usual)});
  const TypeIndex many =
      model.add({.kind = Kind::array, .wire = default_wire(Kind::array), .element = value("", u8)});
  const TypeIndex three = model.add(
      {.kind = Kind::array, .element = value("", u8), .min_size = 3, .max_size = 3, .fixed_size = true});
  Wire twelve = usual;
  twelve.length = someip::FieldWidth::none;
  twelve.fixed_bytes = 12;
  Wire five = twelve;
  five.fixed_bytes = 5;
  Type any{.kind = Kind::structure,
           .name = "S",
           .scope = "/car/Types",
           .members = {value("v", many, default_wire(Kind::array)), value("p", text, usual)}};
  const TypeIndex dynamic = model.add(any);
  any.members = {value("v", three), value("p", text, twelve)};
  any.variant_of = dynamic;
  const TypeIndex fixed = model.add(any);
  model = with_events(std::move(model), {value("e0", fixed), value("e1", dynamic), value("e2", name, twelve),
                                         value("e3", name, five), value("e4", name, usual)});

  const ArxmlFile file = write_arxml(model);
  const Reading reading = read_texts({file.text});
  EXPECT_EQ(problems_of(reading), "");
  const std::vector<Event>& events = reading.model.services.at(0).events;
  const auto value_of = [&](std::size_t event) -> const Value& {
    return events.at(event).payload.values.at(0);
  };
  EXPECT_THAT(file.not_carried, Not(Contains(Field(&NotCarried::what, HasSubstr("least number")))))
      << "of an array of fixed size";
  const Type& read_fixed = reading.model.at(value_of(0).type);
  EXPECT_EQ(read_fixed.members.at(1).wire, twelve);
  EXPECT_TRUE(reading.model.at(read_fixed.members.at(0).type).fixed_size);
  const Type& read_dynamic = reading.model.at(value_of(1).type);
  EXPECT_EQ(read_dynamic.members.at(1).wire, usual);
  EXPECT_FALSE(reading.model.at(read_dynamic.members.at(0).type).fixed_size);
  EXPECT_EQ(value_of(2).wire, twelve);
  EXPECT_EQ(value_of(3).wire, five);
  EXPECT_EQ(value_of(4).wire, usual);
}

TEST(WriteArxml, WritesThatAMapHasNoLengthField) {
  Model model;
  const TypeIndex u8 = model.add({.kind = Kind::primitive});
  const Wire none = length(someip::FieldWidth::none);
  const Wire usual = default_wire(Kind::map);
  Type map{.kind = Kind::map,
           .name = "Map",
           .scope = "/car/Types",
           .element = value("", u8),
           .key = value("", u8),
           .min_size = 3,
           .max_size = 3,
           .fixed_size = true};
  const TypeIndex three = model.add(map);
  map.name = "Some";
  map.fixed_size = false;
  const TypeIndex some = model.add(map);
  model = with_events(std::move(model), {value("e0", three, none), value("e1", some, usual)});

  const ArxmlFile file = write_arxml(model);
  EXPECT_THAT(lines_of(file.not_carried),
              testing::ElementsAre("/car/Types/Some: its least number of elements"));
  const Reading reading = read_texts({file.text});
  EXPECT_EQ(problems_of(reading), "");
  const std::vector<Event>& events = reading.model.services.at(0).events;
  const Value& fixed = events.at(0).payload.values.at(0);
  EXPECT_EQ(fixed.wire.length, someip::FieldWidth::none);
  EXPECT_TRUE(reading.model.at(fixed.type).fixed_size);
  EXPECT_EQ(reading.model.at(fixed.type).max_size, 3U);
  const Value& dynamic = events.at(1).payload.values.at(0);
  EXPECT_EQ(dynamic.wire.length, someip::FieldWidth::bits32);
  EXPECT_FALSE(reading.model.at(dynamic.type).fixed_size);
}

TEST(WriteArxml, WritesVariantsThatOnlyDifferInWireRulesAsOneType) {
  Model model;
  const Wire usual = default_wire(Kind::string);
  const Wire shorter = length(someip::FieldWidth::bits8);
  const TypeIndex text = model.add({.kind = Kind::string, .wire = usual});
  Type pair{
      .kind = Kind::structure, .name = "Pair", .scope = "/car/Types", .members = {value("p", text, usual)}};
  const TypeIndex one = model.add(pair);
  pair.members[0].wire = shorter;
  pair.variant_of = one;
  const TypeIndex other = model.add(pair);
  // One that contains itself does not keep the writer busy.
  Type list{.kind = Kind::structure, .name = "List", .scope = "/car/Types"};
  const TypeIndex round = TypeIndex{static_cast<std::uint32_t>(model.types.size())};
  list.members = {value("next", round)};
  model.add(list);
  list.variant_of = round;
  model.add(list);
  model = with_events(std::move(model), {value("e0", one), value("e1", other)});

  const ArxmlFile file = write_arxml(model);
  EXPECT_THAT(file.not_carried, IsEmpty());
  EXPECT_EQ(count(file.text, "<SHORT-NAME>Pair"), 1U);
  EXPECT_EQ(count(file.text, "<SHORT-NAME>List"), 1U);
}

/// With bit 15, which readers set, two events would have one id: nobody could read the file.
TEST(WriteArxml, LeavesOutIdsThatWouldBeThoseOfOthers) {
  Model model = everything();
  Event low = model.services[0].events[0];
  low.name = "low";
  low.id = someip::MethodId(someip::value(*low.id) & 0x7fffU);
  model.services[0].events.insert(model.services[0].events.begin(), low);
  const ArxmlFile file = write_arxml(model);
  EXPECT_THAT(
      file.not_carried,
      Contains(testing::AllOf(Field(&NotCarried::element, "Door.low"),
                              Field(&NotCarried::what, HasSubstr("with bit 15 is that of another one")))));
}

TEST(WriteArxml, ListsWhatItDoesNotCarry) {
  Model model = everything();
  model.services[0].events[0].selective = true;
  model.services[0].events[0].selector = "near";
  model.services.push_back(
      {.name = "Lamp",
       .id = someip::ServiceId{0x4321},
       .eventgroups = {{.name = "all", .id = someip::EventgroupId{1}}, {.id = someip::EventgroupId{33010}}}});
  model.services[0].manages = {"Other"};
  model.services[0].methods[0].timeout = 1s;
  model.services[0].methods[0].request.crc_bytes = 4;
  model.services[0].events[1].cycle = 10ms;
  model.services[0].fields[0].has_notifier = true;
  model.services[0].fields[0].notifier = someip::MethodId{0x0123};
  model.constants = {{.name = "LIMIT", .type = TypeIndex{0}, .value = "5"}};
  const std::vector<NotCarried> lost = write_arxml(model).not_carried;
  EXPECT_THAT(lost, Contains(testing::AllOf(Field(&NotCarried::element, "Door.changed"),
                                            Field(&NotCarried::what, HasSubstr("selective")))));
  EXPECT_THAT(lines_of(lost),
              testing::IsSupersetOf(
                  {"Door.changed: its selector near", "Lamp: that it has no package: it is in Model",
                   "Lamp: that eventgroups of it have no names: they are Eventgroup_ and their ids"}));
  EXPECT_THAT(lost, Contains(Field(&NotCarried::what, HasSubstr("manages Other"))));
  EXPECT_THAT(lost, Contains(Field(&NotCarried::what, HasSubstr("timeout"))));
  EXPECT_THAT(lost, Contains(Field(&NotCarried::what, "its CRC of 4 bytes")));
  EXPECT_THAT(lost, Contains(Field(&NotCarried::what, HasSubstr("cycle"))));
  EXPECT_THAT(lost, Contains(Field(&NotCarried::element, "LIMIT")));
  EXPECT_THAT(
      lost, Contains(testing::AllOf(Field(&NotCarried::element, "Door." + model.services[0].fields[0].name),
                                    Field(&NotCarried::what, "that its id has no bit 15: readers set it"))));
}

TEST(WriteArxml, ListsTimesOfCollectingOnceWhereNobodyChoseThem) {
  Model model = everything();
  Service& door = model.services[0];
  EXPECT_THAT(write_arxml(model).not_carried, IsEmpty());
  for (Event& event : door.events) {
    event.transfer.retention = 5ms;
  }
  const std::string usual =
      "/car/Door: that messages wait up to 5 ms for others, as CommonAPI has it where nobody says otherwise";
  EXPECT_THAT(lines_of(write_arxml(model).not_carried), ElementsAre(usual));
  door.events[0].transfer.retention = 4ms;
  door.methods[0].response_transfer.retention = 5ms;
  door.methods[0].response_transfer.debounce = 1ms;
  door.fields[0].getter_transfer.retention = 3ms;
  EXPECT_THAT(lines_of(write_arxml(model).not_carried),
              ElementsAre("Door.changed: its times of collecting several messages",
                          "Door.open (answer): its times of collecting several messages",
                          "Door.level.get: its times of collecting several messages", usual));
}

/// Rules hold for an element with all its arrays: what two of them need differently is never written without
/// a word.
TEST(WriteArxml, ListsLengthFieldsThatDifferInOneElement) {
  using someip::FieldWidth;
  const Wire one = length(FieldWidth::bits8);
  const Wire four = length(FieldWidth::bits32);
  const auto lost_with = [](Model model, const std::vector<Value>& values) {
    const ArxmlFile file = write_arxml(with_events(std::move(model), values));
    EXPECT_EQ(problems_of(read_texts({file.text})), "");
    return lines_of(file.not_carried);
  };
  const std::string arrays = "that arrays in it have another length field";
  Model model;
  const TypeIndex u16 = model.add({.kind = Kind::primitive, .primitive = messages::Primitive::uint16});
  const TypeIndex bytes = model.add({.kind = Kind::bytes, .wire = four});
  const TypeIndex of_bytes = model.add({.kind = Kind::array, .wire = one, .element = value("", bytes, four)});
  EXPECT_THAT(lost_with(model, {value("e0", of_bytes, one)}), Contains(HasSubstr(arrays)));
  EXPECT_THAT(lost_with(model, {value("e0", of_bytes, four)}), IsEmpty());
  const TypeIndex inner = model.add({.kind = Kind::array, .wire = four, .element = value("", u16)});
  const TypeIndex outer = model.add({.kind = Kind::array, .wire = one, .element = value("", inner, four)});
  EXPECT_THAT(lost_with(model, {value("e0", outer, one)}), Contains(HasSubstr(arrays)));
  // None before the outer one, which no property tells, and two bytes before the others.
  const TypeIndex two = model.add({.kind = Kind::array,
                                   .element = value("", inner, length(FieldWidth::bits16)),
                                   .min_size = 2,
                                   .max_size = 2,
                                   .fixed_size = true});
  EXPECT_THAT(lost_with(model, {value("e0", two)}), Contains(HasSubstr(arrays)));
  // Byte buffers and arrays share a property also where one has a fixed size.
  const TypeIndex three = model.add({.kind = Kind::bytes, .min_size = 3, .max_size = 3, .fixed_size = true});
  const TypeIndex pair = model.add({.kind = Kind::structure,
                                    .name = "Pair",
                                    .scope = "/car/Types",
                                    .members = {value("a", inner, one), value("b", three)}});
  Model pairs = with_events(model, {value("e0", pair)});
  const ArxmlFile file = write_arxml(pairs);
  EXPECT_THAT(lines_of(file.not_carried), Not(Contains(HasSubstr(arrays))));
  const Model again = read_texts({file.text}).model;
  const Type& read_pair = again.at(again.services.at(0).events.at(0).payload.values.at(0).type);
  EXPECT_EQ(read_pair.members.at(0).wire.length, FieldWidth::bits8);
  EXPECT_EQ(read_pair.members.at(1).wire.length, FieldWidth::none);
  // Strings of keys and of values.
  const TypeIndex text = model.add({.kind = Kind::string, .wire = four});
  const TypeIndex map = model.add({.kind = Kind::map,
                                   .name = "Map",
                                   .scope = "/car/Types",
                                   .wire = four,
                                   .element = value("", text, four),
                                   .key = value("", text, one)});
  EXPECT_THAT(lost_with(model, {value("e0", map, four)}), Contains(HasSubstr("string length")));
}

TEST(WriteArxml, WritesTheWidthBeforeTaggedMembers) {
  using someip::FieldWidth;
  Model model;
  const TypeIndex u16 = model.add({.kind = Kind::primitive, .primitive = messages::Primitive::uint16});
  const TypeIndex text = model.add({.kind = Kind::string, .wire = default_wire(Kind::string)});
  Type all{.kind = Kind::structure, .name = "All", .scope = "/car/Types"};
  all.members = {value("a", u16), value("s", text, default_wire(Kind::string))};
  all.members[0].tag = someip::DataId{1};
  all.members[1].tag = someip::DataId{2};
  const Value use = value("e0", model.add(all), length(FieldWidth::bits16));
  for (const FieldWidth width : {FieldWidth::bits8, FieldWidth::bits16, FieldWidth::bits32}) {
    Model tagged = with_events(model, {use});
    tagged.services[0].events[0].payload.tagged_length = width;
    const ArxmlFile file = write_arxml(tagged);
    const Model again = read_texts({file.text}).model;
    EXPECT_EQ(again.services.at(0).events.at(0).payload.tagged_length, width);
    EXPECT_THAT(file.not_carried, IsEmpty()) << testing::PrintToString(lines_of(file.not_carried));
  }
}

TEST(WriteArxml, CallsTheErrorOfAMethodByTheMethod) {
  Model model;
  const TypeIndex base =
      model.add({.kind = Kind::enumeration, .name = "E", .scope = "car", .enumerators = {{"OK", 0}}});
  const TypeIndex error = model.add(
      {.kind = Kind::enumeration, .scope = "car.Door", .base = base, .enumerators = {{"JAMMED", 1}}});
  model.services = {{.name = "Door", .scope = "car", .methods = {{.name = "open", .error = error}}}};
  EXPECT_THAT(lines_of(write_arxml(model).not_carried),
              Contains("car.Door.open.error: that it extends another enumeration: the values are copied in"));
}

TEST(WriteArxml, ListsNamespacesThatAreNoWords) {
  Model model;
  model.services = {{.name = "Door", .scope = "/car", .namespaces = {"car", "2_5"}}};
  const ArxmlFile file = write_arxml(model);
  EXPECT_THAT(lines_of(file.not_carried), Contains("/car/Door: its namespace: 2_5 is none for AUTOSAR"));
  EXPECT_THAT(file.text, HasSubstr("<SYMBOL>car</SYMBOL>"));
  EXPECT_THAT(file.text, Not(HasSubstr("<SYMBOL>2_5")));
}

TEST(WriteArxml, WritesGroupsWithoutAPort) {
  Model model;
  Service door{.name = "Door", .scope = "car", .id = someip::ServiceId{1}};
  door.eventgroups = {{.name = "all", .id = someip::EventgroupId{7}}};
  model.services = {door};
  model.instances = {
      {.service = "car.Door", .service_id = someip::ServiceId{1}, .id = someip::InstanceId{1}}};
  model.instances[0].multicast = {
      {.eventgroup = someip::EventgroupId{7}, .group = {IpAddress::v4(224, 1, 2, 3), 0}}};
  const Reading again = read_texts({write_arxml(model).text});
  EXPECT_THAT(problems_of(again), IsEmpty());
  EXPECT_EQ(again.model.instances.at(0).multicast, model.instances[0].multicast);
}

TEST(WriteArxml, DeploysEachOfSeveralOverloads) {
  Model model;
  const TypeIndex u8 = model.add({.kind = Kind::primitive});
  Service service{.name = "Door", .scope = "car", .id = someip::ServiceId{0x1234}};
  for (const std::uint16_t number : {std::uint16_t{1}, std::uint16_t{2}}) {
    const std::string selector = number == 1 ? "" : "far";
    Event event{.name = "moved", .id = someip::MethodId(0x8000U + number), .selector = selector};
    event.payload.values.push_back(value("x", u8));
    service.events.push_back(std::move(event));
    service.methods.push_back({.name = "open", .id = someip::MethodId{number}, .selector = selector});
  }
  service.methods.push_back({.name = "odd", .id = someip::MethodId{0}});
  model.services.push_back(std::move(service));
  const ArxmlFile written = write_arxml(model);
  for (const char* path :
       {"/car/Door/moved<", "/car/Door/moved_2<", "/car/Door/open<", "/car/Door/open_2<"}) {
    EXPECT_THAT(written.text, HasSubstr(path));
  }
  EXPECT_THAT(lines_of(written.not_carried),
              testing::IsSupersetOf({"Door.odd: its id 0, which is reserved: readers take it for none",
                                     "Door.moved:far: its name: it is moved_2",
                                     "Door.open:far: its name: it is open_2"}));
}

}  // namespace
}  // namespace trestle::describe
