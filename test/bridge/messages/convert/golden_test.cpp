// Bytes computed by hand, and bytes that the CommonAPI SOME/IP runtime 3.2.4 wrote.
#include <array>

#include "test/bridge/messages/convert/support.hpp"
#include "test/covers.hpp"

namespace trestle::messages::golden_test {
namespace {

using namespace trestle::test;
using someip::FieldWidth;
using someip::PayloadRules;
using someip::StringEncoding;

void expect_both_ways(const ConversionPlan& plan, std::string_view cdr, std::string_view payload) {
  EXPECT_EQ(to_someip(plan, cdr), compact(payload));
  EXPECT_EQ(to_cdr(plan, payload), compact(cdr));
}

TEST(Golden, String) {
  covers({"feat_req_someip_662", "feat_req_someip_687", "feat_req_someip_800", "feat_req_someip_237"});
  const auto plan = plan_of(builtin("std_msgs/String"));
  expect_both_ways(plan, "00010000 03000000 686900", "00000006 efbbbf 6869 00");
  expect_both_ways(plan, "00010000 01000000 00", "00000004 efbbbf 00");
}

TEST(Golden, Header) {
  const auto plan = plan_of(builtin("std_msgs/Header"));
  expect_both_ways(plan, "00010000 01000000 02000000 04000000 6d617000",
                   "00000001 00000002 00000007 efbbbf 6d6170 00");
}

TEST(Golden, PointCloud2) {
  const auto plan = plan_of(builtin("sensor_msgs/PointCloud2"));
  expect_both_ways(plan,
                   "00010000"
                   "01000000 02000000 04000000 6d617000"                      // stamp, "map"
                   "01000000 01000000"                                        // height, width
                   "01000000 02000000 7800 0000 00000000 07 000000 01000000"  // one field: "x", 0, FLOAT32, 1
                   "00 000000 04000000 04000000"                              // is_bigendian, steps
                   "04000000 0000803f 01",                                    // data, is_dense
                   "00000001 00000002 00000007 efbbbf 6d6170 00"
                   "00000001 00000001"
                   "00000012 00000005 efbbbf 78 00 00000000 07 00000001"
                   "00 00000004 00000004"
                   "00000004 0000803f 01");
}

TEST(Golden, Point) {
  // 1.0, -2.0, 0.5: an array of three numbers, eight bytes reversed each
  expect_both_ways(plan_of(builtin("geometry_msgs/Point")),
                   "00010000 000000000000f03f 00000000000000c0 000000000000e03f",
                   "3ff0000000000000 c000000000000000 3fe0000000000000");
}

TEST(Golden, CdrAlignsToTheBodyNotToTheHeader) {
  // The double begins at body byte 8, which is byte 12 of the sample.
  expect_both_ways(plan_of(tree_of("uint8 a\nfloat64 b\nuint8 c\nuint16 d")),
                   "00010000 07 00000000000000 000000000000f03f 09 00 0201", "07 3ff0000000000000 09 0102");
}

TEST(Golden, BigEndianCdrGivesTheSamePayload) {
  const auto plan = plan_of(builtin("std_msgs/Header"));
  EXPECT_EQ(to_someip(plan, "00000000 00000001 00000002 00000004 6d617000"),
            compact("00000001 00000002 00000007 efbbbf 6d6170 00"));
}

TEST(Golden, EmptySequencesAreNotFollowedByAlignment) {
  // As fastcdr and Cyclone do it: the padding belongs to the first element.
  expect_both_ways(plan_of(tree_of("float64[] a\nuint8 b")), "00010000 00000000 05", "00000000 05");
}

TEST(Golden, AMessageWithoutFieldsIsOneByte) {
  expect_both_ways(plan_of(builtin("std_msgs/Empty")), "00010000 00", "00");
}

TEST(Golden, LengthFieldsAreInNetworkByteOrderAlways) {
  covers({"feat_req_someip_675"});
  const TypeTree tree = tree_of("uint32 n\nuint16[] a\nuint8[2] p\nstring s\nwstring w");
  constexpr std::string_view cdr =
      "00010000 78563412 01000000 3412 0102 03000000 686900 00 01000000 e9000000";
  PayloadRules rules{.byte_order = std::endian::little,
                     .array_length = FieldWidth::bits16,
                     .fixed_array_length = FieldWidth::bits32,
                     .struct_length = FieldWidth::bits16};
  const auto specified = plan_of(tree, rules);
  expect_both_ways(specified, cdr,
                   "0022"                       // the message: 34 bytes follow
                   "78563412"                   // a number, as the payload
                   "0002 3412"                  // array
                   "00000002 0102"              // array of fixed size
                   "00000006 efbbbf 6869 00"    // string
                   "00000006 feff 00e9 0000");  // wstring: UTF-16, as its encoding says
  rules.length_fields_always_big = false;
  const auto as_payload = plan_of(tree, rules);
  expect_both_ways(as_payload, cdr,
                   "2200"
                   "78563412"
                   "0200 3412"
                   "02000000 0102"
                   "06000000 efbbbf 6869 00"
                   "06000000 feff 00e9 0000");
  // Neither takes the other's.
  EXPECT_EQ(to_cdr(specified, "2200 78563412"), "truncated at byte 0");
  EXPECT_EQ(to_cdr(as_payload, "0006 78563412"), "truncated at byte 0");
}

/// What CommonAPI wrote for a value of one field, its deployment told by the rules.
struct FromCommonApi {
  const char* msg;
  const char* cdr;
  const char* payload;
  PayloadRules rules;
};

PayloadRules with(void (*change)(PayloadRules&)) {
  PayloadRules rules = someip::commonapi_rules;
  change(rules);
  return rules;
}

TEST(Golden, WhatCommonApiWrites) {
  const auto little = with([](PayloadRules& rules) { rules.byte_order = std::endian::little; });
  const auto arrays1 = with([](PayloadRules& rules) { rules.array_length = FieldWidth::bits8; });
  const auto arrays2 = with([](PayloadRules& rules) { rules.array_length = FieldWidth::bits16; });
  const auto strings1 = with([](PayloadRules& rules) { rules.string_length = FieldWidth::bits8; });
  const auto strings2 = with([](PayloadRules& rules) { rules.string_length = FieldWidth::bits16; });
  const auto structs1 = with([](PayloadRules& rules) { rules.struct_length = FieldWidth::bits8; });
  const auto structs2 = with([](PayloadRules& rules) { rules.struct_length = FieldWidth::bits16; });
  const auto structs4 = with([](PayloadRules& rules) { rules.struct_length = FieldWidth::bits32; });
  const auto utf16le = with([](PayloadRules& rules) { rules.string_encoding = StringEncoding::utf16le; });
  const auto utf16be = with([](PayloadRules& rules) { rules.string_encoding = StringEncoding::utf16be; });
  const FromCommonApi lines[] = {
      {"bool x", "00010000 01", "01", {}},
      {"bool x", "00010000 00", "00", {}},
      {"int8 x", "00010000 fe", "fe", {}},
      {"int16 x", "00010000 feff", "fffe", {}},
      {"uint16 x", "00010000 3412", "1234", {}},
      {"int32 x", "00010000 feffffff", "fffffffe", {}},
      {"uint32 x", "00010000 78563412", "12345678", {}},
      {"int64 x", "00010000 feffffffffffffff", "fffffffffffffffe", {}},
      {"uint64 x", "00010000 efcdab8967452301", "0123456789abcdef", {}},
      {"float32 x", "00010000 0000c03f", "3fc00000", {}},
      {"float64 x", "00010000 00000000000002c0", "c002000000000000", {}},
      {"uint16[] x", "00010000 03000000 010002000300", "00000006000100020003", {}},
      {"uint16 x", "00010000 3412", "3412", little},
      {"uint64 x", "00010000 efcdab8967452301", "efcdab8967452301", little},
      {"string x", "00010000 03000000 686900", "06000000efbbbf686900", little},
      {"uint16[] x", "00010000 03000000 010002000300", "06000000010002000300", little},
      {"string x", "00010000 04000000 61c3a400", "07efbbbf61c3a400", strings1},
      {"string x", "00010000 04000000 61c3a400", "0007efbbbf61c3a400", strings2},
      {"string x", "00010000 04000000 61c3a400", "00000008fffe6100e4000000", utf16le},
      {"string x", "00010000 04000000 61c3a400", "00000008feff006100e40000", utf16be},
      {"uint8[] x", "00010000 03000000 010203", "03010203", arrays1},
      {"uint8[] x", "00010000 00000000", "00", arrays1},
      {"uint8[] x", "00010000 03000000 010203", "0003010203", arrays2},
      {"uint8[] x", "00010000 03000000 010203", "00000003010203", {}},
      {"int16[] x", "00010000 02000000 ffff0200", "04ffff0002", arrays1},
      {"float32[] x", "00010000 02000000 0000803f000080bf", "00083f800000bf800000", arrays2},
      {"float64[] x", "00010000 01000000 00000000 000000000000e03f", "000000083fe0000000000000", {}},
      {"float64[] x", "00010000 00000000", "00000000", {}},
      {"uint32[2] x", "00010000 01000000 02000000", "0000000100000002", {}},
      {"uint8[3] x", "00010000 010203", "010203", {}},
      {"string[] x",
       "00010000 02000000 02000000 6100 0000 01000000 00",
       "0000001100000005efbbbf610000000004efbbbf00",
       {}},
      {"uint8 a\nuint32 b", "00010000 07000000 04030201", "0701020304", {}},
      {"uint8 a\nuint32 b", "00010000 07000000 04030201", "050701020304", structs1},
      {"uint8 a\nuint32 b", "00010000 07000000 04030201", "00050701020304", structs2},
      {"uint8 a\nuint32 b", "00010000 07000000 04030201", "000000050701020304", structs4},
  };
  for (const auto& line : lines) {
    SCOPED_TRACE(std::string{line.msg} + " " + line.payload);
    expect_both_ways(plan_of(tree_of(line.msg), line.rules), line.cdr, line.payload);
  }
}

TEST(Golden, WhatCommonApiRefusesAndAccepts) {
  covers({"feat_req_someip_666", "feat_req_someip_601", "feat_req_someip_817"});
  const auto string = plan_of(tree_of("string x"));
  EXPECT_EQ(to_cdr(string, "00000003 686900"), "bad_string at byte 0 in x");       // without BOM
  EXPECT_EQ(to_cdr(string, "00000005 efbbbf6869"), "bad_string at byte 0 in x");   // without terminator
  EXPECT_EQ(to_cdr(string, "00000009 efbbbf686900"), "truncated at byte 0 in x");  // length beyond the data
  EXPECT_EQ(to_cdr(string, "00000000"), "bad_string at byte 0 in x");
  const auto numbers = plan_of(tree_of("uint16[] x"));
  EXPECT_EQ(to_cdr(numbers, "00000003 00010002"), "bad_length at byte 0 in x");
  EXPECT_EQ(to_cdr(numbers, "00000008 00010002"), "truncated at byte 0 in x");
  const auto structure = plan_of(tree_of("uint8 a\nuint32 b"),
                                 with([](PayloadRules& rules) { rules.struct_length = FieldWidth::bits8; }));
  EXPECT_EQ(to_cdr(structure, "06 07 01020304 09"), compact("00010000 07000000 04030201"));  // one byte more
  EXPECT_EQ(to_cdr(structure, "09 07 01020304"), "truncated at byte 0");
  // CommonAPI reads on beyond a struct length that is too small; we don't.
  EXPECT_EQ(to_cdr(structure, "03 07 01020304"), "truncated at byte 2 in b");
  const auto boolean = plan_of(tree_of("bool x"));
  EXPECT_EQ(to_cdr(boolean, "02"), "0001000000");
  EXPECT_EQ(to_cdr(boolean, "03"), "0001000001");
}

}  // namespace
}  // namespace trestle::messages::golden_test
