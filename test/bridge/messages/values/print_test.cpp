// The text that payloads are printed as, next to the bytes.
#include "test/bridge/messages/values/support.hpp"

namespace trestle::messages::print_test {
namespace {

using namespace trestle::test;

constexpr const char* cloud =
    "00000001 00000002 00000007 efbbbf 6d6170 00"
    "00000001 00000001"
    "00000024 00000005 efbbbf 78 00 00000000 07 00000001"
    "         00000005 efbbbf 79 00 00000004 07 00000001"
    "00 00000004 00000004"
    "00000004 0000803f 01";

TEST(Print, PointCloudLikeRos2TopicEcho) {
  EXPECT_EQ(yaml(values_of(builtin("sensor_msgs/PointCloud2")), cloud),
            "header:\n"
            "  stamp:\n"
            "    sec: 1\n"
            "    nanosec: 2\n"
            "  frame_id: map\n"
            "height: 1\n"
            "width: 1\n"
            "fields:\n"
            "- name: x\n"
            "  offset: 0\n"
            "  datatype: 7\n"
            "  count: 1\n"
            "- name: \"y\"\n"  // which some readers take for yes
            "  offset: 4\n"
            "  datatype: 7\n"
            "  count: 1\n"
            "is_bigendian: false\n"
            "point_step: 4\n"
            "row_step: 4\n"
            "data: [0, 0, 128, 63]\n"
            "is_dense: true\n");
}

TEST(Print, PointCloudAsJsonOnOneLine) {
  EXPECT_EQ(json(values_of(builtin("sensor_msgs/PointCloud2")), cloud),
            R"({"header":{"stamp":{"sec":1,"nanosec":2},"frame_id":"map"},"height":1,"width":1,)"
            R"("fields":[{"name":"x","offset":0,"datatype":7,"count":1},)"
            R"({"name":"y","offset":4,"datatype":7,"count":1}],)"
            R"("is_bigendian":false,"point_step":4,"row_step":4,"data":[0,0,128,63],"is_dense":true})");
}

TEST(Print, NumbersInFull) {
  const auto values = values_of(tree_of("int8 a\nuint8 b\nint64 c\nuint64 d\nbool e\nchar f\nbyte g"));
  const char* const payload = "80 ff 8000000000000000 ffffffffffffffff 01 41 fe";
  EXPECT_EQ(yaml(values, payload),
            "a: -128\nb: 255\nc: -9223372036854775808\nd: 18446744073709551615\ne: true\nf: 65\ng: 254\n");
  EXPECT_EQ(json(values, payload), R"({"a":-128,"b":255,"c":-9223372036854775808,)"
                                   R"("d":18446744073709551615,"e":true,"f":65,"g":254})");
}

TEST(Print, FloatsInTheFewestDigitsThatReadBack) {
  const auto values = values_of(tree_of("float32[] a\nfloat64[] b"));
  // 1.0, 0.1f, -0.0, FLT_MAX, the smallest subnormal, 1e20
  const char* const payload =
      "00000018 3f800000 3dcccccd 80000000 7f7fffff 00000001 60ad78ec"
      "00000018 3fb999999999999a 7fefffffffffffff 0000000000000001";
  EXPECT_EQ(yaml(values, payload),
            "a: [1.0, 0.1, -0.0, 3.4028235e+38, 1.0e-45, 1.0e+20]\n"
            "b: [0.1, 1.7976931348623157e+308, 5.0e-324]\n");
  EXPECT_EQ(json(values, payload), R"({"a":[1.0,0.1,-0.0,3.4028235e+38,1.0e-45,1.0e+20],)"
                                   R"("b":[0.1,1.7976931348623157e+308,5.0e-324]})");
}

TEST(Print, WhatIsNoNumber) {
  const auto values = values_of(tree_of("float32[3] a\nfloat64 b"));
  const char* const payload = "7fc00000 7f800000 ff800000 fff8000000000000";
  EXPECT_EQ(yaml(values, payload), "a: [.nan, .inf, -.inf]\nb: .nan\n");
  EXPECT_EQ(json(values, payload), R"({"a":["NaN","Infinity","-Infinity"],"b":"NaN"})");
}

TEST(Print, StringsThatNoReaderTakesForSomethingElse) {
  const auto values = values_of(tree_of("string[] x"), {.string_bom = false, .string_terminator = false});
  const auto line = [&](std::string_view text) {
    const std::string digits = to_hex(std::as_bytes(std::span{text}));
    const auto length = static_cast<unsigned>(text.size());
    const std::string printed = yaml(values, fmt::format("{:08x}{:08x}{}", length + 4, length, digits));
    return printed.substr(std::min(printed.size(), std::string_view{"x:\n- "}.size()));
  };
  EXPECT_EQ(line("base_link"), "base_link\n");
  EXPECT_EQ(line("/camera/left"), "/camera/left\n");
  for (const char* const word :
       {"true", "No",   "off", "null", "y",          "1", "1.5", "-",  ".inf", "0x10", "",
        "a b",  "a: b", "#x",  "[",    "2024-01-01", "~", "*a",  "&a", "!x",   "'x'"}) {
    EXPECT_EQ(line(word), std::string{"\""} + word + "\"\n");
  }
  EXPECT_EQ(line("\"\\\n\t\x1b[31m\x7f"), "\"\\\"\\\\\\n\\t\\u001b[31m\\u007f\"\n");
  EXPECT_EQ(line("\xc3\xa4\xf0\x9f\x98\x80"), "\"\xc3\xa4\xf0\x9f\x98\x80\"\n");
  EXPECT_EQ(line("a\xe2\x80\xae"
                 "b"),
            "\"a\\u202eb\"\n");                  // right to left from here on
  EXPECT_EQ(line("\xc2\x9b"), "\"\\u009b\"\n");  // introduces control sequences
  EXPECT_EQ(line("a\xff\xc3"), "\"a\xef\xbf\xbd\xef\xbf\xbd\"\n");
}

TEST(Print, WideStringsAlsoWithHalfACharacter) {
  const auto values = values_of(tree_of("wstring x"));
  EXPECT_EQ(json(values, "0000000c feff 0061 00e4 d83d de00 0000"), "{\"x\":\"a\xc3\xa4\xf0\x9f\x98\x80\"}");
  EXPECT_EQ(json(values, "00000008 feff d83d 0061 0000"),
            "{\"x\":\"\xef\xbf\xbd"
            "a\"}");
}

TEST(Print, EmptyThings) {
  EXPECT_EQ(yaml(values_of(builtin("std_msgs/Empty")), "00"), "{}\n");
  EXPECT_EQ(json(values_of(builtin("std_msgs/Empty")), "00"), "{}");
  const auto values =
      values_of(nested_tree("uint8 ONE=1", "Part a\nPart[] b\nPart[] c\nstring d\nstring[] e"));
  const char* const payload = "00 00000002 0000 00000000 00000004 efbbbf00 00000000";
  EXPECT_EQ(yaml(values, payload), "a: {}\nb:\n- {}\n- {}\nc: []\nd: \"\"\ne: []\n");
  EXPECT_EQ(json(values, payload), R"({"a":{},"b":[{},{}],"c":[],"d":"","e":[]})");
}

TEST(Print, ArraysWithinArrays) {
  const auto values = values_of(nested_tree("uint8[] n\nstring[] s", "Part[2] parts\nuint8 last"),
                                {.string_bom = false, .string_terminator = false});
  EXPECT_EQ(yaml(values,
                 "00000002 0102 00000005 00000001 61"
                 "00000000 00000000 09"),
            "parts:\n- n: [1, 2]\n  s:\n  - a\n- n: []\n  s: []\nlast: 9\n");
}

TEST(Print, BytesAsTheOptionSays) {
  const auto values = values_of(tree_of("uint8[] a\nchar[2] b\nint8[] c\nbool[1] d\nuint8[] e"));
  const char* const payload = "00000004 00010afe 4142 00000001 ff 01 00000000";
  EXPECT_EQ(yaml(values, payload, {.bytes = BytesForm::hex}),
            "a: \"hex:00010afe\"\nb: \"hex:4142\"\nc: [-1]\nd: [true]\ne: \"hex:\"\n");
  EXPECT_EQ(yaml(values, payload, {.bytes = BytesForm::base64}),
            "a: !!binary \"AAEK/g==\"\nb: !!binary \"QUI=\"\nc: [-1]\nd: [true]\ne: !!binary \"\"\n");
  EXPECT_EQ(json(values, payload, {.bytes = BytesForm::base64}),
            R"({"a":"AAEK/g==","b":"QUI=","c":[-1],"d":[true],"e":""})");
}

TEST(Print, OnlyTheBeginningOfWhatIsLong) {
  const auto values = values_of(nested_tree("string s", "uint8[] a\nPart[] b\nuint16[3] c\nstring d"),
                                {.string_bom = false, .string_terminator = false});
  const char* const payload =
      "00000004 01020304"
      "0000000f 00000001 61 00000001 62 00000001 63"
      "0001 0002 0003 00000005 61c3a46364";
  EXPECT_EQ(yaml(values, payload, {.longest = 2}),
            "a: [1, 2, ...]  # 2 of 4\n"
            "b:\n- s: a\n- s: b\n- ...  # 2 of 3\n"
            "c: [1, 2, ...]  # 2 of 3\n"
            "d: \"a...\"  # 1 of 5 bytes\n");  // its second character begins within the limit and ends behind
  EXPECT_EQ(yaml(values, payload, {.longest = 4}),
            "a: [1, 2, 3, 4]\nb:\n- s: a\n- s: b\n- s: c\nc: [1, 2, 3]\nd: \"a\xc3\xa4"
            "c...\"  # 4 of 5 bytes\n");
  EXPECT_EQ(
      json(values, payload, {.longest = 2}),
      R"({"a":[1,2,"... 2 more"],"b":[{"s":"a"},{"s":"b"},"... 1 more"],"c":[1,2,"... 1 more"],"d":"a..."})");
  EXPECT_EQ(json(values, payload, {.bytes = BytesForm::hex, .longest = 2}).substr(0, 18),
            R"({"a":"hex:0102...")");
}

TEST(Print, SaysWhatIsWrongWithAPayload) {
  EXPECT_EQ(yaml(values_of(builtin("geometry_msgs/Point")), "0000"),
            "error: not a geometry_msgs/msg/Point: truncated at byte 0 in x: 8 bytes wanted, 2 left");
  EXPECT_EQ(json(values_of(builtin("std_msgs/String")), "00000001 61"),
            "error: not a std_msgs/msg/String: bad_string at byte 0 in data: BOM ef bb bf and terminator 00 "
            "wanted");
}

TEST(Print, SamplesInBothByteOrders) {
  const auto values = values_of(tree_of("uint8 a\nuint32 b\nstring c"));
  const auto print = [&](std::string_view sample) {
    const auto text = values.print_sample(hex(sample), ValueForm::json);
    return text ? *text : text.error();
  };
  EXPECT_EQ(print("00010000 01 000000 02000000 02000000 6100"), R"({"a":1,"b":2,"c":"a"})");
  EXPECT_EQ(print("00000000 01 000000 00000002 00000002 6100"), R"({"a":1,"b":2,"c":"a"})");
  EXPECT_EQ(print("00010000 01 000000 0200"), "the sample ends before the message does: 8 bytes read");
  EXPECT_EQ(print("00020000 01 000000 0200"), "not a sample in plain CDR");
  EXPECT_EQ(print("0001"), "not a sample in plain CDR");
}

TEST(Print, SamplesWithCountsBeyondTheirEnd) {
  const auto values = values_of(nested_tree("string s", "Part[] a\nuint64[] b\nwstring c"));
  for (const char* const sample : {"00010000 ffffffff", "00010000 00000000 ffffffff",
                                   "00010000 00000000 00000000 ffffffff", "00010000 01000000 ffffffff"}) {
    EXPECT_FALSE(values.print_sample(hex(sample), ValueForm::yaml, {.longest = 1})) << sample;
  }
}

}  // namespace
}  // namespace trestle::messages::print_test
