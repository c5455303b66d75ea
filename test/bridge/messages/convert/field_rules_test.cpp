// Rules of single uses: lengths, strings, unions, bits, variants.
#include <gmock/gmock.h>

#include "test/bridge/messages/convert/type_rules.hpp"
#include "test/covers.hpp"

namespace trestle::messages::field_rules_test {
namespace {

using namespace trestle::test;
using someip::FieldWidth;
using someip::StringEncoding;
using testing::HasSubstr;

using Fields = std::map<std::string, FieldRules, std::less<>>;

/// Of the fields of the message Test.
MessageRules of_fields(Fields fields) {
  MessageRules rules;
  rules.types["test_msgs/msg/Test"].fields = std::move(fields);
  return rules;
}

/// The rules of the field `a` of a message with nothing else.
ConversionPlan alone(const char* type, const FieldRules& rules) {
  return plan(tree_of(std::string{type} + " a"), of_fields({{"a", rules}}));
}

TEST(FieldRules, GiveArraysTheirLengthFields) {
  const TypeTree tree = tree_of("uint16[] a\nuint16[<=3] b\nuint16[2] c\nuint16[2] d\nuint8[] e");
  const auto both = plan(tree, of_fields({{"a", {.array_length = FieldWidth::bits8}},
                                          {"b", {.array_length = FieldWidth::bits16}},
                                          {"c", {.array_length = FieldWidth::bits8}}}));
  expect_both_ways(both, "00010000 01000000 0100 0000 02000000 0200 0300 0400 0500 0600 0700 01000000 09",
                   "02 0001  0004 0002 0003  04 0004 0005  0006 0007  00000001 09");
}

TEST(FieldRules, GiveStringsTheirFormAlsoInArrays) {
  expect_both_ways(alone("string", {.string_length = FieldWidth::bits8}), "00010000 03000000 686900",
                   "06 efbbbf 6869 00");
  expect_both_ways(alone("string[]", {.array_length = FieldWidth::bits8,
                                      .string_length = FieldWidth::bits16,
                                      .bom = false,
                                      .terminator = false}),
                   "00010000 02000000 03000000 686900 00 02000000 6100", "07 0002 6869 0001 61");
  expect_both_ways(alone("string", {.string_length = FieldWidth::bits8, .encoding = StringEncoding::utf16le}),
                   "00010000 04000000 61c3a400", "08 fffe 6100 e400 0000");
  expect_both_ways(alone("string", {.encoding = StringEncoding::utf16be, .bom = false}),
                   "00010000 04000000 61c3a400", "00000006 0061 00e4 0000");
  expect_both_ways(alone("wstring", {.encoding = StringEncoding::utf16le, .terminator = false}),
                   "00010000 01000000 e4000000", "00000004 fffe e400");
  MessageRules fixed = of_fields({{"a", {.encoding = StringEncoding::utf16be}}});
  fixed.types["test_msgs/msg/Test"].fixed_strings["a"] = 8;
  expect_both_ways(plan(tree_of("string a"), fixed), "00010000 02000000 6100", "feff 0061 0000 0000");
}

TEST(FieldRules, DoNotSpoilQuickWaysOfOtherFields) {
  const TypeTree tree = tree_of("string a\nstring b\nuint8[] c\nuint8[] d");
  const auto both =
      plan(tree, of_fields({{"b", {.bom = false}}, {"d", {.array_length = FieldWidth::bits8}}}));
  const Program& program = both.program();
  EXPECT_TRUE(program.quick.is_usual);
  EXPECT_EQ(program.ops[0].loop, Op::Loop::string);
  EXPECT_EQ(program.ops[1].loop, Op::Loop::no);
  EXPECT_EQ(program.ops[2].loop, Op::Loop::array);
  EXPECT_EQ(program.ops[3].loop, Op::Loop::no);
  expect_both_ways(both, "00010000 02000000 6100 0000 02000000 6200 0000 01000000 07 000000 01000000 08",
                   "00000005 efbbbf 61 00  00000002 62 00  00000001 07  01 08");
}

TEST(FieldRules, GiveNestedMessagesALength) {
  const TypeTree tree = trees({{"Part", "uint8 a"}, {"Test", "Part a\nPart b\nPart[] c"}});
  const auto both = plan(tree, of_fields({{"b", {.struct_length = FieldWidth::bits16}},
                                          {"c", {.struct_length = FieldWidth::bits8}}}));
  expect_both_ways(both, "00010000 01 02 0000 02000000 03 04", "01  0001 02  00000004 01 03 01 04");
  // The payload itself, and whatever says nothing else.
  MessageRules itself;
  itself.types["test_msgs/msg/Test"].itself.struct_length = FieldWidth::bits16;
  itself.types["test_msgs/msg/Part"].itself.struct_length = FieldWidth::bits8;
  itself.types["test_msgs/msg/Test"].fields["b"].struct_length = FieldWidth::none;
  expect_both_ways(plan(tree, itself), "00010000 01 02 0000 00000000", "0007 01 01  02  00000000");
}

TypeTree with_union() {
  return trees({{"Shape", "uint8[<=1] a\nuint32[<=1] b\nstring[<=1] c"}, {"Test", "Shape s\nuint8 last"}});
}
MessageRules of_union(const FieldRules& use, const FieldRules& itself = {}) {
  MessageRules rules = of_fields({{"s", use}});
  rules.types["test_msgs/msg/Shape"].form = TypeRules::Form::choice;
  rules.types["test_msgs/msg/Shape"].itself = itself;
  return rules;
}
constexpr std::string_view b_is_6 = "00010000 00000000 01000000 06000000 00000000 09";

TEST(FieldRules, GiveUnionsTheirWidthsAndOrder) {
  const TypeTree tree = with_union();
  expect_both_ways(
      plan(tree, of_union({.union_length = FieldWidth::bits8, .union_type = FieldWidth::bits16})), b_is_6,
      "04 0002 00000006 09");
  expect_both_ways(plan(tree, of_union({.union_length_first = false}, {.union_length = FieldWidth::bits16,
                                                                       .union_type = FieldWidth::bits8})),
                   b_is_6, "02 0004 00000006 09");
}

TEST(FieldRules, GiveUnionsOtherSelectors) {
  const auto both =
      plan(with_union(), of_union({.union_type = FieldWidth::bits16, .selectors = {0, 700, 1}}));
  expect_both_ways(both, b_is_6, "00000004 02bc 00000006 09");
  expect_both_ways(both, "00010000 01000000 05 000000 00000000 00000000 09", "00000001 0000 05 09");
  EXPECT_EQ(to_cdr(both, "00000001 0002 05 09"), "bad_union at byte 0 in s");
  EXPECT_THAT(compile_error(with_union(), of_union({.selectors = {1, 2}})), HasSubstr("3 types"));
  EXPECT_THAT(compile_error(with_union(), of_union({.selectors = {1, 2, 1}})), HasSubstr("different"));
  EXPECT_THAT(
      compile_error(with_union(), of_union({.union_type = FieldWidth::bits8, .selectors = {1, 2, 256}})),
      HasSubstr("too short"));
}

TEST(FieldRules, DoWithoutTheLengthOfUnions) {
  const FieldRules bare{.union_length = FieldWidth::none, .union_type = FieldWidth::bits8, .union_bytes = 0};
  const auto unpadded = plan(with_union(), of_union(bare));
  expect_both_ways(unpadded, b_is_6, "02 00000006 09");
  expect_both_ways(unpadded, "00010000 00000000 00000000 01000000 02000000 6100 09",
                   "03 00000005 efbbbf 61 00 09");
  EXPECT_EQ(to_cdr(unpadded, "02 000000"), "truncated at byte 1 in s.b[0]");
  FieldRules padded = bare;
  padded.union_bytes = 10;
  const auto filled = plan(with_union(), of_union(padded));
  expect_both_ways(filled, b_is_6, "02 00000006 000000000000 09");
  EXPECT_EQ(to_someip(filled, "00010000 00000000 00000000 01000000 04000000 61626300 09"),
            "length_overflow at byte 4 in s");
  padded.union_bytes = 3;
  EXPECT_THAT(compile_error(with_union(), of_union(padded)), HasSubstr("a union of 3 bytes"));
}

TEST(FieldRules, PackBits) {
  const auto both =
      plan(tree_of("uint8 a\nint8 b\nuint16 c\nstring d\nuint8 e"),
           of_fields({{"a", {.bits = 3}}, {"b", {.bits = 4}}, {"c", {.bits = 5}}, {"d", {.bom = false}}}));
  // a = 5, b = -3, c = 0x12: from the lowest bit on 101, 1011, 0 | 1001.
  expect_both_ways(both, "00010000 05 fd 1200 01000000 00 07", "6d 09  00000001 00  07");
  EXPECT_EQ(to_someip(both, "00000000 05 fd 0013 00000001 00 07"),
            "ed090000000100"
            "07");
}

TEST(FieldRules, PackNumbersBehindBitsUntilAByteEnds) {
  // Four bits, then a whole byte, a boolean and four bits: all in three bytes. The next number is an ordinary
  // one.
  const auto both = plan(tree_of("uint8 a\nuint8 b\nbool c\nuint8 d\nuint16 e"),
                         of_fields({{"a", {.bits = 4}}, {"d", {.bits = 4}}}));
  expect_both_ways(both, "00010000 0a bc 01 0d 0201", "ca 1b d0 0102");
  // A struct begins with a byte, and so does a string or an array.
  const TypeTree tree =
      trees({{"Part", "uint8 x"}, {"Test", "uint8 a\nPart p\nuint8 b\nuint8[2] c\nuint8 d"}});
  expect_both_ways(plan(tree, of_fields({{"a", {.bits = 4}}, {"b", {.bits = 1}}, {"d", {.bits = 2}}})),
                   "00010000 0a 01 01 02 03 02", "0a 01 01 02 03 02");
}

TEST(FieldRules, PackNumbersOfMoreBitsInTheByteOrder) {
  const TypeTree tree = tree_of("uint8 a\nuint16 b\nint32 c");
  const Fields fields{{"a", {.bits = 4}}, {"b", {.bits = 12}}, {"c", {.bits = 24}}};
  // b = 0xabc: big endian 0xa, then 0xbc; c = -2.
  expect_both_ways(plan(tree, of_fields(fields)), "00010000 01 00 bc0a feffffff", "a1 bc ff ff fe");
  MessageRules little = of_fields(fields);
  little.payload.byte_order = std::endian::little;
  expect_both_ways(plan(tree, little), "00010000 01 00 bc0a feffffff", "c1 ab fe ff ff");
}

TEST(FieldRules, PackArraysOfFixedSizeAndRefuseOthers) {
  const auto both = plan(tree_of("uint8[3] a\nuint8 b"), of_fields({{"a", {.bits = 2}}, {"b", {.bits = 2}}}));
  expect_both_ways(both, "00010000 01 02 03 01", "79");
  EXPECT_EQ(to_someip(both, "00010000 01 04 03 01"), "bound_exceeded at byte 5 in a[1]");
  EXPECT_THAT(compile_error(tree_of("uint8[] a"), of_fields({{"a", {.bits = 2}}})), HasSubstr("whole bytes"));
}

TEST(FieldRules, RefuseNumbersThatBitsDoNotHold) {
  const auto both =
      plan(tree_of("uint8 a\nint8 b\nbool c"), of_fields({{"a", {.bits = 2}}, {"b", {.bits = 2}}}));
  EXPECT_EQ(to_someip(both, "00010000 03 fe 01"), "1b00");
  EXPECT_EQ(to_someip(both, "00010000 04 fe 01"), "bound_exceeded at byte 4 in a");
  EXPECT_EQ(to_someip(both, "00010000 03 02 01"), "bound_exceeded at byte 5 in b");
  EXPECT_EQ(to_someip(both, "00010000 03 fd 01"), "bound_exceeded at byte 5 in b");
  EXPECT_EQ(to_someip(both, "00010000 03 fe 02"), "bad_bool at byte 6 in c");
  EXPECT_EQ(to_someip(both, "00010000 03"), "truncated at byte 5 in b");
  EXPECT_EQ(to_cdr(both, "1b"), "truncated at byte 0 in a");
  EXPECT_EQ(to_cdr(both, "fbff"), "0001000003fe01");
}

TEST(FieldRules, LetATypeHaveOtherRulesElsewhere) {
  const TypeTree tree =
      trees({{"Part", "string a\nuint8[] b"}, {"Test", "Part first\nPart second\nPart[] more"}});
  MessageRules rules = of_fields(
      {{"second", {.variant = "test_msgs/msg/Part#2"}}, {"more", {.variant = "test_msgs/msg/Part#2"}}});
  rules.types["test_msgs/msg/Part"].fields["b"].array_length = FieldWidth::bits16;
  rules.types["test_msgs/msg/Part#2"].fields["a"] = {.string_length = FieldWidth::bits8, .bom = false};
  rules.types["test_msgs/msg/Part#2"].itself.struct_length = FieldWidth::bits8;
  const std::string one = "02000000 6100 0000 01000000 05";
  expect_both_ways(plan(tree, rules), "00010000" + one + "000000" + one + "000000 01000000" + one,
                   "00000005 efbbbf 61 00 0001 05"
                   "08 02 61 00 00000001 05"
                   "00000009 08 02 61 00 00000001 05");
}

TEST(FieldRules, LeaveOutTheByteOfAnEmptyMessage) {
  const TypeTree tree = trees({{"None", ""}, {"Test", "uint8 a\nNone n\nuint8 b"}});
  MessageRules rules;
  expect_both_ways(plan(tree, rules), "00010000 01 00 02", "010002");
  rules.types["test_msgs/msg/None"].form = TypeRules::Form::empty;
  expect_both_ways(plan(tree, rules), "00010000 01 00 02", "0102");
  const TypeTree many = trees({{"None", ""}, {"Test", "None[] n"}});
  EXPECT_THAT(compile_error(many, rules), HasSubstr("may have no bytes"));
  rules.types["test_msgs/msg/Test"].fields["n"].struct_length = FieldWidth::bits8;
  EXPECT_THAT(compile_error(many, rules), HasSubstr("is no struct"));
}

TEST(FieldRules, AreRefusedWhereTheyMeanNothing) {
  const auto error = [](const char* type, const FieldRules& rules) {
    return compile_error(tree_of(std::string{type} + " a"), of_fields({{"a", rules}}));
  };
  EXPECT_THAT(error("uint8", {.array_length = FieldWidth::bits8}), HasSubstr("no array"));
  EXPECT_THAT(error("uint8[]", {.bom = true}), HasSubstr("rules of a string"));
  EXPECT_THAT(error("float32", {.bits = 3}), HasSubstr("no integer"));
  EXPECT_THAT(error("uint8", {.bits = 9}), HasSubstr("9 bits"));
  EXPECT_THAT(error("uint8", {.struct_length = FieldWidth::bits8}), HasSubstr("no struct"));
  EXPECT_THAT(error("uint8", {.union_bytes = 8}), HasSubstr("rules of a union"));
  EXPECT_THAT(error("uint8", {.variant = "test_msgs/msg/Test#2"}), HasSubstr("no message"));
  EXPECT_THAT(error("string", {.string_length = FieldWidth::none}), HasSubstr("fixed size"));
  EXPECT_THAT(compile_error(tree_of("uint8 a"), of_fields({{"b", {.bits = 2}}})), HasSubstr("no field b"));
  MessageRules unused;
  unused.types["test_msgs/msg/Test#2"].fields["a"].bits = 2;
  EXPECT_THAT(compile_error(tree_of("uint8 a"), unused), HasSubstr("no field takes"));
  const TypeTree tree = trees({{"Part", "uint8 a"}, {"Test", "Part a"}});
  EXPECT_THAT(compile_error(tree, of_fields({{"a", {.variant = "test_msgs/msg/Part#2"}}})),
              HasSubstr("none of test_msgs/msg/Part"));
  MessageRules tagged = of_fields({{"a", {.string_length = FieldWidth::bits8}}});
  tagged.types["test_msgs/msg/Test"].tags["a"] = someip::DataId{1};
  EXPECT_THAT(compile_error(tree_of("string a"), tagged), HasSubstr("is tagged"));
}

}  // namespace
}  // namespace trestle::messages::field_rules_test
