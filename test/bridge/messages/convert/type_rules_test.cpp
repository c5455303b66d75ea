// Tagged and optional members, unions, bit fields, strings of fixed size, maps, and what older senders leave
// out.
#include <gmock/gmock.h>

#include "test/bridge/messages/convert/type_rules.hpp"
#include "test/covers.hpp"

namespace trestle::messages::type_rules_test {
namespace {

using namespace trestle::test;
using someip::DataId;
using someip::FieldWidth;
using testing::HasSubstr;

/// Strings without BOM and terminator keep the bytes below short.
MessageRules plain_rules() {
  MessageRules rules;
  rules.payload.string_bom = rules.payload.string_terminator = false;
  return rules;
}

// Tagged members

MessageRules sample_rules() {
  MessageRules rules = plain_rules();
  rules.types["test_msgs/msg/Test"].tags = {
      {"first", DataId{1}}, {"second", DataId{2}}, {"third", DataId{3}}, {"maybe", DataId{4}}};
  return rules;
}
constexpr const char* sample = "int16 first\nuint32 second\nuint8[] third\nfloat64[<=1] maybe";

TEST(TaggedMembers, AgreeWithSerdeSomeip) {
  // The payload is that which serde_someip (a library in Rust) makes of -1, 42 and [1, 2, 3] in its own
  // tests.
  MessageRules rules = sample_rules();
  rules.payload.smallest_tagged_length = true;
  const TypeTree tree = tree_of(sample);
  expect_both_ways(plan(tree, rules), "00010000 ffff 0000 2a000000 03000000 010203 00 00000000",
                   "1001 ffff 2002 0000002a 5003 03 010203");
  rules.payload.struct_length = FieldWidth::bits16;
  expect_both_ways(plan(tree, rules), "00010000 ffff 0000 2a000000 03000000 010203 00 00000000",
                   "0010 1001 ffff 2002 0000002a 5003 03 010203");
}

TEST(TaggedMembers, HaveTagsAndLengthsInNetworkByteOrderAlways) {
  covers({"feat_req_someip_675"});
  constexpr std::string_view cdr = "00010000 0100 0000 2a000000 03000000 010203 00 00000000";
  MessageRules rules = sample_rules();
  rules.payload.byte_order = std::endian::little;
  rules.payload.tagged_length = FieldWidth::bits16;
  expect_both_ways(plan(tree_of(sample), rules), cdr, "1001 0100 2002 2a000000 4003 0003 010203");
  rules.payload.length_fields_always_big = false;  // leaves the tags as they are
  expect_both_ways(plan(tree_of(sample), rules), cdr, "1001 0100 2002 2a000000 4003 0300 010203");
}

TEST(TaggedMembers, AreThereOrNotWhenOptional) {
  covers({"feat_req_someip_252"});
  const auto both = plan(tree_of(sample), sample_rules());
  expect_both_ways(both, "00010000 ffff 0000 2a000000 01000000 05 000000 01000000 00000000 000000000000f83f",
                   "1001 ffff 2002 0000002a 4003 00000001 05 3004 3ff8000000000000");
  expect_both_ways(both, "00010000 ffff 0000 2a000000 01000000 05 000000 00000000",
                   "1001 ffff 2002 0000002a 4003 00000001 05");
  EXPECT_EQ(
      to_someip(both, "00010000 ffff 0000 2a000000 00000000 02000000 0000000000000000 0000000000000000"),
      "bound_exceeded at byte 16 in maybe");
  EXPECT_EQ(to_someip(both, "00010000 ffff 0000 2a000000 00000000 01000000 00000000"),
            "truncated at byte 20 in maybe[0]");
}

TEST(TaggedMembers, ComeInAnyOrderAndAreSkippedWhenUnknown) {
  covers({"feat_req_someip_601", "feat_req_someipcompat_1198"});
  EXPECT_EQ(to_cdr(plan(tree_of(sample), sample_rules()),
                   "7003 00000001 05"                   // announced with 32 bits
                   "0fff 01  1fff 0102  2fff 01020304"  // unknown, of each wire type
                   "3fff 0102030405060708  4fff 00000001 07  5fff 01 07  6fff 0001 07  7fff 00000000"
                   "2002 0000002a"
                   "9001 ffff"),  // the reserved bit is ignored
            compact("00010000 ffff 0000 2a000000 01000000 05 000000 00000000"));
}

TEST(TaggedMembers, AreRefusedWhenMissingDoubledOrOfAnotherType) {
  const auto both = plan(tree_of(sample), sample_rules());
  EXPECT_EQ(to_cdr(both, "1001 ffff 4003 00000000"), "missing_member at byte 0 in second");
  EXPECT_EQ(to_cdr(both, ""), "missing_member at byte 0 in first");
  EXPECT_EQ(to_cdr(both, "1001 ffff 1001 ffff 2002 0000002a 4003 00000000"), "bad_tag at byte 4");
  EXPECT_EQ(to_cdr(both, "2001 0000ffff 2002 0000002a 4003 00000000"), "bad_tag at byte 0 in first");
  EXPECT_EQ(to_cdr(both, "1001 ffff 5002 04 0000002a 4003 00000000"), "bad_tag at byte 4 in second");
  EXPECT_EQ(to_cdr(both, "1001 ffff 2002 0000002a 0003 05"), "bad_tag at byte 10 in third");
}

TEST(TaggedMembers, AreRefusedBeyondTheEnd) {
  const auto both = plan(tree_of(sample), sample_rules());
  EXPECT_EQ(to_cdr(both, "10"), "truncated at byte 0");
  EXPECT_EQ(to_cdr(both, "1001 ff"), "truncated at byte 0");
  EXPECT_EQ(to_cdr(both, "1001 ffff 4003 00000003 0102"), "truncated at byte 4");
  EXPECT_EQ(to_cdr(both, "1001 ffff 7fff ffffffff"), "truncated at byte 4");
  MessageRules rules = sample_rules();
  rules.payload.struct_length = FieldWidth::bits8;
  const auto within = plan(tree_of(sample), rules);
  EXPECT_EQ(to_cdr(within, "03 1001 ffff"), "truncated at byte 1");
  EXPECT_EQ(to_cdr(within, "09 1001 ffff"), "truncated at byte 0");
}

const TypeTree& nested() {
  static const TypeTree tree =
      trees({{"Part", "uint8 kind\nstring name"},
             {"Flags", "bool a\nbool b\nbool[2] c"},
             {"Test",
              "Part part\nPart[] parts\nPart[2] pair\nstring text\nwstring wide\nbool[<=1] flag\n"
              "Flags flags\nPart[<=1] other\nuint16[2] two"}});
  return tree;
}

MessageRules nested_rules() {
  MessageRules rules = plain_rules();
  rules.payload.struct_length = FieldWidth::bits8;
  rules.payload.string_length = FieldWidth::bits8;
  rules.payload.tagged_length = FieldWidth::bits16;
  auto& test = rules.types["test_msgs/msg/Test"];
  std::uint16_t id = 0x10;
  for (const char* name : {"part", "parts", "pair", "text", "wide", "flag", "flags", "other", "two"}) {
    test.tags[name] = DataId{id++};
  }
  rules.types["test_msgs/msg/Part"].tags = {{"kind", DataId{0}}, {"name", DataId{1}}};
  rules.types["test_msgs/msg/Flags"].form = TypeRules::Form::bits8;
  return rules;
}

constexpr std::string_view nested_cdr =
    "00010000"
    "05 000000 03000000 616200 00"                   // part: 5, "ab"
    "01000000 06 000000 01000000 00"                 // parts: one of 6, ""
    "05 0000 03000000 616200 06 01000000 00 000000"  // pair: as both above
    "02000000 7800 0000"                             // text: "x"
    "01000000 e9000000"                              // wide: U+00E9
    "01000000 01"                                    // flag: there
    "01 00 01 01 000000"                             // flags: a, not b, both of c
    "01000000 07 000000 01000000 00 00"              // other: there
    "0100 0200";                                     // two

/// The message is a struct too: its length of 8 bits comes first.
std::string whole(std::string_view members) {
  const auto bytes = hex(members);
  return to_hex(std::array{static_cast<std::byte>(bytes.size())}) + to_hex(bytes);
}

TEST(TaggedMembers, MayBeOfAnyType) {
  covers({"feat_req_someip_689"});
  const auto both = plan(nested(), nested_rules());
  // Tagged: 16 bits of length. Within: structs of 8 bits, whose members are tagged again.
  constexpr std::string_view payload =
      "4010 0009  0000 05 4001 0002 6162"  // part: length, kind, name
      "4011 0008  07  0000 06 4001 0000"   // parts: one struct of 7 bytes
      "4012 0012  09  0000 05 4001 0002 6162  07  0000 06 4001 0000"
      "4013 0001 78"
      "4014 0002 00e9"
      "0015 01"
      "0016 0d"  // 1 + 4 + 8
      "4017 0007  0000 07 4001 0000"
      "4018 0004 0001 0002";
  expect_both_ways(both, nested_cdr, whole(payload));
}

TEST(TaggedMembers, AnnounceTheSmallestLength) {
  MessageRules rules = nested_rules();
  rules.payload.smallest_tagged_length = true;
  const auto both = plan(nested(), rules);
  constexpr std::string_view payload =
      "5010 08  0000 05 5001 02 6162"
      "5011 07  06  0000 06 5001 00"
      "5012 10  08  0000 05 5001 02 6162  06  0000 06 5001 00"
      "5013 01 78"
      "5014 02 00e9"
      "0015 01"
      "0016 0d"
      "5017 06  0000 07 5001 00"
      "5018 04 0001 0002";
  expect_both_ways(both, nested_cdr, whole(payload));
}

TEST(TaggedMembers, AnnounceTheSmallestLengthOfWhatIsOnlyReferenced) {
  MessageRules rules = plain_rules();
  rules.payload.smallest_tagged_length = true;
  rules.types["test_msgs/msg/Part"].tags = {{"a", DataId{1}}, {"b", DataId{2}}};
  rules.types["test_msgs/msg/Test"].tags = {{"part", DataId{3}}, {"last", DataId{4}}};
  const TypeTree tree = trees({{"Part", "uint8[] a\nuint8[] b"}, {"Test", "Part part\nuint8[] last"}});
  for (const std::size_t reference_from : {std::size_t{1}, std::size_t{4}, SIZE_MAX}) {
    const auto both = ConversionPlan::compile(tree, rules, reference_from);
    ASSERT_TRUE(both);
    EXPECT_EQ(to_someip(*both, "00010000 03000000 010203 00 05000000 0405060708 000000 04000000 090a0b0c"),
              compact("5003 0e 5001 03 010203 5002 05 0405060708  5004 04 090a0b0c"))
        << reference_from;
  }
}

TEST(TaggedMembers, NameTheFieldAtFault) {
  const auto both = plan(nested(), nested_rules());
  EXPECT_EQ(to_cdr(both, "0b 4010 0007 0000 05 4001 0001"), "truncated at byte 8 in part");
  EXPECT_EQ(to_cdr(both, "0b 4010 0007 0000 05 2001 00000000"), "truncated at byte 8 in part");
  EXPECT_EQ(to_cdr(both, "0d 4010 0009 0000 05 2001 00000000"), "bad_tag at byte 8 in part.name");
}

// What older senders leave out

TEST(MissingFields, GetTheDefaultOfTheMsgFile) {
  covers({"feat_req_someipcompat_1200"});
  MessageRules rules = plain_rules();
  rules.default_missing = true;
  const auto both = plan(
      tree_of("uint8 old\nint16 a -2\nfloat32 b 1.5\nbool c true\nstring d \"hi\"\nuint16[] e [1, 2]\n"
              "int8[2] f [-1, 7]\nwstring g \"\xc3\xa9\"\nstring[<=2] h [\"x\", 'y']\nuint32 i\nstring j"),
      rules);
  constexpr std::string_view cdr =
      "00010000 05 00 feff 0000c03f 01 000000 03000000 686900 00 02000000 0100 0200"
      "ff 07 0000 01000000 e9000000 02000000 02000000 7800 0000 02000000 7900 0000 00000000 01000000 00";
  EXPECT_EQ(to_cdr(both, "05"), compact(cdr));
  EXPECT_EQ(to_cdr(both, "05 fffe"), compact(cdr));
  EXPECT_EQ(to_cdr(both, "05 fffe 3fc00000 01 00000002 6869 00000004 00010002"), compact(cdr));
  // Half a field is none that an older sender would have written.
  EXPECT_EQ(to_cdr(both, "05 ff"), "truncated at byte 1 in a");
  EXPECT_EQ(to_cdr(both, "05 fffe 3fc000"), "truncated at byte 3 in b");
  // The other way all fields are written.
  EXPECT_EQ(to_someip(both, cdr),
            compact("05 fffe 3fc00000 01 00000002 6869 00000004 00010002 ff07 00000002 00e9"
                    "0000000a 00000001 78 00000001 79 00000000 00000000"));
}

TEST(MissingFields, AreAnErrorByDefault) {
  const auto both = plan(tree_of("uint8 old\nint16 a -2"), plain_rules());
  EXPECT_EQ(to_cdr(both, "05"), "truncated at byte 1 in a");
}

TEST(MissingFields, MayBeThoseOfAStructWithALength) {
  covers({"feat_req_someipcompat_1200"});
  MessageRules rules = plain_rules();
  rules.default_missing = true;
  const TypeTree tree = trees({{"Inner", "uint8 x 9"},
                               {"Part", "uint8 a\nInner inner\nuint8[] b\nInner[] c\nbool[3] d"},
                               {"Test", "Part part\nPart[] parts\nuint8 last 3"}});
  // Without a length field nobody knows where a struct ends: only the message's own fields may be missing.
  EXPECT_EQ(to_cdr(plan(tree, rules), "05"), "truncated at byte 1 in part.inner.x");
  EXPECT_EQ(to_cdr(plan(tree, rules), "05 06 00000000 00000000 010001"),
            compact("00010000 05 06 0000 00000000 00000000 010001 00 00000000 03"));
  rules.payload.struct_length = FieldWidth::bits8;
  // The message of 7 bytes; part, 1 byte; parts, 2 bytes: one of 1 byte.
  EXPECT_EQ(to_cdr(plan(tree, rules), "08 01 05 00000002 01 06"),
            compact("00010000 05 09 0000 00000000 00000000 000000 00 01000000"
                    "06 09 0000 00000000 00000000 000000 03"));
}

TEST(MissingFields, MayBeTaggedMembers) {
  covers({"feat_req_someipcompat_1200"});
  MessageRules rules = plain_rules();
  rules.default_missing = true;
  rules.types["test_msgs/msg/Test"].tags = {{"a", DataId{1}}, {"b", DataId{2}}, {"c", DataId{3}}};
  const auto both = plan(tree_of("uint8 a 7\nuint8[<=1] b\nuint16 c 258"), rules);
  EXPECT_EQ(to_cdr(both, ""), compact("00010000 07 000000 00000000 0201"));
  EXPECT_EQ(to_cdr(both, "0001 09"), compact("00010000 09 000000 00000000 0201"));
}

TEST(MissingFields, MakeNoLargeMessageOfASmallOne) {
  MessageRules rules;
  rules.default_missing = true;
  rules.payload.struct_length = FieldWidth::bits8;
  const TypeTree tree = trees({{"Part", "uint8[300000] a"}, {"Test", "Part[] parts"}});
  const auto both = plan(tree, rules);
  EXPECT_EQ(to_cdr(both, "07 00000003 000000").size(), 2U * (4 + 4 + 3 * 300000));
  EXPECT_EQ(to_cdr(both, "08 00000004 00000000"), "too_large at byte 9 in parts[3].a");
  EXPECT_EQ(to_cdr(plan(tree_of("string[1000000] a"), rules), "00"), "too_large at byte 1 in a");
}

// Unions

const TypeTree& shape() {
  static const TypeTree tree = trees({{"Circle", "uint16 radius"},
                                      {"Shape",
                                       "uint8[<=1] dot\nuint16[<=1] line\nCircle[<=1] circle\n"
                                       "string[<=1] text"},
                                      {"Test", "Shape shape\nuint8 after"}});
  return tree;
}

MessageRules shape_rules() {
  MessageRules rules = plain_rules();
  rules.types["test_msgs/msg/Shape"].form = TypeRules::Form::choice;
  return rules;
}

constexpr std::string_view dot_cdr = "00010000 01000000 05 000000 00000000 00000000 00000000 09";
constexpr std::string_view circle_cdr = "00010000 00000000 00000000 01000000 0201 0000 00000000 09";
constexpr std::string_view text_cdr = "00010000 00000000 00000000 00000000 01000000 03000000 6869 00 09";
constexpr std::string_view none_cdr = "00010000 00000000 00000000 00000000 00000000 09";

TEST(Union, IsAMessageOfOptionalFields) {
  covers({"feat_req_someip_263", "feat_req_someip_264", "feat_req_someip_272", "feat_req_someip_273",
          "feat_req_someip_565", "feat_req_someip_566"});
  const auto both = plan(shape(), shape_rules());
  expect_both_ways(both, dot_cdr, "00000001 00000001 05 09");
  expect_both_ways(both, circle_cdr, "00000002 00000003 0102 09");
  expect_both_ways(both, text_cdr, "00000006 00000004 00000002 6869 09");
}

TEST(Union, HasItsTypeAndLengthInBothOrdersAndAllWidths) {
  covers({"feat_req_someip_573", "feat_req_someip_563", "feat_req_someip_564", "feat_req_someip_675"});
  MessageRules rules = shape_rules();
  rules.payload.union_length_first = false;
  rules.payload.union_type = FieldWidth::bits8;
  rules.payload.union_length = FieldWidth::bits16;
  expect_both_ways(plan(shape(), rules), circle_cdr, "03 0002 0102 09");
  rules.payload.union_length_first = true;
  expect_both_ways(plan(shape(), rules), circle_cdr, "0002 03 0102 09");
  rules.payload.union_type = FieldWidth::bits16;
  rules.payload.union_length = FieldWidth::bits8;
  expect_both_ways(plan(shape(), rules), circle_cdr, "02 0003 0102 09");
  rules.payload.byte_order = std::endian::little;
  expect_both_ways(plan(shape(), rules), circle_cdr, "02 0003 0201 09");
  rules.payload.length_fields_always_big = false;
  expect_both_ways(plan(shape(), rules), circle_cdr, "02 0300 0201 09");
}

TEST(Union, SkipsPaddingAndPadsToAnAlignment) {
  covers({"feat_req_someip_274"});
  EXPECT_EQ(to_cdr(plan(shape(), shape_rules()), "00000004 00000001 05 ffffff 09"), compact(dot_cdr));
  MessageRules rules = shape_rules();
  rules.payload.alignment = 4;
  // The header of 16 bytes, 8 and 1 of the union: three zeros.
  expect_both_ways(plan(shape(), rules), dot_cdr, "00000001 00000001 05 000000 09");
}

TEST(Union, WithoutLengthIsPaddedToItsLongestType) {
  covers({"feat_req_someip_571", "feat_req_someip_583"});
  MessageRules rules = plain_rules();
  rules.payload.union_length = FieldWidth::none;
  rules.payload.union_type = FieldWidth::bits8;
  rules.types["test_msgs/msg/Shape"].form = TypeRules::Form::choice;
  const auto both =
      plan(trees({{"Shape", "uint8[<=1] a\nuint32[<=1] b"}, {"Test", "Shape shape\nuint8 after"}}), rules);
  expect_both_ways(both, "00010000 01000000 05 000000 00000000 09", "01 05000000 09");
  expect_both_ways(both, "00010000 00000000 01000000 04030201 09", "02 01020304 09");
  EXPECT_EQ(to_cdr(both, "01 050000"), "truncated at byte 0 in shape");
  EXPECT_THAT(compile_error(shape(),
                            [] {
                              MessageRules none = shape_rules();
                              none.payload.union_length = FieldWidth::none;
                              return none;
                            }()),
              HasSubstr("test_msgs/msg/Shape is a union without a length field: its types must have fixed "
                        "sizes"));
}

TEST(Union, IsEmptyOnlyWhereTheRulesSaySo) {
  covers({"feat_req_someip_273"});
  const auto strict = plan(shape(), shape_rules());
  EXPECT_EQ(to_someip(strict, none_cdr), "bad_union at byte 4 in shape");
  EXPECT_EQ(to_cdr(strict, "00000000 00000000 09"), "bad_union at byte 0 in shape");
  MessageRules rules = shape_rules();
  rules.payload.union_null = true;
  expect_both_ways(plan(shape(), rules), none_cdr, "00000000 00000000 09");
}

TEST(Union, RefusesSeveralMembersAndUnknownTypes) {
  covers({"feat_req_someip_263"});
  const auto both = plan(shape(), shape_rules());
  EXPECT_EQ(to_someip(both, "00010000 01000000 05 000000 01000000 0201 0000 00000000 00000000 09"),
            "bad_union at byte 9 in shape.line");
  EXPECT_EQ(to_cdr(both, "00000001 00000005 05 09"), "bad_union at byte 0 in shape");
  EXPECT_EQ(to_cdr(both, "00000001 ffffffff 05 09"), "bad_union at byte 0 in shape");
  EXPECT_EQ(to_cdr(both, "00000001 00000003 05 09"), "truncated at byte 8 in shape.circle[0].radius");
  EXPECT_EQ(to_cdr(both, "00000009 00000003 05 09"), "truncated at byte 0 in shape");
  EXPECT_EQ(to_cdr(both, "00000001 000000"), "truncated at byte 0 in shape");
}

TEST(Union, MayBeATaggedMember) {
  MessageRules rules = shape_rules();
  rules.types["test_msgs/msg/Test"].tags = {{"shape", DataId{1}}, {"after", DataId{2}}};
  rules.payload.union_type = FieldWidth::bits8;
  rules.payload.smallest_tagged_length = true;
  const auto both = plan(shape(), rules);
  // The length counts the type: 1 + 2.
  expect_both_ways(both, circle_cdr, "5001 03 03 0102 0002 09");
  EXPECT_EQ(to_cdr(both, "4001 00000003 03 0102 0002 09"), compact(circle_cdr));
  EXPECT_EQ(to_cdr(both, "5001 00 0002 09"), "truncated at byte 2 in shape");
  EXPECT_EQ(to_cdr(both, "5001 04 03 0102 ff 0002 09"), compact(circle_cdr));
}

// Bit fields, strings of fixed size, maps

TEST(BitField, PutsTheFirstFieldIntoTheLowestBit) {
  covers({"feat_req_someip_689"});
  const TypeTree tree =
      trees({{"Flags", "bool a\nbool b\nbool[3] c\nbool d"}, {"Test", "Flags flags\nuint8 x"}});
  MessageRules rules;
  auto& flags = rules.types["test_msgs/msg/Flags"];
  constexpr std::string_view cdr = "00010000 01 00 010001 01 07";  // bits 0, 2, 4 and 5
  flags.form = TypeRules::Form::bits8;
  expect_both_ways(plan(tree, rules), cdr, "35 07");
  flags.form = TypeRules::Form::bits16;
  expect_both_ways(plan(tree, rules), cdr, "0035 07");
  flags.form = TypeRules::Form::bits32;
  expect_both_ways(plan(tree, rules), cdr, "00000035 07");
  rules.payload.byte_order = std::endian::little;
  expect_both_ways(plan(tree, rules), cdr, "35000000 07");
  EXPECT_EQ(to_cdr(plan(tree, rules), "f5ffffff 07"), compact(cdr)) << "bits that stand for nothing";
  EXPECT_EQ(to_cdr(plan(tree, rules), "350000"), "truncated at byte 0 in flags.a");
  EXPECT_EQ(to_someip(plan(tree, rules), "00010000 01 00 010201 01 07"), "bad_bool at byte 7 in flags.c[1]");
  EXPECT_EQ(to_someip(plan(tree, rules), "00010000 01 00 01"), "truncated at byte 7 in flags.c[1]");
}

TEST(FixedString, FillsItsBytesWithZeros) {
  covers({"feat_req_someip_233"});
  MessageRules rules;
  rules.payload.string_length = FieldWidth::none;
  rules.types["test_msgs/msg/Test"].fixed_strings = {{"a", 8}, {"b", 10}, {"c", 4}};
  const auto both = plan(tree_of("string a\nwstring b\nstring[2] c\nuint8 d"), rules);
  expect_both_ways(both,
                   "00010000 03000000 686900 00 02000000 e9000000 41000000 01000000 00 000000 01000000 00 07",
                   "efbbbf 6869 000000  feff 00e9 0041 0000 0000  efbbbf00 efbbbf00 07");
  EXPECT_EQ(to_someip(both, "00010000 06000000 6162636465 00"), "length_overflow at byte 4 in a");
  EXPECT_EQ(to_cdr(both, "efbbbf 6869 0000"), "truncated at byte 0 in a");
  EXPECT_EQ(to_cdr(both, "efbbbf 6869 6a6b6c"), "bad_string at byte 0 in a") << "no terminator";
  EXPECT_EQ(to_cdr(both, "efbbbf 6869 00 6b 00"), "bad_string at byte 0 in a") << "something behind it";
}

TEST(FixedString, MayFillAllItsBytesWithoutTerminator) {
  MessageRules rules = plain_rules();
  rules.types["test_msgs/msg/Test"].fixed_strings = {{"a", 3}};
  const auto both = plan(tree_of("string a"), rules);
  expect_both_ways(both, "00010000 04000000 61626300", "616263");
  expect_both_ways(both, "00010000 02000000 6100", "610000");
  EXPECT_EQ(to_someip(both, "00010000 04000000 61006300"), "bad_string at byte 4 in a");
}

TEST(FixedString, HasALengthFieldOnlyBehindATag) {
  MessageRules rules = plain_rules();
  rules.types["test_msgs/msg/Test"].fixed_strings = {{"a", 3}};
  rules.types["test_msgs/msg/Test"].tags = {{"a", DataId{1}}};
  rules.payload.tagged_length = FieldWidth::bits8;
  const auto both = plan(tree_of("string a"), rules);
  expect_both_ways(both, "00010000 02000000 6100", "4001 03 610000");
  EXPECT_EQ(to_cdr(both, "4001 02 6100"), "bad_length at byte 2 in a");
}

TEST(Map, IsAnArrayOfKeysAndValues) {
  // The example of the specification: three entries of uint16 each, 12 bytes.  [feat_req_someip_300]
  const TypeTree tree = trees({{"Entry", "uint16 key\nuint16 value"}, {"Test", "Entry[] map"}});
  expect_both_ways(plan(tree, {}), "00010000 03000000 0100 0a00 0200 1400 0300 1e00",
                   "0000000c 0001 000a 0002 0014 0003 001e");
}

// Rules that contradict the type

TEST(TypeRulesCheck, SaysWhatIsWrong) {
  const auto with = [](const auto& change) {
    MessageRules rules;
    change(rules);
    return compile_error(nested(), rules);
  };
  const std::string begin = "test_msgs/msg/Test cannot be carried: ";
  using Rules = MessageRules;
  using Form = TypeRules::Form;
  EXPECT_EQ(with([](Rules& rules) { rules.types["test_msgs/msg/Tset"].form = Form::choice; }),
            begin + "there are rules for test_msgs/msg/Tset, which it does not contain");
  EXPECT_EQ(with([](Rules& rules) { rules.types["test_msgs/msg/Part"].tags["knid"] = DataId{1}; }),
            begin + "test_msgs/msg/Part has no field knid, for which there is a tag");
  EXPECT_EQ(with([](Rules& rules) { rules.types["test_msgs/msg/Part"].fixed_strings["nmae"] = 1; }),
            begin + "test_msgs/msg/Part has no field nmae, for which there is a size");
  EXPECT_EQ(with([](Rules& rules) { rules.types["test_msgs/msg/Part"].fixed_strings["kind"] = 1; }),
            begin + "part.kind has a fixed size of bytes, but is no string");
  EXPECT_EQ(with([](Rules& rules) { rules.types["test_msgs/msg/Part"].fixed_strings["name"] = 3; }),
            begin + "part.name is a string of 3 bytes: BOM and terminator need 4");
  EXPECT_EQ(with([](Rules& rules) { rules.types["test_msgs/msg/Test"].fixed_strings["wide"] = 7; }),
            begin + "wide is a string of 7 bytes: in UTF-16 they must be even");
  EXPECT_EQ(with([](Rules& rules) {
              rules.payload.struct_length = FieldWidth::bits8;
              rules.types["test_msgs/msg/Part"].tags["kind"] = DataId{1};
            }),
            begin + "test_msgs/msg/Part has tagged members, but name has no tag");
  const auto tag_part = [](Rules& rules) {
    rules.types["test_msgs/msg/Part"].tags = {{"kind", DataId{1}}, {"name", DataId{2}}};
  };
  EXPECT_EQ(with(tag_part),
            begin + "part has tagged members: it needs a struct length field to say where they end");
  EXPECT_EQ(with([&](Rules& rules) {
              tag_part(rules);
              rules.payload.struct_length = FieldWidth::bits8;
              rules.types["test_msgs/msg/Part"].tags["name"] = DataId{1};
            }),
            begin + "test_msgs/msg/Part has two members with the data id 1");
  EXPECT_EQ(with([&](Rules& rules) {
              tag_part(rules);
              rules.payload.struct_length = FieldWidth::bits8;
              rules.payload.alignment = 4;
            }),
            begin + "test_msgs/msg/Part has tagged members, which an alignment excludes");
  EXPECT_EQ(with([&](Rules& rules) {
              tag_part(rules);
              rules.payload.struct_length = FieldWidth::bits8;
              rules.payload.tagged_length = FieldWidth::none;
            }),
            begin + "part.kind is tagged: that needs a length field for tagged members");
  EXPECT_EQ(with([](Rules& rules) { rules.types["test_msgs/msg/Part"].form = Form::choice; }),
            begin +
                "test_msgs/msg/Part is a union: kind must be an array of at most one element, like "
                "uint8[<=1]");
  EXPECT_EQ(
      with([](Rules& rules) { rules.types["test_msgs/msg/Part"].form = Form::bits8; }),
      begin + "test_msgs/msg/Part is a bit field: kind must be a bool or an array of fixed size of bools");
  EXPECT_EQ(with([&](Rules& rules) {
              tag_part(rules);
              rules.types["test_msgs/msg/Part"].form = Form::bits8;
            }),
            begin + "test_msgs/msg/Part is no struct, so its fields have no tags or fixed sizes");
  MessageRules bits;
  bits.types["test_msgs/msg/Test"].form = Form::bits8;
  EXPECT_EQ(compile_error(tree_of("bool[9] a"), bits),
            begin + "test_msgs/msg/Test is a bit field of 8 bits, but has 9");
  MessageRules choice;
  choice.types["test_msgs/msg/Test"].form = Form::choice;
  choice.payload.union_type = FieldWidth::none;
  EXPECT_EQ(compile_error(tree_of("uint8[<=1] a"), choice),
            begin + "test_msgs/msg/Test is a union of 1 types: the type field is too short");
}

}  // namespace
}  // namespace trestle::messages::type_rules_test
