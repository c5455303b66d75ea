#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <random>

#include "bridge/describe/join.hpp"
#include "test/bridge/describe/arxml/arxml_text.hpp"

namespace trestle::describe {
namespace {

using ::testing::ContainsRegex;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using namespace std::chrono_literals;

constexpr std::string_view base_types = R"(
<SW-BASE-TYPE><SHORT-NAME>u16</SHORT-NAME><BASE-TYPE-SIZE>16</BASE-TYPE-SIZE><BASE-TYPE-ENCODING>NONE</BASE-TYPE-ENCODING></SW-BASE-TYPE>
<SW-BASE-TYPE><SHORT-NAME>s32</SHORT-NAME><BASE-TYPE-SIZE>32</BASE-TYPE-SIZE><BASE-TYPE-ENCODING>2C</BASE-TYPE-ENCODING></SW-BASE-TYPE>
)";

std::string props(std::string_view inner) {
  return "<SW-DATA-DEF-PROPS><SW-DATA-DEF-PROPS-VARIANTS><SW-DATA-DEF-PROPS-CONDITIONAL>" +
         std::string{inner} +
         "</SW-DATA-DEF-PROPS-CONDITIONAL></SW-DATA-DEF-PROPS-VARIANTS></SW-DATA-DEF-PROPS>";
}

std::string service(std::string_view inner) {
  return "<SERVICE-INTERFACE><SHORT-NAME>Door</SHORT-NAME>" + std::string{inner} + "</SERVICE-INTERFACE>";
}

std::string event(std::string_view name, std::string_view type) {
  return "<VARIABLE-DATA-PROTOTYPE><SHORT-NAME>" + std::string{name} + "</SHORT-NAME><TYPE-TREF DEST=\"X\">" +
         std::string{type} + "</TYPE-TREF></VARIABLE-DATA-PROTOTYPE>";
}

std::string field_type(const Reading& reading, std::size_t index = 0) {
  const Model& model = reading.model;
  const Value& value = model.services.at(0).events.at(index).payload.values.at(0);
  const Type& type = resolved(model, value.type);
  return std::string{to_string(type.kind)} + " " + type.name;
}

TEST(ReadArxml, ReadsAServiceWithItsDeployment) {
  const Reading reading = read_texts({arxml(
      service(
          "<DESC><L-2 L=\"DE\">Tür</L-2><L-2 L=\"EN\">A <TT>door</TT></L-2></DESC>"
          "<NAMESPACES><SYMBOL-PROPS><SHORT-NAME>a</SHORT-NAME><SYMBOL>car</SYMBOL></SYMBOL-PROPS></"
          "NAMESPACES>"
          "<MAJOR-VERSION>3</MAJOR-VERSION><MINOR-VERSION>1</MINOR-VERSION><EVENTS>" +
          event("moved", "/ara/stdtypes/uint16_t") +
          "</EVENTS><FIELDS><FIELD><SHORT-NAME>angle</SHORT-NAME><TYPE-TREF DEST=\"X\">/AUTOSAR/Types/sint8"
          "</TYPE-TREF><HAS-GETTER>true</HAS-GETTER><HAS-NOTIFIER>true</HAS-NOTIFIER><HAS-SETTER>false"
          "</HAS-SETTER></FIELD></FIELDS><METHODS><CLIENT-SERVER-OPERATION><SHORT-NAME>open</SHORT-NAME>"
          "<ARGUMENTS><ARGUMENT-DATA-PROTOTYPE><SHORT-NAME>speed</SHORT-NAME><TYPE-TREF DEST=\"X\">"
          "/x/float</TYPE-TREF><DIRECTION>INOUT</DIRECTION></ARGUMENT-DATA-PROTOTYPE></ARGUMENTS>"
          "<POSSIBLE-AP-ERROR-REFS><POSSIBLE-AP-ERROR-REF DEST=\"X\">/E/Jammed</POSSIBLE-AP-ERROR-REF>"
          "</POSSIBLE-AP-ERROR-REFS></CLIENT-SERVER-OPERATION></METHODS>") +
      "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</SHORT-NAME><EVENT-DEPLOYMENTS>"
      "<SOMEIP-EVENT-DEPLOYMENT><SHORT-NAME>m</SHORT-NAME><EVENT-REF DEST=\"X\">/P/Door/moved</EVENT-REF>"
      "<EVENT-ID>0x8001</EVENT-ID><MAXIMUM-SEGMENT-LENGTH>1404</MAXIMUM-SEGMENT-LENGTH>"
      "<SEPARATION-TIME>0.002</SEPARATION-TIME><TRANSPORT-PROTOCOL>UDP</TRANSPORT-PROTOCOL>"
      "</SOMEIP-EVENT-DEPLOYMENT></EVENT-DEPLOYMENTS><FIELD-DEPLOYMENTS><SOMEIP-FIELD-DEPLOYMENT>"
      "<SHORT-NAME>f</SHORT-NAME><FIELD-REF "
      "DEST=\"X\">/P/Door/angle</FIELD-REF><GET><SHORT-NAME>g</SHORT-NAME>"
      "<METHOD-ID>5</METHOD-ID><TRANSPORT-PROTOCOL>TCP</TRANSPORT-PROTOCOL></GET><NOTIFIER><SHORT-NAME>Note"
      "</SHORT-NAME><EVENT-ID>32770</EVENT-ID></NOTIFIER></SOMEIP-FIELD-DEPLOYMENT></FIELD-DEPLOYMENTS>"
      "<METHOD-DEPLOYMENTS><SOMEIP-METHOD-DEPLOYMENT><SHORT-NAME>o</SHORT-NAME><METHOD-REF "
      "DEST=\"X\">/P/Door/open"
      "</METHOD-REF><METHOD-ID>7</METHOD-ID></SOMEIP-METHOD-DEPLOYMENT></METHOD-DEPLOYMENTS>"
      "<SERVICE-INTERFACE-REF DEST=\"X\">/P/Door</SERVICE-INTERFACE-REF><EVENT-GROUPS><SOMEIP-EVENT-GROUP>"
      "<SHORT-NAME>All</SHORT-NAME><EVENT-GROUP-ID>9</EVENT-GROUP-ID><EVENT-REFS>"
      "<EVENT-REF DEST=\"SOMEIP-EVENT-DEPLOYMENT\">/P/Dep/m</EVENT-REF>"
      "<EVENT-REF "
      "DEST=\"SOMEIP-EVENT-DEPLOYMENT\">/P/Dep/f/Note</EVENT-REF></EVENT-REFS></SOMEIP-EVENT-GROUP>"
      "</EVENT-GROUPS><SERVICE-INTERFACE-ID>4660</SERVICE-INTERFACE-ID></"
      "SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>")});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  ASSERT_EQ(reading.model.services.size(), 1U);
  const Service& door = reading.model.services[0];
  EXPECT_EQ(door.scope, "/P");
  EXPECT_EQ(door.id, someip::ServiceId{0x1234});
  EXPECT_EQ(door.major, 3);
  EXPECT_EQ(door.minor, 1U);
  EXPECT_EQ(door.notes.description, "A door");
  EXPECT_THAT(door.namespaces, ElementsAre("car"));
  EXPECT_EQ(door.events[0].id, someip::MethodId{0x8001});
  EXPECT_EQ(door.events[0].transfer.segment_bytes, 1392U);
  EXPECT_EQ(door.events[0].transfer.separation, 2ms);
  EXPECT_THAT(door.events[0].eventgroups, ElementsAre(someip::EventgroupId{9}));
  EXPECT_EQ(door.fields[0].getter, someip::MethodId{5});
  EXPECT_EQ(door.fields[0].getter_transfer.transport, Transport::tcp);
  EXPECT_EQ(door.fields[0].notifier, someip::MethodId{0x8002});
  EXPECT_FALSE(door.fields[0].has_setter);
  EXPECT_THAT(door.fields[0].eventgroups, ElementsAre(someip::EventgroupId{9}));
  EXPECT_EQ(door.methods[0].id, someip::MethodId{7});
  EXPECT_EQ(door.methods[0].request.values[0].name, "speed");
  EXPECT_EQ(door.methods[0].response.values[0].name, "speed");
  EXPECT_THAT(door.methods[0].inout, ElementsAre("speed"));
  EXPECT_THAT(door.methods[0].application_errors, ElementsAre("/E/Jammed"));
}

TEST(ReadArxml, RefusesNamesThatAreNone) {
  const std::string in_two_lines = problems_of(
      read_texts({arxml("\n<SERVICE-INTERFACE><SHORT-NAME>Do\nor</SHORT-NAME></SERVICE-INTERFACE>")}));
  EXPECT_THAT(
      in_two_lines,
      HasSubstr("0.arxml:3:20: error: a line end or another control character is in this SHORT-NAME"));
  // Elements before a name that has one in it stay.
  const Reading nested = read_texts(
      {arxml("<SERVICE-INTERFACE><EVENTS>" + event("moved", "/x/uint8") +
             "</EVENTS><SHORT-NAME>Do<SHORT-NAME>x</SHORT-NAME>or</SHORT-NAME></SERVICE-INTERFACE>")});
  EXPECT_THAT(problems_of(nested), HasSubstr("error: an element stands in a SHORT-NAME"));
  ASSERT_EQ(nested.model.services.size(), 1U);
  EXPECT_EQ(nested.model.services[0].name, "Door");
  EXPECT_EQ(nested.model.services[0].events.size(), 1U);
}

std::string deployed_event(std::string_view id) {
  return arxml(
      service("<EVENTS>" + event("e", "/x/uint8") + "</EVENTS>") +
      "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</SHORT-NAME><EVENT-DEPLOYMENTS>"
      "<SOMEIP-EVENT-DEPLOYMENT><SHORT-NAME>m</SHORT-NAME><EVENT-REF DEST=\"X\">/P/Door/e</EVENT-REF>"
      "<EVENT-ID>" +
      std::string{id} +
      "</EVENT-ID></SOMEIP-EVENT-DEPLOYMENT></EVENT-DEPLOYMENTS>"
      "<SERVICE-INTERFACE-REF DEST=\"X\">/P/Door</SERVICE-INTERFACE-REF>"
      "<SERVICE-INTERFACE-ID>1</SERVICE-INTERFACE-ID></SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>");
}

TEST(ReadArxml, SetsBit15OfEventIdsAndSaysSo) {
  const Reading reading = read_texts({deployed_event("12332")});
  EXPECT_EQ(reading.model.services[0].events[0].id, someip::MethodId{0xb02c});
  EXPECT_THAT(problems_of(reading), HasSubstr("bit 15"));
  const Reading as_it_is = read_texts({deployed_event("12332")}, {.set_event_bit = false});
  EXPECT_EQ(as_it_is.model.services[0].events[0].id, someip::MethodId{0x302c});
  EXPECT_THAT(problems_of(as_it_is), IsEmpty());
  EXPECT_THAT(problems_of(read_texts({deployed_event("70000")})),
              HasSubstr("error: EVENT-ID is \"70000\", and a number from 0 to 65535 was expected"));
}

/// Not where the interface is.
TEST(ReadArxml, KnowsWhereIdsStand) {
  const std::string text = arxml(
      service(
          "<EVENTS>" + event("e", "/x/uint8") +
          "</EVENTS><FIELDS><FIELD><SHORT-NAME>f</SHORT-NAME></FIELD>"
          "</FIELDS><METHODS><CLIENT-SERVER-OPERATION><SHORT-NAME>m</SHORT-NAME></CLIENT-SERVER-OPERATION>"
          "</METHODS>") +
      "\n<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</SHORT-NAME>"
      "\n<SERVICE-INTERFACE-REF DEST=\"X\">/P/Door</SERVICE-INTERFACE-REF>"
      "\n<SERVICE-INTERFACE-ID>65535</SERVICE-INTERFACE-ID><EVENT-DEPLOYMENTS><SOMEIP-EVENT-DEPLOYMENT>"
      "<SHORT-NAME>e</SHORT-NAME><EVENT-REF DEST=\"X\">/P/Door/e</EVENT-REF>"
      "\n<EVENT-ID>32769</EVENT-ID></SOMEIP-EVENT-DEPLOYMENT></EVENT-DEPLOYMENTS><FIELD-DEPLOYMENTS>"
      "<SOMEIP-FIELD-DEPLOYMENT><SHORT-NAME>f</SHORT-NAME><FIELD-REF DEST=\"X\">/P/Door/f</FIELD-REF><GET>"
      "\n<METHOD-ID>1</METHOD-ID></GET><SET>"
      "\n<METHOD-ID>2</METHOD-ID></SET><NOTIFIER>"
      "\n<EVENT-ID>32769</EVENT-ID></NOTIFIER></SOMEIP-FIELD-DEPLOYMENT></FIELD-DEPLOYMENTS>"
      "<METHOD-DEPLOYMENTS><SOMEIP-METHOD-DEPLOYMENT><SHORT-NAME>m</SHORT-NAME><METHOD-REF "
      "DEST=\"X\">/P/Door/m"
      "</METHOD-REF>"
      "\n<METHOD-ID>32771</METHOD-ID></SOMEIP-METHOD-DEPLOYMENT></METHOD-DEPLOYMENTS>"
      "</SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>");
  Reading reading = read_texts({text});
  ASSERT_TRUE(reading.ok()) << problems_of(reading);
  const int first = reading.model.services.at(0).id_place.mark.line;
  std::vector<std::string> told;
  for (const documents::Problem& problem : join(reading.model)) {
    told.push_back(fmt::format("{}: {}", problem.mark.line - first, problem.text));
  }
  EXPECT_THAT(told,
              ElementsAre("0: service Door has the id 0xffff, which is that of service discovery and magic "
                          "cookies: give it another one",
                          fmt::format("4: Door.f (notifier) has the id 0x8001 of Door.e, at "
                                      "0.arxml:{}:1",
                                      first + 1),
                          "5: Door.m has the id 0x8003: methods have no bit 15, from 0x0001 to 0x7ffe"));
  const Field& field = reading.model.services.at(0).fields.at(0);
  EXPECT_EQ(field.getter_place.mark.line, first + 2);
  EXPECT_EQ(field.setter_place.mark.line, first + 3);
}

std::string types(std::string_view elements, std::string_view type, std::string_view rules = {}) {
  return arxml(std::string{base_types} + std::string{elements} +
               service("<EVENTS>" + event("e", type) + "</EVENTS>") +
               "<TRANSFORMATION-PROPS-SET><SHORT-NAME>Set</SHORT-NAME><TRANSFORMATION-PROPSS>"
               "<AP-SOMEIP-TRANSFORMATION-PROPS><SHORT-NAME>Props</SHORT-NAME>" +
               std::string{rules} +
               "</AP-SOMEIP-TRANSFORMATION-PROPS></TRANSFORMATION-PROPSS></TRANSFORMATION-PROPS-SET>"
               "<TRANSFORMATION-PROPS-TO-SERVICE-INTERFACE-ELEMENT-MAPPING><SHORT-NAME>Mapping</"
               "SHORT-NAME><EVENT-REFS>"
               "<EVENT-REF DEST=\"X\">/P/Door/e</EVENT-REF></EVENT-REFS>"
               "<TRANSFORMATION-PROPS-REF DEST=\"X\">/P/Set/Props</TRANSFORMATION-PROPS-REF>"
               "</TRANSFORMATION-PROPS-TO-SERVICE-INTERFACE-ELEMENT-MAPPING>");
}

TEST(ReadArxml, ReadsCppTypesOfEveryCategory) {
  const std::string text = types(
      "<STD-CPP-IMPLEMENTATION-DATA-TYPE><SHORT-NAME>Speed</SHORT-NAME><CATEGORY>VALUE</CATEGORY>" +
          props("<BASE-TYPE-REF DEST=\"X\">/P/u16</BASE-TYPE-REF>") +
          "</STD-CPP-IMPLEMENTATION-DATA-TYPE>"
          "<STD-CPP-IMPLEMENTATION-DATA-TYPE><SHORT-NAME>Text</SHORT-NAME><CATEGORY>STRING</CATEGORY>"
          "</STD-CPP-IMPLEMENTATION-DATA-TYPE>"
          "<STD-CPP-IMPLEMENTATION-DATA-TYPE><SHORT-NAME>Four</SHORT-NAME><CATEGORY>ARRAY</"
          "CATEGORY><ARRAY-SIZE>4"
          "</ARRAY-SIZE><TEMPLATE-ARGUMENTS><CPP-TEMPLATE-ARGUMENT><TEMPLATE-TYPE-REF DEST=\"X\">/P/Speed"
          "</TEMPLATE-TYPE-REF></CPP-TEMPLATE-ARGUMENT></TEMPLATE-ARGUMENTS></"
          "STD-CPP-IMPLEMENTATION-DATA-TYPE>"
          "<STD-CPP-IMPLEMENTATION-DATA-TYPE><SHORT-NAME>Many</SHORT-NAME><CATEGORY>VECTOR</CATEGORY>"
          "<TEMPLATE-ARGUMENTS><CPP-TEMPLATE-ARGUMENT><TEMPLATE-TYPE-REF DEST=\"X\">/P/Text"
          "</TEMPLATE-TYPE-REF></CPP-TEMPLATE-ARGUMENT></TEMPLATE-ARGUMENTS></"
          "STD-CPP-IMPLEMENTATION-DATA-TYPE>"
          "<STD-CPP-IMPLEMENTATION-DATA-TYPE><SHORT-NAME>Either</SHORT-NAME><CATEGORY>VARIANT</CATEGORY>"
          "<TEMPLATE-ARGUMENTS><CPP-TEMPLATE-ARGUMENT><TEMPLATE-TYPE-REF "
          "DEST=\"X\">/P/Text</TEMPLATE-TYPE-REF>"
          "</CPP-TEMPLATE-ARGUMENT><CPP-TEMPLATE-ARGUMENT><TEMPLATE-TYPE-REF "
          "DEST=\"X\">/P/Four</TEMPLATE-TYPE-REF>"
          "</CPP-TEMPLATE-ARGUMENT></TEMPLATE-ARGUMENTS></STD-CPP-IMPLEMENTATION-DATA-TYPE>"
          "<STD-CPP-IMPLEMENTATION-DATA-TYPE><SHORT-NAME>Map</SHORT-NAME><CATEGORY>ASSOCIATIVE_MAP</CATEGORY>"
          "<TEMPLATE-ARGUMENTS><CPP-TEMPLATE-ARGUMENT><TEMPLATE-TYPE-REF "
          "DEST=\"X\">/P/Speed</TEMPLATE-TYPE-REF>"
          "</CPP-TEMPLATE-ARGUMENT><CPP-TEMPLATE-ARGUMENT><TEMPLATE-TYPE-REF "
          "DEST=\"X\">/P/Many</TEMPLATE-TYPE-REF>"
          "</CPP-TEMPLATE-ARGUMENT></TEMPLATE-ARGUMENTS></STD-CPP-IMPLEMENTATION-DATA-TYPE>"
          "<STD-CPP-IMPLEMENTATION-DATA-TYPE><SHORT-NAME>All</SHORT-NAME><CATEGORY>STRUCTURE</"
          "CATEGORY><SUB-ELEMENTS>"
          "<CPP-IMPLEMENTATION-DATA-TYPE-ELEMENT><SHORT-NAME>either</SHORT-NAME><TYPE-REFERENCE>"
          "<TYPE-REFERENCE-REF DEST=\"X\">/P/Either</TYPE-REFERENCE-REF></TYPE-REFERENCE>"
          "</CPP-IMPLEMENTATION-DATA-TYPE-ELEMENT><CPP-IMPLEMENTATION-DATA-TYPE-ELEMENT><SHORT-NAME>map</"
          "SHORT-NAME>"
          "<TYPE-REFERENCE><TYPE-REFERENCE-REF DEST=\"X\">/P/Map</TYPE-REFERENCE-REF></TYPE-REFERENCE>"
          "</CPP-IMPLEMENTATION-DATA-TYPE-ELEMENT></SUB-ELEMENTS></STD-CPP-IMPLEMENTATION-DATA-TYPE>",
      "/P/All",
      "<BYTE-ORDER>MOST-SIGNIFICANT-BYTE-LAST</BYTE-ORDER>"
      "<IMPLEMENTS-LEGACY-STRING-SERIALIZATION>true</IMPLEMENTS-LEGACY-STRING-SERIALIZATION>"
      "<SIZE-OF-ARRAY-LENGTH-FIELD>2</SIZE-OF-ARRAY-LENGTH-FIELD><SIZE-OF-STRING-LENGTH-FIELD>1"
      "</SIZE-OF-STRING-LENGTH-FIELD><SIZE-OF-STRUCT-LENGTH-FIELD>4</SIZE-OF-STRUCT-LENGTH-FIELD>"
      "<SIZE-OF-UNION-LENGTH-FIELD>1</SIZE-OF-UNION-LENGTH-FIELD>"
      "<SIZE-OF-UNION-TYPE-SELECTOR-FIELD>2</SIZE-OF-UNION-TYPE-SELECTOR-FIELD>");
  const Reading reading = read_texts({text});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  const Model& model = reading.model;
  const Payload& payload = model.services[0].events[0].payload;
  EXPECT_EQ(payload.byte_order, std::endian::little);
  EXPECT_TRUE(payload.length_fields_always_big);
  EXPECT_EQ(payload.values[0].wire.length, someip::FieldWidth::bits32);
  const Type& all = resolved(model, payload.values[0].type);
  ASSERT_EQ(all.members.size(), 2U);
  const Type& either = resolved(model, all.members[0].type);
  EXPECT_EQ(either.kind, Kind::choice);
  EXPECT_EQ(all.members[0].wire.length, someip::FieldWidth::bits8);
  EXPECT_EQ(all.members[0].wire.selector, someip::FieldWidth::bits16);
  EXPECT_EQ(either.members[0].wire.length, someip::FieldWidth::bits8);
  EXPECT_FALSE(either.members[0].wire.bom);
  EXPECT_FALSE(either.members[0].wire.terminator);
  const Type& four = resolved(model, either.members[1].type);
  EXPECT_TRUE(four.fixed_size);
  EXPECT_EQ(four.max_size, 4U);
  EXPECT_EQ(resolved(model, four.element.type).primitive, messages::Primitive::uint16);
  const Type& map = resolved(model, all.members[1].type);
  EXPECT_EQ(map.kind, Kind::map);
  EXPECT_EQ(map.element.wire.length, someip::FieldWidth::bits16);
}

std::string element(std::string_view name, std::string_view category, std::string_view inner) {
  return "<IMPLEMENTATION-DATA-TYPE-ELEMENT><SHORT-NAME>" + std::string{name} + "</SHORT-NAME><CATEGORY>" +
         std::string{category} + "</CATEGORY>" + std::string{inner} + "</IMPLEMENTATION-DATA-TYPE-ELEMENT>";
}

TEST(ReadArxml, ReadsWhatATypeReferenceSaysOfItsNumber) {
  const auto reference = [](std::string_view name, std::string_view more) {
    return "<IMPLEMENTATION-DATA-TYPE><SHORT-NAME>" + std::string{name} +
           "</SHORT-NAME><CATEGORY>TYPE_REFERENCE</CATEGORY>" +
           props("<IMPLEMENTATION-DATA-TYPE-REF DEST=\"X\">/Platform/uint16</IMPLEMENTATION-DATA-TYPE-REF>" +
                 std::string{more}) +
           "</IMPLEMENTATION-DATA-TYPE>";
  };
  const auto member = [](std::string_view name, std::string_view type) {
    return element(name, "TYPE_REFERENCE",
                   props("<IMPLEMENTATION-DATA-TYPE-REF DEST=\"X\">/P/" + std::string{type} +
                         "</IMPLEMENTATION-DATA-TYPE-REF>"));
  };
  const Reading reading = read_texts({types(
      "<UNIT><SHORT-NAME>mps</SHORT-NAME><DISPLAY-NAME>m/s</DISPLAY-NAME></UNIT>"
      "<DATA-CONSTR><SHORT-NAME>Limits</SHORT-NAME><DATA-CONSTR-RULES><DATA-CONSTR-RULE><INTERNAL-CONSTRS>"
      "<LOWER-LIMIT>5</LOWER-LIMIT><UPPER-LIMIT>90</UPPER-LIMIT>"
      "</INTERNAL-CONSTRS></DATA-CONSTR-RULE></DATA-CONSTR-RULES></DATA-CONSTR>"
      "<COMPU-METHOD><SHORT-NAME>Same</SHORT-NAME><CATEGORY>IDENTICAL</CATEGORY>"
      "<UNIT-REF DEST=\"X\">/P/mps</UNIT-REF></COMPU-METHOD>"
      "<COMPU-METHOD><SHORT-NAME>Half</SHORT-NAME><CATEGORY>LINEAR</CATEGORY>"
      "<UNIT-REF DEST=\"X\">/P/mps</UNIT-REF><COMPU-INTERNAL-TO-PHYS><COMPU-SCALES><COMPU-SCALE>"
      "<COMPU-RATIONAL-COEFFS><COMPU-NUMERATOR><V>0</V><V>0.5</V></COMPU-NUMERATOR></COMPU-RATIONAL-COEFFS>"
      "</COMPU-SCALE></COMPU-SCALES></COMPU-INTERNAL-TO-PHYS></COMPU-METHOD>" +
          reference("Speed", "<COMPU-METHOD-REF DEST=\"X\">/P/Same</COMPU-METHOD-REF>") +
          reference("Scaled", "<COMPU-METHOD-REF DEST=\"X\">/P/Half</COMPU-METHOD-REF>") +
          reference("Limited", "<DATA-CONSTR-REF DEST=\"X\">/P/Limits</DATA-CONSTR-REF>") +
          "<IMPLEMENTATION-DATA-TYPE><SHORT-NAME>S</SHORT-NAME><CATEGORY>STRUCTURE</CATEGORY><SUB-ELEMENTS>" +
          member("a", "Speed") + member("b", "Scaled") + member("c", "Limited") +
          "</SUB-ELEMENTS></IMPLEMENTATION-DATA-TYPE>",
      "/P/S")});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  const Model& model = reading.model;
  const Type& type = resolved(model, model.services[0].events[0].payload.values[0].type);
  ASSERT_EQ(type.members.size(), 3U);
  EXPECT_EQ(model.at(type.members[0].type).notes.unit, "m/s");
  EXPECT_EQ(model.at(type.members[1].type).notes.unit, "m/s");
  EXPECT_EQ(model.at(type.members[1].type).notes.others.at("scale"), "0.5");
  EXPECT_EQ(model.at(type.members[2].type).name, "Limited");
  EXPECT_EQ(model.at(type.members[2].type).minimum, 5);
  EXPECT_EQ(model.at(type.members[2].type).maximum, 90);
}

TEST(ReadArxml, ReadsImplementationTypesEnumerationsAndArraysWithASizeIndicator) {
  const std::string value = props("<BASE-TYPE-REF DEST=\"X\">/P/u16</BASE-TYPE-REF>");
  const Reading reading = read_texts({types(
      "<UNIT><SHORT-NAME>kmh</SHORT-NAME><DISPLAY-NAME>km/h</DISPLAY-NAME></UNIT>"
      "<DATA-CONSTR><SHORT-NAME>Limits</SHORT-NAME><DATA-CONSTR-RULES><DATA-CONSTR-RULE><INTERNAL-CONSTRS>"
      "<LOWER-LIMIT INTERVAL-TYPE=\"CLOSED\">0</LOWER-LIMIT><UPPER-LIMIT "
      "INTERVAL-TYPE=\"OPEN\">101</UPPER-LIMIT>"
      "</INTERNAL-CONSTRS></DATA-CONSTR-RULE></DATA-CONSTR-RULES></DATA-CONSTR>"
      "<COMPU-METHOD><SHORT-NAME>Gears</SHORT-NAME><CATEGORY>TEXTTABLE</CATEGORY><COMPU-INTERNAL-TO-PHYS>"
      "<COMPU-SCALES><COMPU-SCALE><SYMBOL>PARK</SYMBOL><LOWER-LIMIT "
      "INTERVAL-TYPE=\"CLOSED\">0x1</LOWER-LIMIT>"
      "<UPPER-LIMIT INTERVAL-TYPE=\"CLOSED\">1</UPPER-LIMIT></COMPU-SCALE><COMPU-SCALE>"
      "<LOWER-LIMIT INTERVAL-TYPE=\"CLOSED\">2.0</LOWER-LIMIT><COMPU-CONST><VT>go on</VT></COMPU-CONST>"
      "</COMPU-SCALE></COMPU-SCALES></COMPU-INTERNAL-TO-PHYS></COMPU-METHOD>"
      "<IMPLEMENTATION-DATA-TYPE><SHORT-NAME>Dynamic</SHORT-NAME><CATEGORY>STRUCTURE</CATEGORY>"
      "<DYNAMIC-ARRAY-SIZE-PROFILE>VSA_LINEAR</DYNAMIC-ARRAY-SIZE-PROFILE><SUB-ELEMENTS>" +
          element("size", "VALUE", value) +
          element("data", "ARRAY",
                  "<SUB-ELEMENTS>" +
                      element("item", "VALUE",
                              "<ARRAY-SIZE>10</ARRAY-SIZE><ARRAY-SIZE-SEMANTICS>VARIABLE-SIZE"
                              "</ARRAY-SIZE-SEMANTICS>" +
                                  value) +
                      "</SUB-ELEMENTS>") +
          "</SUB-ELEMENTS></IMPLEMENTATION-DATA-TYPE>"
          "<IMPLEMENTATION-DATA-TYPE><SHORT-NAME>S</SHORT-NAME><CATEGORY>STRUCTURE</CATEGORY><SUB-ELEMENTS>" +
          element(
              "gear", "VALUE",
              props("<BASE-TYPE-REF DEST=\"X\">/P/u16</BASE-TYPE-REF><COMPU-METHOD-REF DEST=\"X\">/P/Gears"
                    "</COMPU-METHOD-REF>")) +
          element(
              "speed", "VALUE",
              props("<BASE-TYPE-REF DEST=\"X\">/P/u16</BASE-TYPE-REF><DATA-CONSTR-REF DEST=\"X\">/P/Limits"
                    "</DATA-CONSTR-REF><UNIT-REF DEST=\"X\">/P/kmh</UNIT-REF>")) +
          element(
              "list", "TYPE_REFERENCE",
              props("<IMPLEMENTATION-DATA-TYPE-REF DEST=\"X\">/P/Dynamic</IMPLEMENTATION-DATA-TYPE-REF>")) +
          element("matrix", "ARRAY",
                  "<SUB-ELEMENTS>" +
                      element("row", "ARRAY",
                              "<ARRAY-SIZE>2</ARRAY-SIZE><SUB-ELEMENTS>" +
                                  element("cell", "VALUE", "<ARRAY-SIZE>3</ARRAY-SIZE>" + value) +
                                  "</SUB-ELEMENTS>") +
                      "</SUB-ELEMENTS>") +
          "</SUB-ELEMENTS></IMPLEMENTATION-DATA-TYPE>",
      "/P/S")});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  const Model& model = reading.model;
  const Type& type = resolved(model, model.services[0].events[0].payload.values[0].type);
  ASSERT_EQ(type.members.size(), 4U);
  const Type& gear = resolved(model, type.members[0].type);
  ASSERT_EQ(gear.enumerators.size(), 2U);
  EXPECT_EQ(gear.name, "Gears");
  EXPECT_EQ(gear.enumerators[0].name, "PARK");
  EXPECT_EQ(gear.enumerators[1].name, "go_on");
  EXPECT_EQ(gear.enumerators[1].value, 2);
  EXPECT_EQ(type.members[1].notes.unit, "km/h");
  EXPECT_EQ(resolved(model, type.members[1].type).maximum, 100);
  const Type& list = resolved(model, type.members[2].type);
  EXPECT_EQ(list.kind, Kind::array);
  EXPECT_FALSE(list.fixed_size);
  EXPECT_EQ(list.max_size, 10U);
  const Type& matrix = resolved(model, type.members[3].type);
  EXPECT_EQ(matrix.max_size, 2U);
  EXPECT_EQ(resolved(model, matrix.element.type).max_size, 3U);
  EXPECT_EQ(type.members[3].wire.length, someip::FieldWidth::none);
}

/// A table of texts for 0 and 1.
std::string texts(std::string_view name) {
  std::string scales;
  for (const char digit : {'0', '1'}) {
    scales += std::string{"<COMPU-SCALE><LOWER-LIMIT>"} + digit + "</LOWER-LIMIT><UPPER-LIMIT>" + digit +
              "</UPPER-LIMIT><COMPU-CONST><VT>T" + digit + "</VT></COMPU-CONST></COMPU-SCALE>";
  }
  return "<COMPU-METHOD><SHORT-NAME>" + std::string{name} +
         "</SHORT-NAME><CATEGORY>TEXTTABLE</CATEGORY><COMPU-INTERNAL-TO-PHYS><COMPU-SCALES>" + scales +
         "</COMPU-SCALES></COMPU-INTERNAL-TO-PHYS></COMPU-METHOD>";
}

std::string reference_type(std::string_view name, std::string_view inner) {
  return "<IMPLEMENTATION-DATA-TYPE><SHORT-NAME>" + std::string{name} +
         "</SHORT-NAME><CATEGORY>TYPE_REFERENCE</CATEGORY>" + props(inner) + "</IMPLEMENTATION-DATA-TYPE>";
}

TEST(ReadArxml, ReadsEnumerationsThatReferToANumber) {
  const std::string to_u16 =
      "<IMPLEMENTATION-DATA-TYPE-REF DEST=\"X\">/AUTOSAR/uint16</IMPLEMENTATION-DATA-TYPE-REF>";
  const std::string table = "<COMPU-METHOD-REF DEST=\"X\">/P/Texts</COMPU-METHOD-REF>";
  const Reading reading = read_texts({arxml(
      texts("Texts") + texts("Others") + reference_type("Classic", table + to_u16) +
      "<STD-CPP-IMPLEMENTATION-DATA-TYPE><SHORT-NAME>Cpp</SHORT-NAME><CATEGORY>TYPE_REFERENCE</CATEGORY>" +
      props(table) +
      "<TYPE-REFERENCE-REF DEST=\"X\">/AUTOSAR/StdTypes/uint16_t</TYPE-REFERENCE-REF>"
      "</STD-CPP-IMPLEMENTATION-DATA-TYPE>" +
      // Of an enumeration: another name for it with the same texts, another one with its own.
      reference_type("Same", table + "<IMPLEMENTATION-DATA-TYPE-REF DEST=\"X\">/P/Classic"
                                     "</IMPLEMENTATION-DATA-TYPE-REF>") +
      reference_type("Other",
                     "<COMPU-METHOD-REF DEST=\"X\">/P/Others</COMPU-METHOD-REF>"
                     "<IMPLEMENTATION-DATA-TYPE-REF DEST=\"X\">/P/Classic"
                     "</IMPLEMENTATION-DATA-TYPE-REF>") +
      "<IMPLEMENTATION-DATA-TYPE><SHORT-NAME>Holder</SHORT-NAME><CATEGORY>STRUCTURE</CATEGORY><SUB-ELEMENTS>"
      "<IMPLEMENTATION-DATA-TYPE-ELEMENT><SHORT-NAME>m</SHORT-NAME><CATEGORY>TYPE_REFERENCE</CATEGORY>" +
      props(table + to_u16) +
      "</IMPLEMENTATION-DATA-TYPE-ELEMENT></SUB-ELEMENTS></IMPLEMENTATION-DATA-TYPE>" +
      service("<EVENTS>" + event("a", "/P/Classic") + event("b", "/P/Cpp") + event("c", "/P/Same") +
              event("d", "/P/Other") + event("e", "/P/Holder") + "</EVENTS>"))});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  EXPECT_EQ(field_type(reading, 0), "enumeration Classic");
  EXPECT_EQ(field_type(reading, 1), "enumeration Cpp");
  EXPECT_EQ(field_type(reading, 2), "enumeration Classic");
  EXPECT_EQ(field_type(reading, 3), "enumeration Other");
  const Model& model = reading.model;
  const Type& cpp = resolved(model, model.services[0].events[1].payload.values.at(0).type);
  EXPECT_EQ(cpp.primitive, messages::Primitive::uint16);
  ASSERT_EQ(cpp.enumerators.size(), 2U);
  EXPECT_EQ(cpp.enumerators[1].name, "T1");
  const Type& holder = resolved(model, model.services[0].events[4].payload.values.at(0).type);
  EXPECT_EQ(resolved(model, holder.members.at(0).type).kind, Kind::enumeration);
}

TEST(ReadArxml, ReadsReferencesThatStandInAnElement) {
  const auto in_element = [](std::string_view name, std::string_view target) {
    return "<IMPLEMENTATION-DATA-TYPE><SHORT-NAME>" + std::string{name} +
           "</SHORT-NAME><CATEGORY>TYPE_REF</CATEGORY><SUB-ELEMENTS><IMPLEMENTATION-DATA-TYPE-ELEMENT>"
           "<SHORT-NAME>x</SHORT-NAME><CATEGORY>TYPE_REFERENCE</CATEGORY>" +
           props("<IMPLEMENTATION-DATA-TYPE-REF DEST=\"X\">" + std::string{target} +
                 "</IMPLEMENTATION-DATA-TYPE-REF>") +
           "</IMPLEMENTATION-DATA-TYPE-ELEMENT></SUB-ELEMENTS></IMPLEMENTATION-DATA-TYPE>";
  };
  const Reading reading = read_texts({arxml(
      in_element("Number", "/ara/stdtypes/UInt16") + in_element("Whole", "/P/Both") +
      "<IMPLEMENTATION-DATA-TYPE><SHORT-NAME>Both</SHORT-NAME><CATEGORY>STRUCTURE</CATEGORY><SUB-ELEMENTS>"
      "<IMPLEMENTATION-DATA-TYPE-ELEMENT><SHORT-NAME>m</SHORT-NAME><CATEGORY>TYPE_REFERENCE</CATEGORY>" +
      props("<IMPLEMENTATION-DATA-TYPE-REF DEST=\"X\">/ara/stdtypes/UInt32</IMPLEMENTATION-DATA-TYPE-REF>") +
      "</IMPLEMENTATION-DATA-TYPE-ELEMENT></SUB-ELEMENTS></IMPLEMENTATION-DATA-TYPE>" +
      service("<EVENTS>" + event("a", "/P/Number") + event("b", "/P/Whole") + "</EVENTS>"))});
  EXPECT_THAT(problems_of(reading), HasSubstr("has its reference in a SUB-ELEMENT"));
  EXPECT_EQ(std::ranges::count(problems_of(reading), '\n'), 1) << problems_of(reading);
  const Model& model = reading.model;
  const Value& number = model.services.at(0).events.at(0).payload.values.at(0);
  EXPECT_EQ(model.at(number.type).name, "Number");
  EXPECT_EQ(resolved(model, number.type).primitive, messages::Primitive::uint16);
  EXPECT_EQ(field_type(reading, 1), "structure Both");
}

TEST(ReadArxml, TakesTheTypeOfCWhereABaseTypeHasNoEncoding) {
  const auto base = [](std::string_view name, std::string_view bits, std::string_view native) {
    return "<SW-BASE-TYPE><SHORT-NAME>" + std::string{name} + "Base</SHORT-NAME><BASE-TYPE-SIZE>" +
           std::string{bits} + "</BASE-TYPE-SIZE><NATIVE-DECLARATION>" + std::string{native} +
           "</NATIVE-DECLARATION></SW-BASE-TYPE><IMPLEMENTATION-DATA-TYPE><SHORT-NAME>" + std::string{name} +
           "</SHORT-NAME><CATEGORY>VALUE</CATEGORY>" +
           props("<BASE-TYPE-REF DEST=\"X\">/P/" + std::string{name} + "Base</BASE-TYPE-REF>") +
           "</IMPLEMENTATION-DATA-TYPE>";
  };
  const Reading reading = read_texts({arxml(base("A", "16", "signed short") + base("B", "32", "float") +
                                            base("C", "8", "int8_t") + base("D", "16", "unsigned short") +
                                            service("<EVENTS>" + event("a", "/P/A") + event("b", "/P/B") +
                                                    event("c", "/P/C") + event("d", "/P/D") + "</EVENTS>"))});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  const auto primitive = [&](std::size_t index) {
    const Model& model = reading.model;
    return resolved(model, model.services.at(0).events.at(index).payload.values.at(0).type).primitive;
  };
  EXPECT_EQ(primitive(0), messages::Primitive::int16);
  EXPECT_EQ(primitive(1), messages::Primitive::float32);
  EXPECT_EQ(primitive(2), messages::Primitive::int8);
  EXPECT_EQ(primitive(3), messages::Primitive::uint16);
}

TEST(ReadArxml, FollowsTheReferenceOfAValueWithoutABaseType) {
  const Reading reading = read_texts(
      {arxml("<STD-CPP-IMPLEMENTATION-DATA-TYPE><SHORT-NAME>Speed</SHORT-NAME><CATEGORY>VALUE</CATEGORY>"
             "<TYPE-REFERENCE-REF DEST=\"X\">/AUTOSAR/StdTypes/uint32_t</TYPE-REFERENCE-REF>"
             "</STD-CPP-IMPLEMENTATION-DATA-TYPE>" +
             service("<EVENTS>" + event("a", "/P/Speed") + "</EVENTS>"))});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  const Model& model = reading.model;
  EXPECT_EQ(resolved(model, model.services.at(0).events.at(0).payload.values.at(0).type).primitive,
            messages::Primitive::uint32);
}

TEST(ReadArxml, ReadsTagsOptionalMembersAndRulesForOneMember) {
  const std::string struct_type =
      "<IMPLEMENTATION-DATA-TYPE><SHORT-NAME>List</SHORT-NAME><CATEGORY>VECTOR</CATEGORY><SUB-ELEMENTS>" +
      element("item", "VALUE", props("<BASE-TYPE-REF DEST=\"X\">/P/u16</BASE-TYPE-REF>")) +
      "</SUB-ELEMENTS></IMPLEMENTATION-DATA-TYPE>"
      "<IMPLEMENTATION-DATA-TYPE><SHORT-NAME>S</SHORT-NAME><CATEGORY>STRUCTURE</CATEGORY><SUB-ELEMENTS>" +
      element("a", "TYPE_REFERENCE",
              "<IS-OPTIONAL>true</IS-OPTIONAL>" +
                  props("<IMPLEMENTATION-DATA-TYPE-REF DEST=\"X\">/P/List</IMPLEMENTATION-DATA-TYPE-REF>")) +
      element("b", "TYPE_REFERENCE",
              props("<IMPLEMENTATION-DATA-TYPE-REF DEST=\"X\">/P/List</IMPLEMENTATION-DATA-TYPE-REF>")) +
      "</SUB-ELEMENTS></IMPLEMENTATION-DATA-TYPE>"
      "<TLV-DATA-ID-DEFINITION-SET><SHORT-NAME>Ids</"
      "SHORT-NAME><TLV-DATA-ID-DEFINITIONS><TLV-DATA-ID-DEFINITION>"
      "<ID>4</ID><TLV-IMPLEMENTATION-DATA-TYPE-ELEMENT-REF DEST=\"X\">/P/S/a"
      "</TLV-IMPLEMENTATION-DATA-TYPE-ELEMENT-REF></TLV-DATA-ID-DEFINITION></TLV-DATA-ID-DEFINITIONS>"
      "</TLV-DATA-ID-DEFINITION-SET>"
      "<TRANSFORMATION-PROPS-SET><SHORT-NAME>Special</SHORT-NAME><TRANSFORMATION-PROPSS>"
      "<AP-SOMEIP-TRANSFORMATION-PROPS><SHORT-NAME>One</SHORT-NAME><SIZE-OF-ARRAY-LENGTH-FIELD>1"
      "</SIZE-OF-ARRAY-LENGTH-FIELD></AP-SOMEIP-TRANSFORMATION-PROPS></TRANSFORMATION-PROPSS>"
      "</TRANSFORMATION-PROPS-SET><SOMEIP-DATA-PROTOTYPE-TRANSFORMATION-PROPS><SHORT-NAME>Only</SHORT-NAME>"
      "<DATA-PROTOTYPES><DATA-PROTOTYPE-IN-SERVICE-INTERFACE-REF><ELEMENT-IN-IMPL-DATATYPE>"
      "<ROOT-DATA-PROTOTYPE-REF DEST=\"X\">/P/Door/e</ROOT-DATA-PROTOTYPE-REF>"
      "<TARGET-DATA-PROTOTYPE-REF DEST=\"X\">/P/S/b</TARGET-DATA-PROTOTYPE-REF></ELEMENT-IN-IMPL-DATATYPE>"
      "</DATA-PROTOTYPE-IN-SERVICE-INTERFACE-REF></DATA-PROTOTYPES><SOMEIP-TRANSFORMATION-PROPS-REF "
      "DEST=\"X\">"
      "/P/Special/One</SOMEIP-TRANSFORMATION-PROPS-REF></SOMEIP-DATA-PROTOTYPE-TRANSFORMATION-PROPS>";
  const Reading reading =
      read_texts({types(struct_type, "/P/S", "<SIZE-OF-ARRAY-LENGTH-FIELD>2</SIZE-OF-ARRAY-LENGTH-FIELD>")});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  const Type& type = resolved(reading.model, reading.model.services[0].events[0].payload.values[0].type);
  EXPECT_EQ(type.members[0].tag, someip::DataId{4});
  EXPECT_TRUE(type.members[0].optional);
  EXPECT_EQ(type.members[0].wire.length, someip::FieldWidth::bits16);
  EXPECT_EQ(type.members[1].wire.length, someip::FieldWidth::bits8);
  EXPECT_FALSE(type.members[1].tag.has_value());
}

/// A tag of wire type 4 means the length field of the member's type.
TEST(ReadArxml, TakesTheLengthFieldsOfTaggedMembersFromTheirTypes) {
  const auto event_with = [](std::initializer_list<std::string_view> tagged, std::string_view rules) {
    std::string elements =
        "<IMPLEMENTATION-DATA-TYPE><SHORT-NAME>List</SHORT-NAME><CATEGORY>VECTOR</CATEGORY><SUB-ELEMENTS>" +
        element("item", "VALUE", props("<BASE-TYPE-REF DEST=\"X\">/P/u16</BASE-TYPE-REF>")) +
        "</SUB-ELEMENTS></IMPLEMENTATION-DATA-TYPE>"
        "<IMPLEMENTATION-DATA-TYPE><SHORT-NAME>Inner</SHORT-NAME><CATEGORY>STRUCTURE</"
        "CATEGORY><SUB-ELEMENTS>" +
        element("x", "VALUE", props("<BASE-TYPE-REF DEST=\"X\">/P/u16</BASE-TYPE-REF>")) +
        "</SUB-ELEMENTS></IMPLEMENTATION-DATA-TYPE>"
        "<IMPLEMENTATION-DATA-TYPE><SHORT-NAME>S</SHORT-NAME><CATEGORY>STRUCTURE</CATEGORY><SUB-ELEMENTS>";
    for (const auto& [name, type] : {std::pair{"list", "List"}, {"inner", "Inner"}}) {
      elements += element(name, "TYPE_REFERENCE",
                          props("<IMPLEMENTATION-DATA-TYPE-REF DEST=\"X\">/P/" + std::string{type} +
                                "</IMPLEMENTATION-DATA-TYPE-REF>"));
    }
    elements +=
        "</SUB-ELEMENTS></IMPLEMENTATION-DATA-TYPE>"
        "<TLV-DATA-ID-DEFINITION-SET><SHORT-NAME>Ids</SHORT-NAME><TLV-DATA-ID-DEFINITIONS>";
    for (const std::string_view name : tagged) {
      elements += "<TLV-DATA-ID-DEFINITION><ID>" + std::to_string(name.size()) +
                  "</ID><TLV-IMPLEMENTATION-DATA-TYPE-ELEMENT-REF DEST=\"X\">/P/S/" + std::string{name} +
                  "</TLV-IMPLEMENTATION-DATA-TYPE-ELEMENT-REF></TLV-DATA-ID-DEFINITION>";
    }
    elements += "</TLV-DATA-ID-DEFINITIONS></TLV-DATA-ID-DEFINITION-SET>";
    return read_texts({types(elements, "/P/S", rules)});
  };
  constexpr std::string_view unlike =
      "<SIZE-OF-ARRAY-LENGTH-FIELD>1</SIZE-OF-ARRAY-LENGTH-FIELD>"
      "<SIZE-OF-STRUCT-LENGTH-FIELD>2</SIZE-OF-STRUCT-LENGTH-FIELD>";
  const auto payload = [](const Reading& reading) {
    return reading.model.services.at(0).events.at(0).payload;
  };

  const Reading arrays = event_with({"list"}, unlike);
  EXPECT_THAT(problems_of(arrays), IsEmpty());
  EXPECT_EQ(payload(arrays).tagged_length, someip::FieldWidth::bits8);
  EXPECT_EQ(payload(event_with({"inner"}, unlike)).tagged_length, someip::FieldWidth::bits16);

  const Reading both = event_with({"list", "inner"}, unlike);
  EXPECT_TRUE(both.ok());
  EXPECT_THAT(problems_of(both),
              testing::ContainsRegex(
                  "0.arxml:[0-9]+:[0-9]+: warning: the members with TLV data ids in /P/Door/e have "
                  "length fields of 1 and 2 bytes, and only one width"));
  EXPECT_FALSE(payload(both).known);
  EXPECT_THAT(payload(both).values, IsEmpty());

  const Reading smallest =
      event_with({"list", "inner"},
                 std::string{unlike} + "<IS-DYNAMIC-LENGTH-FIELD-SIZE>true</IS-DYNAMIC-LENGTH-FIELD-SIZE>");
  EXPECT_THAT(problems_of(smallest), IsEmpty());
  EXPECT_TRUE(payload(smallest).smallest_tagged_length);
  EXPECT_TRUE(payload(smallest).known);
}

TEST(ReadArxml, ReadsApplicationTypesThroughTheirMappings) {
  const Reading reading = read_texts({types(
      "<IMPLEMENTATION-DATA-TYPE><SHORT-NAME>Impl</SHORT-NAME><CATEGORY>VALUE</CATEGORY>" +
          props("<BASE-TYPE-REF DEST=\"X\">/P/s32</BASE-TYPE-REF>") +
          "</IMPLEMENTATION-DATA-TYPE><APPLICATION-PRIMITIVE-DATA-TYPE><SHORT-NAME>Angle</SHORT-NAME>"
          "<CATEGORY>VALUE</CATEGORY></APPLICATION-PRIMITIVE-DATA-TYPE><APPLICATION-RECORD-DATA-TYPE>"
          "<SHORT-NAME>Pose</SHORT-NAME><CATEGORY>STRUCTURE</CATEGORY><ELEMENTS><APPLICATION-RECORD-ELEMENT>"
          "<SHORT-NAME>yaw</SHORT-NAME><TYPE-TREF "
          "DEST=\"X\">/P/Angle</TYPE-TREF></APPLICATION-RECORD-ELEMENT>"
          "</ELEMENTS></APPLICATION-RECORD-DATA-TYPE><DATA-TYPE-MAPPING-SET><SHORT-NAME>Maps</SHORT-NAME>"
          "<DATA-TYPE-MAPS><DATA-TYPE-MAP><APPLICATION-DATA-TYPE-REF DEST=\"X\">/P/Angle"
          "</APPLICATION-DATA-TYPE-REF><IMPLEMENTATION-DATA-TYPE-REF DEST=\"X\">/P/Impl"
          "</IMPLEMENTATION-DATA-TYPE-REF></DATA-TYPE-MAP></DATA-TYPE-MAPS></DATA-TYPE-MAPPING-SET>",
      "/P/Pose")});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  EXPECT_EQ(field_type(reading), "structure Pose");
  const Type& pose = resolved(reading.model, reading.model.services[0].events[0].payload.values[0].type);
  EXPECT_EQ(resolved(reading.model, pose.members[0].type).primitive, messages::Primitive::int32);
}

TEST(ReadArxml, JoinsPackagesAndFollowsReferencesOverFiles) {
  const std::string door = arxml(service("<EVENTS>" + event("e", "/P/Speed") + "</EVENTS>"));
  const std::string type = arxml(
      std::string{base_types} +
      "<STD-CPP-IMPLEMENTATION-DATA-TYPE><SHORT-NAME>Speed</SHORT-NAME><CATEGORY>VALUE</CATEGORY>" +
      props("<BASE-TYPE-REF DEST=\"X\">/P/u16</BASE-TYPE-REF>") + "</STD-CPP-IMPLEMENTATION-DATA-TYPE>");
  const Reading reading = read_texts({door, type});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  EXPECT_EQ(field_type(reading), "primitive ");
  EXPECT_THAT(
      problems_of(read_texts({door})),
      HasSubstr("error: the type /P/Speed is in none of the files: read the file that has it as well"));
}

TEST(ReadArxml, LeavesOutUnusedTypesOfWhichAPartIsMissing) {
  const auto reference = [](const char* name, const char* target) {
    return "<IMPLEMENTATION-DATA-TYPE><SHORT-NAME>" + std::string{name} +
           "</SHORT-NAME><CATEGORY>STRUCTURE</CATEGORY><SUB-ELEMENTS><IMPLEMENTATION-DATA-TYPE-ELEMENT>"
           "<SHORT-NAME>part</SHORT-NAME><CATEGORY>TYPE_REFERENCE</CATEGORY>" +
           props("<IMPLEMENTATION-DATA-TYPE-REF DEST=\"X\">" + std::string{target} +
                 "</IMPLEMENTATION-DATA-TYPE-REF>") +
           "</IMPLEMENTATION-DATA-TYPE-ELEMENT></SUB-ELEMENTS></IMPLEMENTATION-DATA-TYPE>";
  };
  const std::string types = reference("Whole", "/P/Half") + reference("Half", "/Elsewhere/Part") +
                            reference("Good", "/AUTOSAR/uint8");
  const Reading reading =
      read_texts({arxml(types + service("<EVENTS>" + event("e", "/P/Good") + "</EVENTS>"))});
  EXPECT_TRUE(reading.ok());
  EXPECT_THAT(problems_of(reading),
              ContainsRegex("^[^\n]*warning: the type /Elsewhere/Part is in none of the files; no "
                            "service needs it, and what consists of it is left out\n$"));
  for (const Type& type : reading.model.types) {
    EXPECT_TRUE(type.name != "Whole" && type.name != "Half") << type.name;
  }
  EXPECT_FALSE(read_texts({arxml(types + service("<EVENTS>" + event("e", "/P/Whole") + "</EVENTS>"))}).ok());
}

TEST(ReadArxml, KnowsArraysOfStandardTypesByTheirNames) {
  const Reading reading =
      read_texts({arxml(service("<EVENTS>" + event("e", "/ara/stdtypes/UInt16Array12") + "</EVENTS>"))});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  const Type& type =
      resolved(reading.model, reading.model.services.at(0).events.at(0).payload.values.at(0).type);
  EXPECT_EQ(type.kind, Kind::array);
  EXPECT_EQ(type.max_size, 12U);
  EXPECT_TRUE(type.fixed_size);
  EXPECT_EQ(resolved(reading.model, type.element.type).primitive, messages::Primitive::uint16);
  EXPECT_FALSE(
      read_texts({arxml(service("<EVENTS>" + event("e", "/ara/stdtypes/PartArray12") + "</EVENTS>"))}).ok());
}

TEST(ReadArxml, TakesAServiceIdOfNothingForNone) {
  const Reading reading = read_texts({arxml(
      service("") +
      "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>D</SHORT-NAME><SERVICE-INTERFACE-REF DEST=\"X\">"
      "/P/Door</SERVICE-INTERFACE-REF><SERVICE-INTERFACE-ID>0</SERVICE-INTERFACE-ID>"
      "</SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>")});
  EXPECT_TRUE(reading.ok());
  EXPECT_THAT(problems_of(reading), HasSubstr("warning: SERVICE-INTERFACE-ID 0 is reserved"));
  EXPECT_FALSE(reading.model.services.at(0).id);
}

TEST(ReadArxml, CallsASecondMemberOfOneNameAnother) {
  const std::string element =
      "<CPP-IMPLEMENTATION-DATA-TYPE-ELEMENT><SHORT-NAME>x</SHORT-NAME><TYPE-REFERENCE><TYPE-REFERENCE-REF "
      "DEST=\"X\">/ara/stdtypes/uint8_t</TYPE-REFERENCE-REF></TYPE-REFERENCE></"
      "CPP-IMPLEMENTATION-DATA-TYPE-ELEMENT>";
  const Reading reading =
      read_texts({arxml(service("<EVENTS>" + event("e", "/P/Pair") + "</EVENTS>") +
                        "<STD-CPP-IMPLEMENTATION-DATA-TYPE><SHORT-NAME>Pair</SHORT-NAME><CATEGORY>STRUCTURE</"
                        "CATEGORY><SUB-ELEMENTS>" +
                        element + element + element + "</SUB-ELEMENTS></STD-CPP-IMPLEMENTATION-DATA-TYPE>")});
  EXPECT_TRUE(reading.ok());
  EXPECT_THAT(problems_of(reading), HasSubstr("warning: there is a member x before: this one is called x_2"));
  const Type& type =
      resolved(reading.model, reading.model.services.at(0).events.at(0).payload.values.at(0).type);
  ASSERT_EQ(type.members.size(), 3U);
  EXPECT_EQ(type.members[1].name, "x_2");
  EXPECT_EQ(type.members[2].name, "x_3");
}

TEST(ReadArxml, KnowsEncodingsByOtherNames) {
  const auto encoded = [](const std::string& encoding, const std::string& text) {
    std::string file = arxml(service("<DESC><L-2 L=\"EN\">" + text + "</L-2></DESC>"));
    file.replace(file.find("UTF-8"), 5, encoding);
    return read_texts({file});
  };
  EXPECT_EQ(encoded("ASCII", "door").model.services.at(0).notes.description, "door");
  EXPECT_FALSE(encoded("ASCII", "T\xfcr").ok());
  EXPECT_EQ(encoded("latin1", "T\xfcr").model.services.at(0).notes.description, "T\u00fcr");
  EXPECT_EQ(encoded("windows-1252", "T\xfcr \x80").model.services.at(0).notes.description, "T\u00fcr \u20ac");
  EXPECT_THAT(problems_of(encoded("klingon", "door")), HasSubstr("unknown encoding"));
}

TEST(ReadArxml, LeavesOutASecondMemberOfOneName) {
  const std::string operation =
      "<CLIENT-SERVER-OPERATION><SHORT-NAME>open</SHORT-NAME></CLIENT-SERVER-OPERATION>";
  const std::string field =
      "<FIELD><SHORT-NAME>f</SHORT-NAME><TYPE-TREF DEST=\"X\">/ara/stdtypes/uint16_t</TYPE-TREF></FIELD>";
  const Reading reading = read_texts({arxml(service(
      "<EVENTS>" + event("moved", "/ara/stdtypes/uint16_t") + event("moved", "/ara/stdtypes/uint8_t") +
      "</EVENTS><FIELDS>" + field + field + "</FIELDS><METHODS>" + operation + operation + "</METHODS>"))});
  EXPECT_TRUE(reading.ok()) << problems_of(reading);
  const Service& door = reading.model.services.at(0);
  EXPECT_EQ(door.events.size(), 1U);
  EXPECT_EQ(door.methods.size(), 1U);
  EXPECT_EQ(door.fields.size(), 1U);
  for (const char* name : {"moved", "open", "f"}) {
    EXPECT_THAT(
        problems_of(reading),
        ContainsRegex("/P/Door/" + std::string{name} +
                      " is there twice: this one is left out, the one at 0.arxml:[0-9]+:[0-9]+ is taken"));
  }
}

TEST(ReadArxml, TellsWhereBothStandThatHaveOneName) {
  const Reading reading =
      read_texts({arxml(""), arxml("\n" + std::string{service("")} + "\n  " + std::string{service("")})});
  EXPECT_THAT(problems_of(reading),
              HasSubstr("1.arxml:4:3: warning: /P/Door is declared twice; references mean "
                        "the one at 1.arxml:3:1\n"));
}

TEST(ReadArxml, TellsThatAMethodIdOfZeroIsNone) {
  const Reading reading = read_texts({arxml(
      service("<METHODS><CLIENT-SERVER-OPERATION><SHORT-NAME>open</SHORT-NAME></CLIENT-SERVER-OPERATION>"
              "</METHODS>") +
      "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</SHORT-NAME><METHOD-DEPLOYMENTS>"
      "<SOMEIP-METHOD-DEPLOYMENT><SHORT-NAME>o</SHORT-NAME><METHOD-REF DEST=\"X\">/P/Door/open</METHOD-REF>"
      "<METHOD-ID>0x0</METHOD-ID></SOMEIP-METHOD-DEPLOYMENT></METHOD-DEPLOYMENTS>"
      "<SERVICE-INTERFACE-REF DEST=\"X\">/P/Door</SERVICE-INTERFACE-REF>"
      "<SERVICE-INTERFACE-ID>4660</SERVICE-INTERFACE-ID></SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>")});
  EXPECT_TRUE(reading.ok());
  EXPECT_FALSE(reading.model.services.at(0).methods.at(0).id.has_value());
  EXPECT_THAT(problems_of(reading), HasSubstr("warning: METHOD-ID 0 is reserved: it counts as not given"));
}

TEST(ReadArxml, DoesNotKnowThePayloadsOfADeploymentWithoutItsInterface) {
  const Reading reading = read_texts({arxml(
      "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</SHORT-NAME><EVENT-DEPLOYMENTS>"
      "<SOMEIP-EVENT-DEPLOYMENT><SHORT-NAME>m</SHORT-NAME><EVENT-REF DEST=\"X\">/P/Door/moved</EVENT-REF>"
      "<EVENT-ID>0x8001</EVENT-ID></SOMEIP-EVENT-DEPLOYMENT></EVENT-DEPLOYMENTS><METHOD-DEPLOYMENTS>"
      "<SOMEIP-METHOD-DEPLOYMENT><SHORT-NAME>o</SHORT-NAME><METHOD-REF DEST=\"X\">/P/Door/open</METHOD-REF>"
      "<METHOD-ID>7</METHOD-ID></SOMEIP-METHOD-DEPLOYMENT></METHOD-DEPLOYMENTS>"
      "<SERVICE-INTERFACE-REF DEST=\"X\">/P/Door</SERVICE-INTERFACE-REF>"
      "<SERVICE-INTERFACE-ID>4660</SERVICE-INTERFACE-ID></SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>")});
  EXPECT_THAT(problems_of(reading), HasSubstr("its types are not known"));
  const Service& door = reading.model.services.at(0);
  EXPECT_FALSE(door.events.at(0).payload.known);
  EXPECT_FALSE(door.methods.at(0).request.known);
  EXPECT_FALSE(door.methods.at(0).response.known);
}

TEST(ReadArxml, ReadsInstancesWithTheirMachines) {
  const Reading reading = read_texts({arxml(
      service("") +
      "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</SHORT-NAME>"
      "<SERVICE-INTERFACE-REF DEST=\"X\">/P/Door</SERVICE-INTERFACE-REF><EVENT-GROUPS><SOMEIP-EVENT-GROUP>"
      "<SHORT-NAME>G</SHORT-NAME><EVENT-GROUP-ID>3</EVENT-GROUP-ID></SOMEIP-EVENT-GROUP></EVENT-GROUPS>"
      "<SERVICE-INTERFACE-ID>0x20</SERVICE-INTERFACE-ID></SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>"
      "<PROVIDED-SOMEIP-SERVICE-INSTANCE><SHORT-NAME>Left</SHORT-NAME><SERVICE-INTERFACE-DEPLOYMENT-REF "
      "DEST=\"X\">"
      "/P/Dep</SERVICE-INTERFACE-DEPLOYMENT-REF><CAPABILITY-RECORDS><TAG-WITH-OPTIONAL-VALUE><KEY>side</KEY>"
      "<VALUE>left</VALUE></TAG-WITH-OPTIONAL-VALUE></CAPABILITY-RECORDS><PROVIDED-EVENT-GROUPS>"
      "<SOMEIP-PROVIDED-EVENT-GROUP><SHORT-NAME>g</SHORT-NAME><EVENT-GROUP-REF "
      "DEST=\"X\">/P/Dep/G</EVENT-GROUP-REF>"
      "<EVENT-MULTICAST-UDP-PORT>30600</EVENT-MULTICAST-UDP-PORT><IPV-4-MULTICAST-IP-ADDRESS>239.0.0.9"
      "</IPV-4-MULTICAST-IP-ADDRESS><MULTICAST-THRESHOLD>4</MULTICAST-THRESHOLD></"
      "SOMEIP-PROVIDED-EVENT-GROUP>"
      "</PROVIDED-EVENT-GROUPS><SD-SERVER-CONFIG-REF DEST=\"X\">/P/Sd</SD-SERVER-CONFIG-REF>"
      "<SERVICE-INSTANCE-ID>7</SERVICE-INSTANCE-ID></PROVIDED-SOMEIP-SERVICE-INSTANCE>"
      "<REQUIRED-SOMEIP-SERVICE-INSTANCE><SHORT-NAME>Any</SHORT-NAME><SERVICE-INTERFACE-DEPLOYMENT-REF "
      "DEST=\"X\">"
      "/P/Dep</SERVICE-INTERFACE-DEPLOYMENT-REF><REQUIRED-MINOR-VERSION>ANY</REQUIRED-MINOR-VERSION>"
      "<REQUIRED-SERVICE-INSTANCE-ID>ALL</REQUIRED-SERVICE-INSTANCE-ID></REQUIRED-SOMEIP-SERVICE-INSTANCE>"
      "<SOMEIP-SD-SERVER-SERVICE-INSTANCE-CONFIG><SHORT-NAME>Sd</SHORT-NAME><INITIAL-OFFER-BEHAVIOR>"
      "<INITIAL-DELAY-MAX-VALUE>0.05</INITIAL-DELAY-MAX-VALUE><INITIAL-DELAY-MIN-VALUE>0.01"
      "</INITIAL-DELAY-MIN-VALUE><INITIAL-REPETITIONS-MAX>2</INITIAL-REPETITIONS-MAX></"
      "INITIAL-OFFER-BEHAVIOR>"
      "<SERVICE-OFFER-TIME-TO-LIVE>5</SERVICE-OFFER-TIME-TO-LIVE></SOMEIP-SD-SERVER-SERVICE-INSTANCE-CONFIG>"
      "<MACHINE-DESIGN><SHORT-NAME>Ecu</"
      "SHORT-NAME><COMMUNICATION-CONNECTORS><ETHERNET-COMMUNICATION-CONNECTOR>"
      "<SHORT-NAME>Eth</SHORT-NAME><AP-APPLICATION-ENDPOINTS><AP-APPLICATION-ENDPOINT><SHORT-NAME>T</"
      "SHORT-NAME>"
      "<TP-CONFIGURATION><TCP-TP><TCP-TP-PORT><PORT-NUMBER>30502</PORT-NUMBER></TCP-TP-PORT></TCP-TP>"
      "</TP-CONFIGURATION></AP-APPLICATION-ENDPOINT></"
      "AP-APPLICATION-ENDPOINTS><UNICAST-NETWORK-ENDPOINT-REFS>"
      "<UNICAST-NETWORK-ENDPOINT-REF DEST=\"X\">/P/Net/Ch/A</UNICAST-NETWORK-ENDPOINT-REF>"
      "</UNICAST-NETWORK-ENDPOINT-REFS></ETHERNET-COMMUNICATION-CONNECTOR></COMMUNICATION-CONNECTORS>"
      "<SERVICE-DISCOVERY-CONFIGS><SOMEIP-SERVICE-DISCOVERY><MULTICAST-SD-IP-ADDRESS-REF "
      "DEST=\"X\">/P/Net/Ch/M"
      "</MULTICAST-SD-IP-ADDRESS-REF><SOMEIP-SERVICE-DISCOVERY-PORT>30490</SOMEIP-SERVICE-DISCOVERY-PORT>"
      "</SOMEIP-SERVICE-DISCOVERY></SERVICE-DISCOVERY-CONFIGS></MACHINE-DESIGN>"
      "<ETHERNET-CLUSTER><SHORT-NAME>Net</"
      "SHORT-NAME><ETHERNET-CLUSTER-VARIANTS><ETHERNET-CLUSTER-CONDITIONAL>"
      "<PHYSICAL-CHANNELS><ETHERNET-PHYSICAL-CHANNEL><SHORT-NAME>Ch</"
      "SHORT-NAME><NETWORK-ENDPOINTS><NETWORK-ENDPOINT>"
      "<SHORT-NAME>A</SHORT-NAME><NETWORK-ENDPOINT-ADDRESSES><IPV-4-CONFIGURATION><IPV-4-ADDRESS>10.0.0.1"
      "</IPV-4-ADDRESS></IPV-4-CONFIGURATION></NETWORK-ENDPOINT-ADDRESSES></"
      "NETWORK-ENDPOINT><NETWORK-ENDPOINT>"
      "<SHORT-NAME>M</SHORT-NAME><NETWORK-ENDPOINT-ADDRESSES><IPV-4-CONFIGURATION><IPV-4-ADDRESS>224.0.0.5"
      "</IPV-4-ADDRESS></IPV-4-CONFIGURATION></NETWORK-ENDPOINT-ADDRESSES></NETWORK-ENDPOINT></"
      "NETWORK-ENDPOINTS>"
      "</ETHERNET-PHYSICAL-CHANNEL></PHYSICAL-CHANNELS></ETHERNET-CLUSTER-CONDITIONAL></"
      "ETHERNET-CLUSTER-VARIANTS>"
      "</ETHERNET-CLUSTER><SOMEIP-SERVICE-INSTANCE-TO-MACHINE-MAPPING><SHORT-NAME>Here</SHORT-NAME>"
      "<COMMUNICATION-CONNECTOR-REF "
      "DEST=\"X\">/P/Ecu/Eth</COMMUNICATION-CONNECTOR-REF><SERVICE-INSTANCE-REFS>"
      "<SERVICE-INSTANCE-REF DEST=\"X\">/P/Left</SERVICE-INSTANCE-REF></SERVICE-INSTANCE-REFS>"
      "<TCP-PORT-REF DEST=\"X\">/P/Ecu/Eth/T</TCP-PORT-REF><UDP-PORT>30501</UDP-PORT>"
      "</SOMEIP-SERVICE-INSTANCE-TO-MACHINE-MAPPING>")});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  ASSERT_EQ(reading.model.instances.size(), 2U);
  const Instance& left = reading.model.instances[0];
  EXPECT_EQ(left.service, "/P/Door");
  EXPECT_EQ(left.id, someip::InstanceId{7});
  EXPECT_EQ(left.address, IpAddress::v4(10, 0, 0, 1));
  EXPECT_EQ(left.udp_port, 30501);
  EXPECT_EQ(left.tcp_port, 30502);
  EXPECT_EQ(left.machine, "Ecu");
  EXPECT_EQ(left.timing->initial_delay_max, 50ms);
  EXPECT_EQ(left.timing->ttl_s, 5U);
  EXPECT_EQ(left.configuration.at("side"), "left");
  EXPECT_THAT(left.multicast, ElementsAre(Multicast{.eventgroup = someip::EventgroupId{3},
                                                    .group = {IpAddress::v4(239, 0, 0, 9), 30600},
                                                    .threshold = 4}));
  EXPECT_EQ(reading.model.instances[1].role, Instance::Role::required);
  EXPECT_FALSE(reading.model.instances[1].id.has_value());
  EXPECT_EQ(reading.model.machines[0].sd_multicast, IpAddress::v4(224, 0, 0, 5));
}

TEST(ReadArxml, ReadsWhatAClientAsksOfVersionsAndSubscriptions) {
  const auto required = [](std::string_view name, std::string_view inner) {
    return "<REQUIRED-SOMEIP-SERVICE-INSTANCE><SHORT-NAME>" + std::string{name} +
           "</SHORT-NAME><SERVICE-INTERFACE-DEPLOYMENT-REF DEST=\"X\">/P/Dep"
           "</SERVICE-INTERFACE-DEPLOYMENT-REF>" +
           std::string{inner} + "</REQUIRED-SOMEIP-SERVICE-INSTANCE>";
  };
  const std::string minor = "<REQUIRED-MINOR-VERSION>1</REQUIRED-MINOR-VERSION>";
  const Reading reading = read_texts({arxml(
      service("") +
      "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</SHORT-NAME><SERVICE-INTERFACE-REF DEST=\"X\">"
      "/P/Door</SERVICE-INTERFACE-REF><EVENT-GROUPS><SOMEIP-EVENT-GROUP><SHORT-NAME>G</SHORT-NAME>"
      "<EVENT-GROUP-ID>1</EVENT-GROUP-ID></SOMEIP-EVENT-GROUP></EVENT-GROUPS>"
      "<SERVICE-INTERFACE-ID>1</SERVICE-INTERFACE-ID></SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>" +
      required("Exact", minor + "<VERSION-DRIVEN-FIND-BEHAVIOR>EXACT-OR-ANY-MINOR-VERSION"
                                "</VERSION-DRIVEN-FIND-BEHAVIOR>") +
      required("Least",
               "<BLOCKLISTED-VERSIONS><SOMEIP-SERVICE-VERSION><MAJOR-VERSION>2</MAJOR-VERSION>"
               "<MINOR-VERSION>0</MINOR-VERSION></SOMEIP-SERVICE-VERSION></BLOCKLISTED-VERSIONS>"
               "<REQUIRED-EVENT-GROUPS><SOMEIP-REQUIRED-EVENT-GROUP><SHORT-NAME>r</SHORT-NAME>"
               "<EVENT-GROUP-REF DEST=\"X\">/P/Dep/G</EVENT-GROUP-REF>"
               "<SD-CLIENT-EVENT-GROUP-TIMING-CONFIG-REF DEST=\"X\">/P/Tc"
               "</SD-CLIENT-EVENT-GROUP-TIMING-CONFIG-REF></SOMEIP-REQUIRED-EVENT-GROUP>"
               "</REQUIRED-EVENT-GROUPS>" +
                   minor +
                   "<VERSION-DRIVEN-FIND-BEHAVIOR>MINIMUM-MINOR-VERSION</VERSION-DRIVEN-FIND-BEHAVIOR>") +
      "<SOMEIP-SD-CLIENT-EVENT-GROUP-TIMING-CONFIG><SHORT-NAME>Tc</SHORT-NAME><TIME-TO-LIVE>7</TIME-TO-LIVE>"
      "</SOMEIP-SD-CLIENT-EVENT-GROUP-TIMING-CONFIG>")});
  ASSERT_EQ(reading.model.instances.size(), 2U);
  EXPECT_EQ(reading.model.instances[0].minor, 1U);
  const Instance& least = reading.model.instances[1];
  EXPECT_FALSE(least.minor.has_value()) << "Find cannot ask for at least 1";
  ASSERT_TRUE(least.timing.has_value());
  EXPECT_EQ(least.timing->ttl_s, 7U);
  EXPECT_THAT(problems_of(reading), HasSubstr("wants a minor version of at least 1"));
  EXPECT_THAT(problems_of(reading), HasSubstr("BLOCKLISTED-VERSIONS of /P/Least is not carried"));
}

TEST(ReadArxml, ReadsTheVersionAndSubscriptionsOfOldRequiredInstances) {
  const Reading reading = read_texts({arxml(
      service("") +
      "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</SHORT-NAME><SERVICE-INTERFACE-REF DEST=\"X\">"
      "/P/Door</SERVICE-INTERFACE-REF><EVENT-GROUPS><SOMEIP-EVENT-GROUP><SHORT-NAME>G</SHORT-NAME>"
      "<EVENT-GROUP-ID>1</EVENT-GROUP-ID></SOMEIP-EVENT-GROUP></EVENT-GROUPS>"
      "<SERVICE-INTERFACE-ID>1</SERVICE-INTERFACE-ID></SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>"
      "<REQUIRED-SOMEIP-SERVICE-INSTANCE><SHORT-NAME>Old</SHORT-NAME><SERVICE-INTERFACE-DEPLOYMENT-REF "
      "DEST=\"X\">/P/Dep</SERVICE-INTERFACE-DEPLOYMENT-REF><REQUIRED-EVENT-GROUPS>"
      "<SOMEIP-REQUIRED-EVENT-GROUP><SHORT-NAME>r</SHORT-NAME><EVENT-GROUP-REF DEST=\"X\">/P/Dep/G"
      "</EVENT-GROUP-REF><SD-CLIENT-EVENT-TIMING-CONFIG><TIME-TO-LIVE>9</TIME-TO-LIVE>"
      "</SD-CLIENT-EVENT-TIMING-CONFIG></SOMEIP-REQUIRED-EVENT-GROUP></REQUIRED-EVENT-GROUPS>"
      "<REQUIRED-SERVICE-VERSION><MAJOR-VERSION>3</MAJOR-VERSION><MINOR-VERSION>4</MINOR-VERSION>"
      "</REQUIRED-SERVICE-VERSION></REQUIRED-SOMEIP-SERVICE-INSTANCE>")});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  const Instance& old = reading.model.instances.at(0);
  EXPECT_EQ(old.major, 3);
  EXPECT_EQ(old.minor, 4U);
  ASSERT_TRUE(old.timing.has_value());
  EXPECT_EQ(old.timing->ttl_s, 9U);
}

TEST(ReadArxml, ReadsInstancesOfTheFirstReleases) {
  // R17-10: the reference to the deployment has another name, groups are at the mapping, machines are whole.
  const std::string text = arxml(
      service("") +
      "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</SHORT-NAME><SERVICE-INTERFACE-REF DEST=\"X\">"
      "/P/Door</SERVICE-INTERFACE-REF><EVENT-GROUPS><SOMEIP-EVENT-GROUP><SHORT-NAME>G</SHORT-NAME>"
      "<EVENT-GROUP-ID>1</EVENT-GROUP-ID></SOMEIP-EVENT-GROUP></EVENT-GROUPS>"
      "<SERVICE-INTERFACE-ID>0x1234</SERVICE-INTERFACE-ID></SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>"
      "<PROVIDED-SOMEIP-SERVICE-INSTANCE><SHORT-NAME>Left</SHORT-NAME><SERVICE-INTERFACE-REF DEST=\"X\">"
      "/P/Dep</SERVICE-INTERFACE-REF><PROVIDED-EVENT-GROUPS><SOMEIP-PROVIDED-EVENT-GROUP><SHORT-NAME>g"
      "</SHORT-NAME><EVENT-GROUP-REF DEST=\"X\">/P/Dep/G</EVENT-GROUP-REF><MULTICAST-THRESHOLD>3"
      "</MULTICAST-THRESHOLD></SOMEIP-PROVIDED-EVENT-GROUP></PROVIDED-EVENT-GROUPS><SD-SERVER-CONFIG>"
      "<CAPABILITY-RECORDS><TAG-WITH-OPTIONAL-VALUE><KEY>side</KEY><VALUE>left</VALUE>"
      "</TAG-WITH-OPTIONAL-VALUE></CAPABILITY-RECORDS></SD-SERVER-CONFIG>"
      "<SERVICE-INSTANCE-ID>7</SERVICE-INSTANCE-ID></PROVIDED-SOMEIP-SERVICE-INSTANCE>"
      "<REQUIRED-SOMEIP-SERVICE-INSTANCE><SHORT-NAME>Any</SHORT-NAME><SERVICE-INTERFACE-REF DEST=\"X\">"
      "/P/Door</SERVICE-INTERFACE-REF></REQUIRED-SOMEIP-SERVICE-INSTANCE>"
      "<MACHINE><SHORT-NAME>Ecu</SHORT-NAME><COMMUNICATION-CONNECTORS><ETHERNET-COMMUNICATION-CONNECTOR>"
      "<SHORT-NAME>Eth</SHORT-NAME><UNICAST-NETWORK-ENDPOINT-REF DEST=\"X\">/P/Net/Ch/A"
      "</UNICAST-NETWORK-ENDPOINT-REF></ETHERNET-COMMUNICATION-CONNECTOR></COMMUNICATION-CONNECTORS></"
      "MACHINE>"
      "<ETHERNET-CLUSTER><SHORT-NAME>Net</SHORT-NAME><ETHERNET-CLUSTER-VARIANTS>"
      "<ETHERNET-CLUSTER-CONDITIONAL><PHYSICAL-CHANNELS><ETHERNET-PHYSICAL-CHANNEL><SHORT-NAME>Ch"
      "</SHORT-NAME><NETWORK-ENDPOINTS><NETWORK-ENDPOINT><SHORT-NAME>A</SHORT-NAME>"
      "<NETWORK-ENDPOINT-ADDRESSES><IPV-4-CONFIGURATION><IPV-4-ADDRESS>10.0.0.1</IPV-4-ADDRESS>"
      "</IPV-4-CONFIGURATION></NETWORK-ENDPOINT-ADDRESSES></NETWORK-ENDPOINT></NETWORK-ENDPOINTS>"
      "</ETHERNET-PHYSICAL-CHANNEL></PHYSICAL-CHANNELS></ETHERNET-CLUSTER-CONDITIONAL>"
      "</ETHERNET-CLUSTER-VARIANTS></ETHERNET-CLUSTER>"
      "<SOMEIP-SERVICE-INSTANCE-TO-MACHINE-MAPPING><SHORT-NAME>M</SHORT-NAME>"
      "<COMMUNICATION-CONNECTOR-REF DEST=\"X\">/P/Ecu/Eth</COMMUNICATION-CONNECTOR-REF>"
      "<SERVICE-INSTANCE-REF DEST=\"X\">/P/Left</SERVICE-INSTANCE-REF>"
      "<EVENT-MULTICAST-UDP-PORT>30600</EVENT-MULTICAST-UDP-PORT>"
      "<IPV-4-MULTICAST-IP-ADDRESS>239.0.0.9</IPV-4-MULTICAST-IP-ADDRESS><UDP-PORT>30501</UDP-PORT>"
      "</SOMEIP-SERVICE-INSTANCE-TO-MACHINE-MAPPING>");
  const Reading reading = read_texts({text});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  ASSERT_EQ(reading.model.instances.size(), 2U);
  const Instance& left = reading.model.instances[0];
  EXPECT_EQ(left.service, "/P/Door");
  EXPECT_EQ(left.service_id, someip::ServiceId{0x1234});
  EXPECT_EQ(left.machine, "Ecu");
  EXPECT_EQ(left.address, IpAddress::v4(10, 0, 0, 1));
  EXPECT_EQ(left.configuration.at("side"), "left");
  EXPECT_THAT(left.multicast, ElementsAre(Multicast{.eventgroup = someip::EventgroupId{1},
                                                    .group = {IpAddress::v4(239, 0, 0, 9), 30600},
                                                    .threshold = 3}));
  EXPECT_EQ(reading.model.instances[1].service, "/P/Door");
  ASSERT_EQ(reading.model.machines.size(), 1U);
  EXPECT_EQ(reading.model.machines[0].address, IpAddress::v4(10, 0, 0, 1));
}

TEST(ReadArxml, ReadsHowLongMessagesAreCollected) {
  const auto props = [](std::string_view kind, std::string_view reference, std::string_view path,
                        std::string_view time) {
    return "<SOMEIP-" + std::string{kind} + "-PROPS><COLLECTION-PROPS><UDP-COLLECTION-BUFFER-TIMEOUT>" +
           std::string{time} + "</UDP-COLLECTION-BUFFER-TIMEOUT></COLLECTION-PROPS><" +
           std::string{reference} + " DEST=\"X\">" + std::string{path} + "</" + std::string{reference} +
           "></SOMEIP-" + std::string{kind} + "-PROPS>";
  };
  const Reading reading = read_texts({arxml(
      service("<EVENTS>" + event("a", "/x/uint8") + event("b", "/x/uint8") +
              "</EVENTS><FIELDS><FIELD><SHORT-NAME>f</SHORT-NAME><TYPE-TREF DEST=\"X\">/x/uint8</TYPE-TREF>"
              "</FIELD></FIELDS><METHODS><CLIENT-SERVER-OPERATION><SHORT-NAME>m</SHORT-NAME>"
              "</CLIENT-SERVER-OPERATION></METHODS>") +
      "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</SHORT-NAME><EVENT-DEPLOYMENTS>"
      "<SOMEIP-EVENT-DEPLOYMENT><SHORT-NAME>ea</SHORT-NAME><EVENT-REF DEST=\"X\">/P/Door/a</EVENT-REF>"
      "</SOMEIP-EVENT-DEPLOYMENT></EVENT-DEPLOYMENTS><FIELD-DEPLOYMENTS><SOMEIP-FIELD-DEPLOYMENT><SHORT-NAME>"
      "df</SHORT-NAME><FIELD-REF DEST=\"X\">/P/Door/f</FIELD-REF><NOTIFIER><SHORT-NAME>n</SHORT-NAME>"
      "</NOTIFIER></SOMEIP-FIELD-DEPLOYMENT></FIELD-DEPLOYMENTS><METHOD-DEPLOYMENTS>"
      "<SOMEIP-METHOD-DEPLOYMENT><SHORT-NAME>dm</SHORT-NAME><METHOD-REF DEST=\"X\">/P/Door/m</METHOD-REF>"
      "</SOMEIP-METHOD-DEPLOYMENT></METHOD-DEPLOYMENTS><SERVICE-INTERFACE-REF DEST=\"X\">/P/Door"
      "</SERVICE-INTERFACE-REF><SERVICE-INTERFACE-ID>1</SERVICE-INTERFACE-ID>"
      "</SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><PROVIDED-SOMEIP-SERVICE-INSTANCE><SHORT-NAME>I</SHORT-NAME>"
      "<SERVICE-INTERFACE-DEPLOYMENT-REF DEST=\"X\">/P/Dep</SERVICE-INTERFACE-DEPLOYMENT-REF><EVENT-PROPSS>" +
      props("EVENT", "EVENT-REF", "/P/Dep/ea", "0.005") +
      props("EVENT", "EVENT-REF", "/P/Dep/df/n", "0.006") + "</EVENT-PROPSS><METHOD-RESPONSE-PROPSS>" +
      props("METHOD", "METHOD-REF", "/P/Dep/dm", "0.007") +
      "</METHOD-RESPONSE-PROPSS></PROVIDED-SOMEIP-SERVICE-INSTANCE>")});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  const Service& door = reading.model.services.at(0);
  EXPECT_EQ(door.events.at(0).transfer.retention, 5ms);
  EXPECT_EQ(door.events.at(1).transfer.retention, 0ms);
  EXPECT_EQ(door.fields.at(0).notifier_transfer.retention, 6ms);
  EXPECT_EQ(door.methods.at(0).response_transfer.retention, 7ms);
  EXPECT_EQ(door.methods.at(0).request_transfer.retention, 0ms);
}

TEST(ReadArxml, WarnsOfInstancesOfNoService) {
  const Reading reading = read_texts(
      {arxml("<PROVIDED-SOMEIP-SERVICE-INSTANCE><SHORT-NAME>A</SHORT-NAME></PROVIDED-SOMEIP-SERVICE-INSTANCE>"
             "<PROVIDED-SOMEIP-SERVICE-INSTANCE><SHORT-NAME>B</SHORT-NAME><SERVICE-INTERFACE-DEPLOYMENT-REF "
             "DEST=\"X\">/P/A</SERVICE-INTERFACE-DEPLOYMENT-REF></PROVIDED-SOMEIP-SERVICE-INSTANCE>")});
  EXPECT_THAT(problems_of(reading), HasSubstr("/P/A names no deployment"));
  EXPECT_THAT(problems_of(reading), HasSubstr("/P/A is a PROVIDED-SOMEIP-SERVICE-INSTANCE, and a "
                                              "SOMEIP-SERVICE-INTERFACE-DEPLOYMENT was expected"));
}

TEST(ReadArxml, TellsOnceWhichPartsItDoesNotRead) {
  const auto event_deployment = [](std::string_view name) {
    return "<SOMEIP-EVENT-DEPLOYMENT><SHORT-NAME>" + std::string{name} +
           "</SHORT-NAME><ADMIN-DATA><SDGS/></ADMIN-DATA><EVENT-REF DEST=\"X\">/P/Door/" + std::string{name} +
           "</EVENT-REF><BURST-SIZE>3</BURST-SIZE></SOMEIP-EVENT-DEPLOYMENT>";
  };
  const Reading reading = read_texts(
      {arxml(service("<EVENTS>" + event("a", "/x/uint8") + event("b", "/x/uint8") + "</EVENTS>") +
             "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</SHORT-NAME><EVENT-DEPLOYMENTS>" +
             event_deployment("a") + event_deployment("b") +
             "</EVENT-DEPLOYMENTS><SERVICE-INTERFACE-REF DEST=\"X\">/P/Door</SERVICE-INTERFACE-REF>"
             "<SERVICE-INTERFACE-ID>1</SERVICE-INTERFACE-ID></SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>")});
  const std::string problems = problems_of(reading);
  EXPECT_THAT(problems, HasSubstr("BURST-SIZE of SOMEIP-EVENT-DEPLOYMENT is not read"));
  EXPECT_EQ(std::ranges::count(problems, '\n'), 1) << problems;
}

// --- Classic ----------------------------------------------------------------------------------------------

/// An old system description: bundles, routing groups, eventgroup id with the subscriber.
std::string classic() {
  return arxml(
      std::string{base_types} +
      "<IMPLEMENTATION-DATA-TYPE><SHORT-NAME>Speed</SHORT-NAME><CATEGORY>VALUE</CATEGORY>" +
      props("<BASE-TYPE-REF DEST=\"X\">/P/u16</BASE-TYPE-REF>") +
      "</IMPLEMENTATION-DATA-TYPE><SENDER-RECEIVER-INTERFACE><SHORT-NAME>If</SHORT-NAME><DATA-ELEMENTS>" +
      event("speed", "/P/Speed") +
      "</DATA-ELEMENTS></SENDER-RECEIVER-INTERFACE><CLIENT-SERVER-INTERFACE><SHORT-NAME>Cs</"
      "SHORT-NAME><OPERATIONS>"
      "<CLIENT-SERVER-OPERATION><SHORT-NAME>reset</"
      "SHORT-NAME><ARGUMENTS><ARGUMENT-DATA-PROTOTYPE><SHORT-NAME>to"
      "</SHORT-NAME><TYPE-TREF "
      "DEST=\"X\">/P/Speed</TYPE-TREF><DIRECTION>IN</DIRECTION></ARGUMENT-DATA-PROTOTYPE>"
      "<ARGUMENT-DATA-PROTOTYPE><SHORT-NAME>was</SHORT-NAME><TYPE-TREF DEST=\"X\">/P/Speed</TYPE-TREF>"
      "<DIRECTION>OUT</DIRECTION></ARGUMENT-DATA-PROTOTYPE></ARGUMENTS></CLIENT-SERVER-OPERATION></"
      "OPERATIONS>"
      "</CLIENT-SERVER-INTERFACE><SYSTEM-SIGNAL><SHORT-NAME>S1</SHORT-NAME></SYSTEM-SIGNAL>"
      "<SYSTEM-SIGNAL><SHORT-NAME>S2</SHORT-NAME></SYSTEM-SIGNAL><SYSTEM-SIGNAL><SHORT-NAME>S3</SHORT-NAME>"
      "</SYSTEM-SIGNAL><SYSTEM><SHORT-NAME>Sys</SHORT-NAME><MAPPINGS><SYSTEM-MAPPING><SHORT-NAME>M</"
      "SHORT-NAME>"
      "<DATA-MAPPINGS><SENDER-RECEIVER-TO-SIGNAL-MAPPING><DATA-ELEMENT-IREF><TARGET-DATA-PROTOTYPE-REF "
      "DEST=\"X\">"
      "/P/If/speed</TARGET-DATA-PROTOTYPE-REF></DATA-ELEMENT-IREF><SYSTEM-SIGNAL-REF DEST=\"X\">/P/S1"
      "</SYSTEM-SIGNAL-REF></SENDER-RECEIVER-TO-SIGNAL-MAPPING><CLIENT-SERVER-TO-SIGNAL-MAPPING>"
      "<CALL-SIGNAL-REF DEST=\"X\">/P/S2</CALL-SIGNAL-REF><CLIENT-SERVER-OPERATION-IREF>"
      "<TARGET-OPERATION-REF DEST=\"X\">/P/Cs/reset</TARGET-OPERATION-REF></CLIENT-SERVER-OPERATION-IREF>"
      "<RETURN-SIGNAL-REF "
      "DEST=\"X\">/P/S3</RETURN-SIGNAL-REF></CLIENT-SERVER-TO-SIGNAL-MAPPING></DATA-MAPPINGS>"
      "</SYSTEM-MAPPING></MAPPINGS></SYSTEM>"
      "<I-SIGNAL><SHORT-NAME>I1</SHORT-NAME><SYSTEM-SIGNAL-REF DEST=\"X\">/P/S1</SYSTEM-SIGNAL-REF>"
      "<TRANSFORMATION-I-SIGNAL-PROPSS><SOMEIP-TRANSFORMATION-I-SIGNAL-PROPS>"
      "<SOMEIP-TRANSFORMATION-I-SIGNAL-PROPS-VARIANTS><SOMEIP-TRANSFORMATION-I-SIGNAL-PROPS-CONDITIONAL>"
      "<TRANSFORMER-REF DEST=\"X\">/P/T/X</TRANSFORMER-REF><INTERFACE-VERSION>2</INTERFACE-VERSION>"
      "<MESSAGE-TYPE>NOTIFICATION</MESSAGE-TYPE></SOMEIP-TRANSFORMATION-I-SIGNAL-PROPS-CONDITIONAL>"
      "</SOMEIP-TRANSFORMATION-I-SIGNAL-PROPS-VARIANTS></SOMEIP-TRANSFORMATION-I-SIGNAL-PROPS>"
      "</TRANSFORMATION-I-SIGNAL-PROPSS></I-SIGNAL>"
      "<I-SIGNAL><SHORT-NAME>I2</SHORT-NAME><SYSTEM-SIGNAL-REF "
      "DEST=\"X\">/P/S2</SYSTEM-SIGNAL-REF></I-SIGNAL>"
      "<I-SIGNAL><SHORT-NAME>I3</SHORT-NAME><SYSTEM-SIGNAL-REF "
      "DEST=\"X\">/P/S3</SYSTEM-SIGNAL-REF></I-SIGNAL>"
      "<DATA-TRANSFORMATION-SET><SHORT-NAME>T</"
      "SHORT-NAME><TRANSFORMATION-TECHNOLOGYS><TRANSFORMATION-TECHNOLOGY>"
      "<SHORT-NAME>X</"
      "SHORT-NAME><TRANSFORMATION-DESCRIPTIONS><SOMEIP-TRANSFORMATION-DESCRIPTION><ALIGNMENT>32"
      "</ALIGNMENT><BYTE-ORDER>MOST-SIGNIFICANT-BYTE-LAST</BYTE-ORDER></SOMEIP-TRANSFORMATION-DESCRIPTION>"
      "</TRANSFORMATION-DESCRIPTIONS></TRANSFORMATION-TECHNOLOGY></TRANSFORMATION-TECHNOLOGYS>"
      "</DATA-TRANSFORMATION-SET>" +
      [] {
        std::string pdus;
        for (const char digit : {'1', '2', '3'}) {
          pdus += std::string{"<I-SIGNAL-I-PDU><SHORT-NAME>D"} + digit +
                  "</SHORT-NAME><LENGTH>2</"
                  "LENGTH><I-SIGNAL-TO-PDU-MAPPINGS><I-SIGNAL-TO-I-PDU-MAPPING><SHORT-NAME>m"
                  "</SHORT-NAME><I-SIGNAL-REF DEST=\"X\">/P/I" +
                  digit +
                  "</I-SIGNAL-REF></I-SIGNAL-TO-I-PDU-MAPPING></I-SIGNAL-TO-PDU-MAPPINGS></I-SIGNAL-I-PDU>";
        }
        return pdus;
      }() +
      "<GENERAL-PURPOSE-I-PDU><SHORT-NAME>Seg</SHORT-NAME><LENGTH>1404</LENGTH></GENERAL-PURPOSE-I-PDU>"
      "<SOMEIP-TP-CONFIG><SHORT-NAME>Tp</SHORT-NAME><TP-CHANNELS><SOMEIP-TP-CHANNEL><SHORT-NAME>C</"
      "SHORT-NAME>"
      "<SEPARATION-TIME>0.001</SEPARATION-TIME></SOMEIP-TP-CHANNEL></TP-CHANNELS><TP-CONNECTIONS>"
      "<SOMEIP-TP-CONNECTION><TP-CHANNEL-REF DEST=\"X\">/P/Tp/C</TP-CHANNEL-REF><TP-SDU-REF DEST=\"X\">/P/D1"
      "</TP-SDU-REF><TRANSPORT-PDU-REF "
      "DEST=\"X\">/P/Seg</TRANSPORT-PDU-REF></SOMEIP-TP-CONNECTION></TP-CONNECTIONS>"
      "</SOMEIP-TP-CONFIG><SO-AD-ROUTING-GROUP><SHORT-NAME>R</SHORT-NAME></SO-AD-ROUTING-GROUP>"
      "<ETHERNET-CLUSTER><SHORT-NAME>Net</"
      "SHORT-NAME><ETHERNET-CLUSTER-VARIANTS><ETHERNET-CLUSTER-CONDITIONAL>"
      "<PHYSICAL-CHANNELS><ETHERNET-PHYSICAL-CHANNEL><SHORT-NAME>Ch</SHORT-NAME><PDU-TRIGGERINGS>"
      "<PDU-TRIGGERING><SHORT-NAME>T1</SHORT-NAME><I-PDU-REF DEST=\"X\">/P/Seg</I-PDU-REF></PDU-TRIGGERING>"
      "<PDU-TRIGGERING><SHORT-NAME>T2</SHORT-NAME><I-PDU-REF DEST=\"X\">/P/D2</I-PDU-REF></PDU-TRIGGERING>"
      "<PDU-TRIGGERING><SHORT-NAME>T3</SHORT-NAME><I-PDU-REF DEST=\"X\">/P/D3</I-PDU-REF></PDU-TRIGGERING>"
      "</PDU-TRIGGERINGS><SO-AD-CONFIG><CONNECTION-BUNDLES><SOCKET-CONNECTION-BUNDLE><SHORT-NAME>B</"
      "SHORT-NAME>"
      "<BUNDLED-CONNECTIONS><SOCKET-CONNECTION><PDUS><SOCKET-CONNECTION-IPDU-IDENTIFIER><HEADER-ID>0x12340001"
      "</HEADER-ID><PDU-TRIGGERING-REF DEST=\"X\">/P/Net/Ch/T1</PDU-TRIGGERING-REF><ROUTING-GROUP-REFS>"
      "<ROUTING-GROUP-REF DEST=\"X\">/P/R</ROUTING-GROUP-REF></ROUTING-GROUP-REFS>"
      "</SOCKET-CONNECTION-IPDU-IDENTIFIER><SOCKET-CONNECTION-IPDU-IDENTIFIER><HEADER-ID>305397762</"
      "HEADER-ID>"
      "<PDU-TRIGGERING-REF DEST=\"X\">/P/Net/Ch/T2</PDU-TRIGGERING-REF></SOCKET-CONNECTION-IPDU-IDENTIFIER>"
      "<SOCKET-CONNECTION-IPDU-IDENTIFIER><HEADER-ID>305397762</HEADER-ID>"
      "<PDU-TRIGGERING-REF DEST=\"X\">/P/Net/Ch/T3</PDU-TRIGGERING-REF></SOCKET-CONNECTION-IPDU-IDENTIFIER>"
      "</PDUS></SOCKET-CONNECTION></BUNDLED-CONNECTIONS></SOCKET-CONNECTION-BUNDLE></CONNECTION-BUNDLES>"
      "<SOCKET-ADDRESSS><SOCKET-ADDRESS><SHORT-NAME>A</SHORT-NAME><APPLICATION-ENDPOINT><SHORT-NAME>E</"
      "SHORT-NAME>"
      "<PROVIDED-SERVICE-INSTANCES><PROVIDED-SERVICE-INSTANCE><SHORT-NAME>Nav</SHORT-NAME><EVENT-HANDLERS>"
      "<EVENT-HANDLER><SHORT-NAME>G</SHORT-NAME><CONSUMED-EVENT-GROUP-REFS><CONSUMED-EVENT-GROUP-REF "
      "DEST=\"X\">"
      "/P/Net/Ch/A/E/C/g</CONSUMED-EVENT-GROUP-REF></CONSUMED-EVENT-GROUP-REFS><ROUTING-GROUP-REFS>"
      "<ROUTING-GROUP-REF "
      "DEST=\"X\">/P/R</ROUTING-GROUP-REF></ROUTING-GROUP-REFS></EVENT-HANDLER></EVENT-HANDLERS>"
      "<INSTANCE-IDENTIFIER>1</INSTANCE-IDENTIFIER><SERVICE-IDENTIFIER>4660</SERVICE-IDENTIFIER>"
      "</PROVIDED-SERVICE-INSTANCE></PROVIDED-SERVICE-INSTANCES><CONSUMED-SERVICE-INSTANCES>"
      "<CONSUMED-SERVICE-INSTANCE><SHORT-NAME>C</SHORT-NAME><CONSUMED-EVENT-GROUPS><CONSUMED-EVENT-GROUP>"
      "<SHORT-NAME>g</SHORT-NAME><EVENT-GROUP-IDENTIFIER>6</EVENT-GROUP-IDENTIFIER></CONSUMED-EVENT-GROUP>"
      "</CONSUMED-EVENT-GROUPS><PROVIDED-SERVICE-INSTANCE-REF DEST=\"X\">/P/Net/Ch/A/E/Nav"
      "</PROVIDED-SERVICE-INSTANCE-REF></CONSUMED-SERVICE-INSTANCE></CONSUMED-SERVICE-INSTANCES>"
      "<TP-CONFIGURATION><UDP-TP><UDP-TP-PORT><PORT-NUMBER>30501</PORT-NUMBER></UDP-TP-PORT></UDP-TP>"
      "</TP-CONFIGURATION></APPLICATION-ENDPOINT></SOCKET-ADDRESS></SOCKET-ADDRESSS></SO-AD-CONFIG>"
      "</ETHERNET-PHYSICAL-CHANNEL></PHYSICAL-CHANNELS></ETHERNET-CLUSTER-CONDITIONAL></"
      "ETHERNET-CLUSTER-VARIANTS>"
      "</ETHERNET-CLUSTER>");
}

TEST(ReadArxml, ReadsAClassicSystemDescription) {
  const Reading reading = read_texts({classic()});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  ASSERT_EQ(reading.model.services.size(), 1U);
  const Service& nav = reading.model.services[0];
  EXPECT_EQ(nav.name, "Nav");
  EXPECT_EQ(nav.id, someip::ServiceId{0x1234});
  EXPECT_EQ(nav.major, 2);
  ASSERT_EQ(nav.events.size(), 1U);
  const Event& speed = nav.events[0];
  EXPECT_EQ(speed.name, "speed");
  EXPECT_EQ(speed.id, someip::MethodId{1}) << "a HEADER-ID is a whole message id: no bit 15 is set";
  EXPECT_THAT(speed.eventgroups, ElementsAre(someip::EventgroupId{6}));
  EXPECT_EQ(speed.payload.byte_order, std::endian::little);
  EXPECT_EQ(speed.payload.alignment, 4);
  EXPECT_EQ(speed.transfer.segment_bytes, 1392U);
  EXPECT_EQ(speed.transfer.separation, 1ms);
  EXPECT_EQ(resolved(reading.model, speed.payload.values.at(0).type).primitive, messages::Primitive::uint16);
  ASSERT_EQ(nav.methods.size(), 1U);
  EXPECT_EQ(nav.methods[0].name, "reset");
  EXPECT_EQ(nav.methods[0].id, someip::MethodId{2});
  EXPECT_EQ(nav.methods[0].request.values.at(0).name, "to");
  EXPECT_EQ(nav.methods[0].response.values.at(0).name, "was");
  ASSERT_EQ(reading.model.instances.size(), 2U);
  EXPECT_THAT(reading.model.instances[1].eventgroups, ElementsAre(someip::EventgroupId{6}));
  EXPECT_EQ(reading.model.instances[1].service_id, someip::ServiceId{0x1234});
}

/// `text` with the only `old` in it replaced.
std::string replaced(std::string text, std::string_view old, std::string_view by) {
  const std::size_t at = text.find(old);
  EXPECT_NE(at, std::string::npos) << old;
  return at == std::string::npos ? text : text.replace(at, old.size(), by);
}

/// classic(), where nothing but the routing group tells that the message is an event; it stands at `holder`.
std::string with_routing_group_at(std::string_view holder) {
  const std::string_view group =
      "<ROUTING-GROUP-REFS><ROUTING-GROUP-REF DEST=\"X\">/P/R</ROUTING-GROUP-REF></ROUTING-GROUP-REFS>";
  std::string text = replaced(classic(), "<MESSAGE-TYPE>NOTIFICATION</MESSAGE-TYPE>", "");
  text = replaced(std::move(text),
                  "<SENDER-RECEIVER-TO-SIGNAL-MAPPING><DATA-ELEMENT-IREF><TARGET-DATA-PROTOTYPE-REF "
                  "DEST=\"X\">/P/If/speed</TARGET-DATA-PROTOTYPE-REF></DATA-ELEMENT-IREF>"
                  "<SYSTEM-SIGNAL-REF DEST=\"X\">/P/S1</SYSTEM-SIGNAL-REF>"
                  "</SENDER-RECEIVER-TO-SIGNAL-MAPPING>",
                  "");
  text = replaced(std::move(text), std::string{group} + "</EVENT-HANDLER>", "</EVENT-HANDLER>");
  const std::string end = "</" + std::string{holder} + ">";
  return replaced(std::move(text), end, std::string{group} + end);
}

TEST(ReadArxml, TakesTheRoutingGroupsOfAnEventgroupFromItsSubscribers) {
  for (const char* const holder : {"EVENT-HANDLER", "CONSUMED-EVENT-GROUP"}) {
    const Reading reading = read_texts({with_routing_group_at(holder)});
    EXPECT_THAT(problems_of(reading), HasSubstr("no mapping tells the data type"));
    const Service& nav = reading.model.services.at(0);
    ASSERT_EQ(nav.events.size(), 1U) << holder;
    EXPECT_EQ(nav.events[0].id, someip::MethodId{1});
    EXPECT_THAT(nav.events[0].eventgroups, ElementsAre(someip::EventgroupId{6}));
    ASSERT_EQ(nav.methods.size(), 1U);
    EXPECT_EQ(nav.methods[0].name, "reset");
  }
}

TEST(ReadArxml, KnowsAnEventgroupThatNobodyInTheFileOffers) {
  std::string text = with_routing_group_at("CONSUMED-EVENT-GROUP");
  const std::size_t from = text.find("<PROVIDED-SERVICE-INSTANCES>");
  const std::string_view end = "</PROVIDED-SERVICE-INSTANCES>";
  text.erase(from, text.find(end) + end.size() - from);
  text = replaced(std::move(text),
                  "<PROVIDED-SERVICE-INSTANCE-REF DEST=\"X\">/P/Net/Ch/A/E/Nav"
                  "</PROVIDED-SERVICE-INSTANCE-REF>",
                  "<SERVICE-IDENTIFIER>4660</SERVICE-IDENTIFIER>");
  const Reading reading = read_texts({text});
  const Service& service = reading.model.services.at(0);
  ASSERT_EQ(service.eventgroups.size(), 1U);
  EXPECT_EQ(service.eventgroups[0].name, "g");
  EXPECT_EQ(service.eventgroups[0].id, someip::EventgroupId{6});
  ASSERT_EQ(service.events.size(), 1U);
  EXPECT_THAT(service.events[0].eventgroups, ElementsAre(someip::EventgroupId{6}));
}

TEST(ReadArxml, ReadsSocketConnectionsWithoutABundle) {
  std::string text = classic();
  text = replaced(std::move(text),
                  "<CONNECTION-BUNDLES><SOCKET-CONNECTION-BUNDLE><SHORT-NAME>B</SHORT-NAME>"
                  "<BUNDLED-CONNECTIONS><SOCKET-CONNECTION>",
                  "<CONNECTIONS><SOCKET-CONNECTION><LOCAL-PORT-REF DEST=\"X\">/P/Net/Ch/A</LOCAL-PORT-REF>");
  text = replaced(std::move(text), "</BUNDLED-CONNECTIONS></SOCKET-CONNECTION-BUNDLE></CONNECTION-BUNDLES>",
                  "</CONNECTIONS>");
  text = replaced(std::move(text), "<UDP-TP><UDP-TP-PORT>", "<TCP-TP><TCP-TP-PORT>");
  text = replaced(std::move(text), "</UDP-TP-PORT></UDP-TP>", "</TCP-TP-PORT></TCP-TP>");
  const Reading reading = read_texts({text});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  ASSERT_EQ(reading.model.services.size(), 1U);
  const Service& nav = reading.model.services[0];
  ASSERT_EQ(nav.events.size(), 1U);
  EXPECT_EQ(nav.events[0].name, "speed");
  EXPECT_EQ(nav.events[0].transfer.transport, Transport::tcp);
  EXPECT_THAT(nav.events[0].eventgroups, ElementsAre(someip::EventgroupId{6}));
  ASSERT_EQ(nav.methods.size(), 1U);
  EXPECT_EQ(nav.methods[0].request_transfer.transport, Transport::tcp);
}

/// classic(), with a trigger in place of the data element.
std::string with_trigger() {
  return replaced(
      replaced(
          classic(),
          "<SENDER-RECEIVER-TO-SIGNAL-MAPPING><DATA-ELEMENT-IREF><TARGET-DATA-PROTOTYPE-REF DEST=\"X\">"
          "/P/If/speed</TARGET-DATA-PROTOTYPE-REF></DATA-ELEMENT-IREF><SYSTEM-SIGNAL-REF DEST=\"X\">/P/S1"
          "</SYSTEM-SIGNAL-REF></SENDER-RECEIVER-TO-SIGNAL-MAPPING>",
          "<TRIGGER-TO-SIGNAL-MAPPING><SYSTEM-SIGNAL-REF DEST=\"X\">/P/S1</SYSTEM-SIGNAL-REF>"
          "<TRIGGER-IREF><TARGET-TRIGGER-REF DEST=\"X\">/P/Ti/Fire</TARGET-TRIGGER-REF></TRIGGER-IREF>"
          "</TRIGGER-TO-SIGNAL-MAPPING>"),
      "<CLIENT-SERVER-INTERFACE>",
      "<TRIGGER-INTERFACE><SHORT-NAME>Ti</SHORT-NAME><TRIGGERS><TRIGGER><SHORT-NAME>Fire</SHORT-NAME>"
      "</TRIGGER></TRIGGERS></TRIGGER-INTERFACE><CLIENT-SERVER-INTERFACE>");
}

TEST(ReadArxml, ReadsTriggersOfClassicAsEventsWithoutData) {
  const Reading reading = read_texts({with_trigger()});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  ASSERT_EQ(reading.model.services.size(), 1U);
  ASSERT_EQ(reading.model.services[0].events.size(), 1U);
  const Event& fire = reading.model.services[0].events[0];
  EXPECT_EQ(fire.name, "Fire");
  EXPECT_TRUE(fire.payload.known);
  EXPECT_THAT(fire.payload.values, IsEmpty());
}

TEST(ReadArxml, ReadsTriggersThatAreSentAsRequestsAsMethods) {
  const Reading reading = read_texts({replaced(with_trigger(), "<MESSAGE-TYPE>NOTIFICATION</MESSAGE-TYPE>",
                                               "<MESSAGE-TYPE>REQUEST_NO_RETURN</MESSAGE-TYPE>")});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  ASSERT_EQ(reading.model.services.size(), 1U);
  EXPECT_THAT(reading.model.services[0].events, IsEmpty());
  ASSERT_EQ(reading.model.services[0].methods.size(), 2U);
  const Method& fire = reading.model.services[0].methods[0];
  EXPECT_EQ(fire.name, "Fire");
  EXPECT_TRUE(fire.fire_and_forget);
  EXPECT_TRUE(fire.request.known);
  EXPECT_THAT(fire.request.values, IsEmpty());
}

TEST(ReadArxml, TakesTheTransportFromWhoActivatesAPdu) {
  // R20 and newer: the connections of clients are made when they subscribe, and stand nowhere.
  std::string text = classic();
  const std::size_t from = text.find("<CONNECTION-BUNDLES>");
  const std::string_view end = "</CONNECTION-BUNDLES>";
  ASSERT_NE(from, std::string::npos);
  text.replace(from, text.find(end) + end.size() - from, "");
  text = replaced(std::move(text), "<SO-AD-ROUTING-GROUP>",
                  "<SOCKET-CONNECTION-IPDU-IDENTIFIER-SET><SHORT-NAME>Ids</SHORT-NAME><I-PDU-IDENTIFIERS>"
                  "<SO-CON-I-PDU-IDENTIFIER><SHORT-NAME>E</SHORT-NAME><HEADER-ID>0x12340001</HEADER-ID>"
                  "<PDU-COLLECTION-PDU-TIMEOUT>0.005</PDU-COLLECTION-PDU-TIMEOUT>"
                  "<PDU-TRIGGERING-REF DEST=\"X\">/P/Net/Ch/T1</PDU-TRIGGERING-REF></SO-CON-I-PDU-IDENTIFIER>"
                  "<SO-CON-I-PDU-IDENTIFIER><SHORT-NAME>M</SHORT-NAME><HEADER-ID>0x12340002</HEADER-ID>"
                  "<PDU-TRIGGERING-REF DEST=\"X\">/P/Net/Ch/T2</PDU-TRIGGERING-REF></SO-CON-I-PDU-IDENTIFIER>"
                  "</I-PDU-IDENTIFIERS></SOCKET-CONNECTION-IPDU-IDENTIFIER-SET><SO-AD-ROUTING-GROUP>");
  text = replaced(std::move(text),
                  "</CONSUMED-EVENT-GROUP-REFS><ROUTING-GROUP-REFS><ROUTING-GROUP-REF DEST=\"X\">/P/R"
                  "</ROUTING-GROUP-REF></ROUTING-GROUP-REFS>",
                  "</CONSUMED-EVENT-GROUP-REFS><PDU-ACTIVATION-ROUTING-GROUPS><PDU-ACTIVATION-ROUTING-GROUP>"
                  "<SHORT-NAME>a</SHORT-NAME><I-PDU-IDENTIFIER-TCP-REFS><I-PDU-IDENTIFIER-TCP-REF DEST=\"X\">"
                  "/P/Ids/E</I-PDU-IDENTIFIER-TCP-REF></I-PDU-IDENTIFIER-TCP-REFS>"
                  "</PDU-ACTIVATION-ROUTING-GROUP></PDU-ACTIVATION-ROUTING-GROUPS>");
  text = replaced(std::move(text), "<SHORT-NAME>Nav</SHORT-NAME>",
                  "<SHORT-NAME>Nav</SHORT-NAME><METHOD-ACTIVATION-ROUTING-GROUPS>"
                  "<PDU-ACTIVATION-ROUTING-GROUP><SHORT-NAME>m</SHORT-NAME><I-PDU-IDENTIFIER-TCP-REFS>"
                  "<I-PDU-IDENTIFIER-TCP-REF DEST=\"X\">/P/Ids/M</I-PDU-IDENTIFIER-TCP-REF>"
                  "</I-PDU-IDENTIFIER-TCP-REFS></PDU-ACTIVATION-ROUTING-GROUP>"
                  "</METHOD-ACTIVATION-ROUTING-GROUPS>");
  const Reading reading = read_texts({text});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  const Service& nav = reading.model.services.at(0);
  EXPECT_EQ(nav.events.at(0).transfer.transport, Transport::tcp);
  EXPECT_EQ(nav.events.at(0).transfer.retention, 5ms);
  EXPECT_THAT(nav.events.at(0).eventgroups, ElementsAre(someip::EventgroupId{6}));
  EXPECT_EQ(nav.methods.at(0).request_transfer.transport, Transport::tcp);
}

TEST(ReadArxml, ReadsHowOftenAPduIsSent) {
  const Reading reading = read_texts(
      {replaced(classic(), "<SHORT-NAME>D1</SHORT-NAME><LENGTH>2</LENGTH>",
                "<SHORT-NAME>D1</SHORT-NAME><LENGTH>2</LENGTH><I-PDU-TIMING-SPECIFICATIONS><I-PDU-TIMING>"
                "<TRANSMISSION-MODE-DECLARATION><TRANSMISSION-MODE-TRUE-TIMING><CYCLIC-TIMING><TIME-PERIOD>"
                "<VALUE>0.02</VALUE></TIME-PERIOD></CYCLIC-TIMING></TRANSMISSION-MODE-TRUE-TIMING>"
                "</TRANSMISSION-MODE-DECLARATION></I-PDU-TIMING></I-PDU-TIMING-SPECIFICATIONS>")});
  EXPECT_THAT(problems_of(reading), IsEmpty());
  EXPECT_EQ(reading.model.services.at(0).events.at(0).cycle, 20ms);
}

TEST(ReadArxml, DoesNotTakeTheFirstOfSeveralSignalsForTheWholePayload) {
  const Reading reading = read_texts(
      {replaced(classic(), "<I-SIGNAL-REF DEST=\"X\">/P/I1</I-SIGNAL-REF></I-SIGNAL-TO-I-PDU-MAPPING>",
                "<I-SIGNAL-REF DEST=\"X\">/P/I1</I-SIGNAL-REF></I-SIGNAL-TO-I-PDU-MAPPING>"
                "<I-SIGNAL-TO-I-PDU-MAPPING><SHORT-NAME>n</SHORT-NAME><I-SIGNAL-REF DEST=\"X\">/P/I2"
                "</I-SIGNAL-REF></I-SIGNAL-TO-I-PDU-MAPPING>")});
  EXPECT_THAT(problems_of(reading), HasSubstr("/P/D1 has several signals"));
  ASSERT_EQ(reading.problems.size(), 1U) << problems_of(reading);  // not also that no mapping tells its type
  EXPECT_GT(reading.problems[0].mark.line, 0);
  const Event& event = reading.model.services.at(0).events.at(0);
  EXPECT_FALSE(event.payload.known);
  EXPECT_THAT(event.payload.values, IsEmpty());
}

// --- what is wrong ----------------------------------------------------------------------------------------

TEST(ReadArxml, RefusesWhatIsNoXmlOrNoArxml) {
  EXPECT_THAT(
      problems_of(read_texts({""})),
      HasSubstr("0.arxml:1:1: error: the file is empty, and XML with the top element AUTOSAR was expected"));
  EXPECT_THAT(problems_of(read_texts({"<a>\n<b></a>"})),
              HasSubstr("0.arxml:1:1: error: the top element is a"));
  EXPECT_THAT(problems_of(read_texts({std::string{arxml_head} + "\n  <AR-PACKAGES></AR-PACKAGE>"})),
              HasSubstr("error: this tag ends another element, and the end of AR-PACKAGES, which begins on "
                        "line 3, was expected"));
  const std::string whole = arxml(service(""));
  const std::size_t end_of_name = whole.find("</SHORT-NAME>");
  EXPECT_THAT(problems_of(read_texts({whole.substr(0, end_of_name)})),
              ContainsRegex("error: the file ends here, and the end of SHORT-NAME, which begins on line "
                            "[0-9]+, was expected"));
  EXPECT_THAT(problems_of(read_texts({whole.substr(0, end_of_name + 5)})),
              HasSubstr("error: the file ends within the tag or comment that begins here"));
  EXPECT_THAT(
      problems_of(read_texts({"package car\n"})),
      ContainsRegex("0.arxml:1:1: error: this is not well-formed XML: .*; the top element AUTOSAR was "
                    "expected"));
  EXPECT_THAT(problems_of(read_texts({whole + "more"})), HasSubstr("junk after document element"));
  EXPECT_THAT(problems_of(read_texts({"<AUTOSAR xmlns=\"http://autosar.org/3.2.1\"/>"})),
              HasSubstr("http://autosar.org/schema/r4.0 was expected"));
}

TEST(ReadArxml, RefusesEntityBombsAndDeepFiles) {
  EXPECT_THAT(problems_of(read_texts({"<?xml version=\"1.0\"?>\n<!DOCTYPE a [<!ENTITY x \"yyyyyyyyyy\">\n"
                                      "<!ENTITY z \"&x;&x;&x;&x;&x;&x;\">]><AUTOSAR>&z;</AUTOSAR>"})),
              HasSubstr("0.arxml:2:13: error: ARXML has no DTD, so this one is refused"));
  std::string deep{arxml_head};
  for (int i = 0; i < 10'000; ++i) {
    deep += "<AR-PACKAGES>";
  }
  EXPECT_THAT(problems_of(read_texts({deep})), HasSubstr("error: elements are nested more than"));
}

TEST(ReadArxml, RefusesMoreThanItsLimits) {
  EXPECT_THAT(problems_of(read_texts({arxml(base_types)}, {.max_elements = 5})),
              HasSubstr("error: there are more than 5 elements"));
  EXPECT_THAT(problems_of(read_texts({arxml(base_types)}, {.max_text_bytes = 5})),
              HasSubstr("error: there are more than 5 bytes of text"));
  EXPECT_THAT(problems_of(read_texts({arxml(service(""))}, {.max_name_bytes = 3})),
              ContainsRegex("error: this SHORT-NAME has [0-9]+ bytes; expected at most 3"));
}

/// Expat tells nothing of a tag before its end. The reader looks how much is untold with each piece of a
/// file.
TEST(ReadArxml, RefusesTagsAndCommentsWithoutEnd) {
  const std::string filler(1'000'000, 'x');
  for (const std::string& tag : {"<!--" + filler + "-->", "<SERVICE-INTERFACE UUID=\"" + filler + "\"/>",
                                 "<?x " + filler + "?>", "<!--" + filler}) {
    EXPECT_THAT(problems_of(read_texts({arxml("\n" + tag)}, {.max_tag_bytes = 100'000})),
                HasSubstr("0.arxml:3:1: error: this tag or comment has more than 100000 bytes, or does not "
                          "end; expected shorter ones"))
        << tag.substr(0, 10);
  }
  // Many of them, and text, may be as long as they like.
  std::string many;
  for (int i = 0; i < 20; ++i) {
    many += "<!--" + filler.substr(0, 50'000) + "-->";
  }
  EXPECT_EQ(problems_of(read_texts({arxml(many + "<X>" + filler + "</X>")}, {.max_tag_bytes = 400'000})), "");
}

TEST(ReadArxml, RefusesTypesThatContainThemselves) {
  const auto alias = [](std::string_view name, std::string_view to) {
    return "<STD-CPP-IMPLEMENTATION-DATA-TYPE><SHORT-NAME>" + std::string{name} +
           "</SHORT-NAME><CATEGORY>TYPE_REFERENCE</CATEGORY><TYPE-REFERENCE-REF DEST=\"X\">" +
           std::string{to} + "</TYPE-REFERENCE-REF></STD-CPP-IMPLEMENTATION-DATA-TYPE>";
  };
  EXPECT_THAT(problems_of(read_texts({types(alias("A", "/P/B") + alias("B", "/P/A"), "/P/A")})),
              HasSubstr("error: the type /P/A contains itself"));
  std::string chain;
  for (int i = 0; i < 1000; ++i) {
    chain += alias("T" + std::to_string(i), "/P/T" + std::to_string(i + 1));
  }
  EXPECT_THAT(problems_of(read_texts({types(chain, "/P/T0")})),
              HasSubstr("error: types are nested more than"));
}

TEST(ReadArxml, LeavesAnInstanceIdOpenThatIsNone) {
  for (const std::string id : {"0", "65535"}) {
    const Reading reading = read_texts(
        {arxml(service("") +
               "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</SHORT-NAME>"
               "<SERVICE-INTERFACE-REF DEST=\"X\">/P/Door</SERVICE-INTERFACE-REF>"
               "<SERVICE-INTERFACE-ID>1</SERVICE-INTERFACE-ID></SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>"
               "<PROVIDED-SOMEIP-SERVICE-INSTANCE><SHORT-NAME>Left</SHORT-NAME>"
               "<SERVICE-INTERFACE-DEPLOYMENT-REF DEST=\"X\">/P/Dep</SERVICE-INTERFACE-DEPLOYMENT-REF>"
               "<SERVICE-INSTANCE-ID>" +
               id + "</SERVICE-INSTANCE-ID></PROVIDED-SOMEIP-SERVICE-INSTANCE>")});
    EXPECT_TRUE(reading.ok());
    EXPECT_THAT(problems_of(reading),
                HasSubstr("warning: " + id + " cannot be the id of an instance: it is left open"));
    ASSERT_EQ(reading.model.instances.size(), 1U);
    EXPECT_EQ(reading.model.instances[0].id, std::nullopt);
  }
}

TEST(ReadArxml, WarnsOfWhatIsNotByTheSchema) {
  const Reading reading = read_texts(
      {arxml(service("<VARIATION-POINT/><FIELDS><FIELD><SHORT-NAME>f</SHORT-NAME><TYPE-TREF "
                     "DEST=\"X\">/x/uint8</TYPE-TREF>"
                     "</FIELD></FIELDS>") +
             "<SOMEIP-SERVICE-INTERFACE-DEPLOYMENT><SHORT-NAME>Dep</"
             "SHORT-NAME><FIELD-DEPLOYMENTS><SOMEIP-FIELD-DEPLOYMENT>"
             "<SHORT-NAME>d</SHORT-NAME><FIELD-REF "
             "DEST=\"X\">Door/f</FIELD-REF><GETTER><METHOD-ID>1</METHOD-ID></GETTER>"
             "<SETTER><METHOD-ID>2</METHOD-ID></SETTER></SOMEIP-FIELD-DEPLOYMENT></FIELD-DEPLOYMENTS>"
             "<SERVICE-INTERFACE-REF DEST=\"X\"> Door "
             "</SERVICE-INTERFACE-REF><SERVICE-INTERFACE-ID>1</SERVICE-INTERFACE-ID>"
             "</SOMEIP-SERVICE-INTERFACE-DEPLOYMENT>")});
  EXPECT_TRUE(reading.ok());
  EXPECT_THAT(problems_of(reading), HasSubstr("warning: 1 elements of this file have a VARIATION-POINT"));
  EXPECT_THAT(problems_of(reading), HasSubstr("warning: GETTER is read as GET"));
  EXPECT_THAT(problems_of(reading),
              HasSubstr("warning: \"Door\" is no path from the top; /P/Door was taken"));
  EXPECT_EQ(reading.model.services.at(0).fields.at(0).setter, someip::MethodId{2});
}

TEST(ReadArxml, SurvivesMutations) {
  const std::string whole = classic();
  std::mt19937 random{25};
  for (int round = 0; round < 300; ++round) {
    std::string text = whole;
    for (int change = 0; change < 3; ++change) {
      const std::size_t at = random() % text.size();
      switch (random() % 4) {
        case 0:
          text.erase(at, random() % 200);
          break;
        case 1:
          text.insert(at, text.substr(random() % text.size(), random() % 300));
          break;
        case 2:
          text[at] = static_cast<char>(random());
          break;
        default:
          // One name for another: references and types go astray, the XML stays whole.
          for (std::size_t i = at; i + 4 < text.size(); ++i) {
            if (text.compare(i, 3, "/P/") == 0) {
              text[i + 3] = "SIDTRN"[random() % 6];
              break;
            }
          }
      }
    }
    const Reading reading = read_texts({text});
    for (const documents::Problem& problem : reading.problems) {
      EXPECT_EQ(problem.file, "0.arxml");
      EXPECT_FALSE(problem.text.empty());
    }
    EXPECT_LE(reading.problems.size(), 100U);
  }
}

}  // namespace
}  // namespace trestle::describe
