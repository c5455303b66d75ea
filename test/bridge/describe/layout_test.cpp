#include "bridge/describe/layout.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace trestle::describe {
namespace {

using messages::Primitive;
using someip::DataId;
using someip::FieldWidth;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

std::vector<std::string> lines_of(const Layout& layout) {
  std::vector<std::string> lines;
  for (const ByteRange& one : layout.ranges) {
    lines.push_back(fmt::format("{}{} [{}] {}: {}{}{}{}{}",
                                std::string(static_cast<std::size_t>(one.depth), '>'), one.offset_text,
                                one.size_text, one.path, one.type, one.rule.empty() ? "" : ", ", one.rule,
                                one.value.empty() ? "" : " = ", one.value));
  }
  return lines;
}
std::vector<std::string> errors_of(const Layout& layout) {
  std::vector<std::string> lines;
  for (const LayoutError& one : layout.errors) {
    lines.push_back(fmt::format("{} {}: {}", one.offset, one.path, one.text));
  }
  return lines;
}

Layout layout_of_bytes(const Model& model, const Payload& payload, std::string_view bytes) {
  return layout(model, payload, std::as_bytes(std::span{bytes}));
}

/// Points behind a flag.
struct Points {
  Points() {
    const TypeIndex u8 = model.add({.kind = Kind::primitive, .primitive = Primitive::uint8});
    const TypeIndex u16 = model.add({.kind = Kind::primitive, .primitive = Primitive::int16});
    const TypeIndex side =
        model.add({.kind = Kind::enumeration,
                   .name = "Side",
                   .primitive = Primitive::uint8,
                   .enumerators = {{.name = "LEFT", .value = 0}, {.name = "RIGHT", .value = 1}}});
    const TypeIndex point =
        model.add({.kind = Kind::structure,
                   .name = "Point",
                   .members = {{.name = "x", .type = u16}, {.name = "side", .type = side}}});
    const TypeIndex points = model.add({.kind = Kind::array, .element = {.type = point}});
    const TypeIndex text = model.add({.kind = Kind::string});
    payload.values = {{.name = "n", .type = u8},
                      {.name = "points", .type = points, .wire = {.length = FieldWidth::bits16}},
                      {.name = "name", .type = text, .wire = {.length = FieldWidth::bits8}},
                      {.name = "end", .type = u16}};
  }
  Model model;
  Payload payload;
};

TEST(Layout, KnowsWhetherLengthFieldsHaveAByteOrder) {
  Points points;
  EXPECT_TRUE(has_length_fields(points.model, points.payload));
  points.payload.values.erase(points.payload.values.begin() + 1);
  EXPECT_FALSE(has_length_fields(points.model, points.payload));  // the string has one of a single byte
  points.payload.values.front().tag = DataId{1};
  EXPECT_TRUE(has_length_fields(points.model, points.payload));
  // Inside of types, also of those that contain themselves.
  Model model;
  const TypeIndex text = model.add({.kind = Kind::string});
  const TypeIndex loop = model.add({.kind = Kind::structure, .name = "Loop"});
  model.at(loop).members = {{.name = "again", .type = loop}};
  const TypeIndex derived = model.add({.kind = Kind::structure, .base = loop});
  const Payload payload{.values = {{.name = "v", .type = derived}}};
  EXPECT_FALSE(has_length_fields(model, payload));
  model.at(loop).members.push_back({.name = "s", .type = text, .wire = default_wire(Kind::string)});
  EXPECT_TRUE(has_length_fields(model, payload));
}

/// Its bytes would say which of those that extend it follows, in a form that nothing has.
TEST(Layout, KnowsNoFormOfPolymorphicStructures) {
  Model model;
  const TypeIndex u8 = model.add({.kind = Kind::primitive});
  const TypeIndex shape = model.add({.kind = Kind::structure,
                                     .name = "Shape",
                                     .members = {{.name = "n", .type = u8}},
                                     .polymorphic = true});
  const TypeIndex disc = model.add({.kind = Kind::structure, .name = "Disc", .base = shape});
  for (const TypeIndex type : {shape, disc}) {
    const Payload payload{.values = {{.name = "v", .type = type}}};
    EXPECT_THAT(errors_of(layout(model, payload)), ElementsAre("0 v: a polymorphic structure"));
    EXPECT_THAT(errors_of(layout_of_bytes(model, payload, {"\x07", 1})),
                ElementsAre("0 v: a polymorphic structure"));
  }
}

TEST(Layout, ShowsWhatMayBeThere) {
  const Points points;
  EXPECT_THAT(
      lines_of(layout(points.model, points.payload)),
      ElementsAre("0 [1] n: uint8", "1 [2] points: length, big endian, bytes of all elements",
                  "3 [n × 3] points: Point[], any number of elements", ">0 [2] points[].x: int16, big endian",
                  ">2 [1] points[].side: Side", "3 + points [1] name: length, big endian, bytes of the text",
                  "4 + points [variable] name: string, UTF-8, BOM, terminator",
                  "4 + points + name [2] end: int16, big endian"));
}

TEST(Layout, ShowsWhatBytesAre) {
  const Points points;
  const Layout layout =
      layout_of_bytes(points.model, points.payload,
                      std::string_view{"\x07\0\x06\xff\xfe\x01\0\x02\x05\x06\xef\xbb\xbfhi\0\x12\x34", 18});
  EXPECT_THAT(layout.errors, IsEmpty());
  EXPECT_THAT(
      lines_of(layout),
      ElementsAre(
          "0 [1] n: uint8 = 7", "1 [2] points: length, big endian, bytes of all elements = 6",
          "3 [2] points[0].x: int16, big endian = -2", "5 [1] points[0].side: Side = RIGHT (1)",
          "6 [2] points[1].x: int16, big endian = 2", "8 [1] points[1].side: Side = 5 (no enumerator)",
          "9 [1] name: length, big endian, bytes of the text = 6",
          "10 [6] name: string, UTF-8, BOM, terminator = \"hi\"", "16 [2] end: int16, big endian = 4660"));
}

TEST(Layout, SpellsOutControlCharacters) {
  Model model;
  const TypeIndex text = model.add({.kind = Kind::string});
  const Payload payload{.values = {{.name = "s", .type = text, .wire = {.length = FieldWidth::bits8}}}};
  const std::string_view bytes{"\x0a\xef\xbb\xbf\x1b\xc2\x9b\xe2\x80\xae\0", 11};
  EXPECT_EQ(layout_of_bytes(model, payload, bytes).ranges.at(1).value, "\"\\x1b\\u009b\\u202e\"");
}

TEST(Layout, TellsWhereBytesEnd) {
  const Points points;
  const auto errors = [&](std::string_view bytes) {
    return errors_of(layout_of_bytes(points.model, points.payload, bytes));
  };
  EXPECT_THAT(errors({"\x07\0", 2}), ElementsAre("1 points: 2 bytes are needed, 1 left"));
  EXPECT_THAT(errors({"\x07\0\x06\0\0", 5}), ElementsAre("3 points: the length is 6, 2 bytes are left"));
  EXPECT_THAT(errors({"\x07\0\x04\0\0\0\0\0\0\0", 10}),
              ElementsAre("6 points[1].x: 2 bytes are needed, 1 left"));
  EXPECT_THAT(errors({"\x07\0\0\0\0\0\xff", 7}), ElementsAre("6 : 1 bytes more than the description has"));
}

TEST(Layout, ShowsTheBytesBehindAnError) {
  const Points points;
  const Layout layout =
      layout_of_bytes(points.model, points.payload, std::string_view{"\x07\0\x06\0\x01", 5});
  EXPECT_EQ(lines_of(layout).back(), "3 [2] : bytes, not described = 00 01");
}

TEST(Layout, ReadsBitsAsTheConversionWritesThem) {
  // The example of docs/conversion.md: a 3 bits = 5, b 4 bits = -3, c 5 bits = 0x12.
  Model model;
  const TypeIndex u8 = model.add({.kind = Kind::primitive, .primitive = Primitive::uint8});
  const TypeIndex i8 = model.add({.kind = Kind::primitive, .primitive = Primitive::int8});
  const TypeIndex u16 = model.add({.kind = Kind::primitive, .primitive = Primitive::uint16});
  const Payload payload{.values = {{.name = "a", .type = u8, .wire = {.bits = 3}},
                                   {.name = "b", .type = i8, .wire = {.bits = 4}},
                                   {.name = "c", .type = u16, .wire = {.bits = 5}},
                                   {.name = "d", .type = u8, .wire = {.bits = 4}}}};
  EXPECT_THAT(
      lines_of(layout_of_bytes(model, payload, "\x6d\x09")),
      ElementsAre("0 [3 bits] a: uint8, from bit 0 on = 5", "0 [4 bits] b: int8, from bit 3 on = -3",
                  "0 [5 bits] c: uint16, from bit 7 on = 18", "1 [4 bits] d: uint8, from bit 4 on = 0"));
}

TEST(Layout, ReadsChoicesTagsAndStructuresWithLength) {
  Model model;
  const TypeIndex u16 = model.add({.kind = Kind::primitive, .primitive = Primitive::uint16});
  const TypeIndex text = model.add({.kind = Kind::string});
  const TypeIndex choice = model.add({.kind = Kind::choice,
                                      .members = {{.name = "a", .type = u16}, {.name = "b", .type = text}},
                                      .selectors = {1, 9}});
  const TypeIndex inner =
      model.add({.kind = Kind::structure, .name = "S", .members = {{.name = "v", .type = u16}}});
  const Payload payload{
      .values = {{.name = "t", .type = u16, .tag = DataId{1}},
                 {.name = "c", .type = choice, .wire = {.selector = FieldWidth::bits8}, .tag = DataId{2}},
                 {.name = "s", .type = inner, .tag = DataId{3}, .optional = true}},
      .tagged_length = FieldWidth::bits8};
  const std::string_view bytes{
      "\x10\x01\0\x05"
      "\x40\x02\x03\x01\0\x06"
      "\x50\x03\x03\0\x07\xee"
      "\x00\x04\x99",
      19};
  const Layout layout = layout_of_bytes(model, payload, bytes);
  EXPECT_THAT(errors_of(layout), IsEmpty());
  EXPECT_THAT(
      lines_of(layout),
      ElementsAre("0 [2] t: tag, big endian = data id 1, wire type 1", "2 [2] t: uint16, big endian = 5",
                  "4 [2] c: tag, big endian = data id 2, wire type 4",
                  "6 [1] c: length, big endian, bytes of selector and data = 3",
                  "7 [1] c: selector, big endian, which member follows = 1",
                  "8 [2] c.a: uint16, big endian = 6", "10 [2] s: tag, big endian = data id 3, wire type 5",
                  "12 [1] s: length, big endian, bytes of all members = 3",
                  "13 [2] s.v: uint16, big endian = 7",
                  "15 [1] s: bytes, not known here, skipped by the length = ee",
                  "16 [2] : tag, big endian = data id 4, wire type 0",
                  "18 [1] : bytes, a member that is not known = 99"));
}

TEST(Layout, SaysWhereOnlyATagTellsHowWideALengthFieldIs) {
  Model model;
  const TypeIndex u16 = model.add({.kind = Kind::primitive, .primitive = Primitive::uint16});
  const TypeIndex text = model.add({.kind = Kind::string});
  const Payload payload{.values = {{.name = "a", .type = u16, .tag = DataId{1}},
                                   {.name = "s", .type = text, .tag = DataId{2}},
                                   {.name = "b", .type = u16, .tag = DataId{3}}},
                        .tagged_length = FieldWidth::bits16,
                        .smallest_tagged_length = true};
  EXPECT_THAT(lines_of(layout(model, payload)),
              ElementsAre("0 [2] a: tag, data id 1, big endian", "2 [2] a: uint16, big endian",
                          "4 [2] s: tag, data id 2, big endian",
                          "6 [1, 2 or 4] s: length, big endian, bytes of the text; the tag tells how wide",
                          "6 + length of s [variable] s: string, UTF-8, BOM, terminator",
                          "6 + length of s + s [2] b: tag, data id 3, big endian",
                          "8 + length of s + s [2] b: uint16, big endian"));
  Payload configured = payload;
  configured.smallest_tagged_length = false;
  EXPECT_EQ(lines_of(layout(model, configured)).at(3), "6 [2] s: length, big endian, bytes of the text");
}

/// Nobody says where it stands, so no byte can be explained.
TEST(Layout, TellsOfACrcInThePayload) {
  Model model;
  const TypeIndex u16 = model.add({.kind = Kind::primitive, .primitive = Primitive::uint16});
  const Payload payload{.values = {{.name = "a", .type = u16}}, .crc_bytes = 4};
  EXPECT_THAT(
      lines_of(layout(model, payload)),
      ElementsAre("0 [2] a: uint16, big endian",
                  "? [4] (CRC): CRC, no source says where it is and how it is made: it is neither sent "
                  "nor read"));
  const Layout of_bytes = layout_of_bytes(model, payload, "abcdef");
  EXPECT_THAT(errors_of(of_bytes),
              ElementsAre("0 : a CRC of 4 bytes in the payload, which Trestle does not make"));
  EXPECT_THAT(lines_of(of_bytes), ElementsAre("0 [6] : bytes, not described = 61 62 63 64 65 66"));
}

TEST(Layout, SaysWhereNobodyKnowsWhatAPayloadIs) {
  EXPECT_THAT(lines_of(layout({}, {.known = false})),
              ElementsAre("0 [variable] : bytes, what it carries is not known"));
}

TEST(Layout, EndsWithTypesThatContainThemselves) {
  Model model;
  const TypeIndex node = model.add({.kind = Kind::structure, .name = "Node"});
  model.at(node).members = {{.name = "a", .type = node}, {.name = "b", .type = node}};
  const Payload payload{.values = {{.name = "n", .type = node}}};
  EXPECT_LE(layout(model, payload).ranges.size(), max_ranges + 1);
  EXPECT_THAT(layout_of_bytes(model, payload, "abc").errors, SizeIs(1));
}

/// S1 {S0 a S0 b}, S2 {S1 a S1 b} … : twice as many members a level.
TypeIndex doubled(Model& model, Type lowest, int levels) {
  lowest.name = "S0";
  TypeIndex last = model.add(std::move(lowest));
  for (int level = 1; level <= levels; ++level) {
    last = model.add({.kind = Kind::structure,
                      .name = fmt::format("S{}", level),
                      .members = {{.name = "a", .type = last}, {.name = "b", .type = last}}});
  }
  return last;
}

TEST(LayoutBounds, EndsATableOfStructuresThatHaveNoBytes) {
  Model model;
  const TypeIndex type = doubled(model, {.kind = Kind::structure}, 40);
  const Layout table = layout(model, {.values = {{.name = "all", .type = type}}});
  EXPECT_THAT(table.ranges, IsEmpty());
  ASSERT_THAT(table.errors, SizeIs(1));
  EXPECT_EQ(table.errors[0].text, "more than 200000 uses of types");
  // The same of bytes, and of a fixed array of nothing.
  EXPECT_THAT(layout_of_bytes(model, {.values = {{.name = "all", .type = type}}}, "x").errors, SizeIs(1));
  const TypeIndex array = model.add({.kind = Kind::array,
                                     .element = {.type = TypeIndex{0}},
                                     .max_size = 4'000'000'000,
                                     .fixed_size = true});
  EXPECT_THAT(
      layout_of_bytes(model,
                      {.values = {{.name = "all", .type = array, .wire = {.length = FieldWidth::none}}}}, "x")
          .errors,
      SizeIs(1));
}

TEST(LayoutBounds, MakesOneRangeOfWhatIsBehindTheLimit) {
  Model model;
  const TypeIndex type =
      doubled(model, {.kind = Kind::primitive, .primitive = messages::Primitive::uint8}, 40);
  const Payload payload{.values = {{.name = "all", .type = type}}};
  const Layout table = layout(model, payload);
  EXPECT_THAT(table.ranges, SizeIs(max_ranges));
  ASSERT_THAT(table.errors, SizeIs(1));
  EXPECT_EQ(table.errors[0].text, "more than 20000 ranges");
  const Layout of_bytes = layout_of_bytes(model, payload, std::string(30'000, 'x'));
  ASSERT_THAT(of_bytes.ranges, SizeIs(max_ranges + 1));
  EXPECT_EQ(of_bytes.ranges.back().bytes, 10'000U);
  EXPECT_THAT(of_bytes.errors, SizeIs(1));
}

TEST(LayoutBounds, DoesNotRepeatLongNamesWithoutEnd) {
  Model model;
  const TypeIndex number = model.add({.kind = Kind::primitive, .primitive = Primitive::uint8});
  Type inner{.kind = Kind::structure, .name = "Inner"};
  for (int i = 0; i < 2000; ++i) {
    inner.members.push_back({.name = fmt::format("m{}", i), .type = number});
  }
  const TypeIndex type = model.add(std::move(inner));
  const Layout table = layout(model, {.values = {{.name = std::string(1U << 20U, 'n'), .type = type}}});
  EXPECT_THAT(table.ranges.size(), ::testing::Lt(20U));
  ASSERT_THAT(table.errors, SizeIs(1));
  EXPECT_EQ(table.errors[0].text, "names of more than 16777216 bytes");
  // Offsets behind many texts end in …
  const TypeIndex text = model.add({.kind = Kind::string});
  Payload texts;
  for (int i = 0; i < 2000; ++i) {
    texts.values.push_back({.name = fmt::format("m{}", i), .type = text, .wire = default_wire(Kind::string)});
  }
  EXPECT_THAT(layout(model, texts).ranges.back().offset_text.size(), ::testing::Lt(1100U));
}

}  // namespace
}  // namespace trestle::describe
