#include "bridge/describe/write/arxml/write_arxml.hpp"

#include <gmock/gmock.h>

#include <chrono>
#include <cstdlib>
#include <fstream>

#include "bridge/describe/model_json.hpp"
#include "test/bridge/describe/arxml/arxml_text.hpp"

namespace trestle::describe {
namespace {

using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
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
  two.payload.values = {value("a", u16), value("b", text, text_wire)};
  // Tags are looked up in all files where no mapping names a set; so the width before them is known
  // everywhere.
  two.payload.tagged_length = FieldWidth::bits16;
  Event none{.name = "none", .id = someip::MethodId{0x8003}};
  service.events = {one, two, none};
  Method open{.name = "open", .id = someip::MethodId{1}};
  open.request.values = {value("gear", gear), value("both", u8)};
  open.response.values = {value("both", u8), value("done", text, text_wire)};
  open.request.tagged_length = open.response.tagged_length = FieldWidth::bits16;
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
  left.timing = sd::Timing{.repetitions_max = 5, .ttl_s = 10};
  left.priority = 1;
  left.weight = 2;
  left.configuration = {{"side", "left"}};
  left.machine = "Ecu";
  Instance any{
      .role = Instance::Role::required, .name = "Any", .service = "/car/Door", .service_id = service.id};
  any.eventgroups = {someip::EventgroupId{7}};
  model.instances = {left, any};
  model.machines = {{.name = "Ecu",
                     .address = left.address,
                     .sd_multicast = IpAddress::v4(224, 0, 0, 1),
                     .sd_port = 30490}};
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

TEST(WriteArxml, ListsWhatItDoesNotCarry) {
  Model model = everything();
  model.services[0].events[0].selective = true;
  model.services[0].manages = {"Other"};
  model.services[0].methods[0].timeout = 1s;
  model.services[0].methods[0].request.crc_bytes = 4;
  model.services[0].events[1].cycle = 10ms;
  model.constants = {{.name = "LIMIT", .type = TypeIndex{0}, .value = "5"}};
  const std::vector<NotCarried> lost = write_arxml(model).not_carried;
  EXPECT_THAT(lost, Contains(testing::AllOf(Field(&NotCarried::element, "Door.changed"),
                                            Field(&NotCarried::what, HasSubstr("selective")))));
  EXPECT_THAT(lost, Contains(Field(&NotCarried::what, HasSubstr("manages Other"))));
  EXPECT_THAT(lost, Contains(Field(&NotCarried::what, HasSubstr("timeout"))));
  EXPECT_THAT(lost, Contains(Field(&NotCarried::what, HasSubstr("checksum"))));
  EXPECT_THAT(lost, Contains(Field(&NotCarried::what, HasSubstr("cycle"))));
  EXPECT_THAT(lost, Contains(Field(&NotCarried::element, "LIMIT")));
}

}  // namespace
}  // namespace trestle::describe
