#include <gmock/gmock.h>

#include <algorithm>

#include "test/bridge/describe/arxml/arxml_text.hpp"

namespace trestle::describe {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string field_type(const Reading& reading, std::size_t index = 0) {
  const Model& model = reading.model;
  const Value& value = model.services.at(0).events.at(index).payload.values.at(0);
  const Type& type = resolved(model, value.type);
  return std::string{to_string(type.kind)} + " " + type.name;
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

}  // namespace
}  // namespace trestle::describe
