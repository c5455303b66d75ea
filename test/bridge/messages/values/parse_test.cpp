// What text becomes, and what is said about text that does not suit the type.
#include "test/bridge/messages/values/support.hpp"

namespace trestle::messages::parse_test {
namespace {

using namespace trestle::test;

TEST(Parse, FieldsInAnyOrderAndMissingOnesAreZero) {
  const auto values = values_of(builtin("sensor_msgs/PointField"));
  EXPECT_EQ(from_yaml(values, "count: 3\nname: x\n"), compact("00000005 efbbbf 78 00 00000000 00 00000003"));
  EXPECT_EQ(from_yaml(values, "{offset: 0x10}"), compact("00000004 efbbbf 00 00000010 00 00000000"));
  EXPECT_EQ(from_json(values, R"({"datatype":7})"), compact("00000004 efbbbf 00 00000000 07 00000000"));
  EXPECT_EQ(from_yaml(values, ""), compact("00000004 efbbbf 00 00000000 00 00000000"));
  EXPECT_EQ(from_json(values, "{}"), compact("00000004 efbbbf 00 00000000 00 00000000"));
}

TEST(Parse, MissingFieldsHaveTheDefaultOfTheMsgFile) {
  const auto part = R"(int8 a -1
bool b true
float32 c 1.5
string d "it's"
string e 'a\'b\\c'
string f two words
uint8[] g [1, 0x02]
bool[2] h [1, False]
string[<=3] i ["x,y", 'z', w]
uint8 j
)";
  const someip::PayloadRules plain{.string_bom = false, .string_terminator = false};
  const auto values = values_of(nested_tree(part, "Part x\nPart[2] y"), plain);
  const std::string one = compact(
      "ff 01 3fc00000 00000004 69742773 00000005 6127625c63 00000009 74776f20776f726473 00000002 0102 0100"
      "00000011 00000003 782c79 00000001 7a 00000001 77 00");
  EXPECT_EQ(from_yaml(values, "{}"), one + one + one);
  EXPECT_EQ(from_yaml(values, "y: [{}, {j: 9}]"), one + one + one.substr(0, one.size() - 2) + "09");
  EXPECT_EQ(from_yaml(values, "x: {a: 1}").substr(0, 4), "0101");
}

TEST(Parse, NumbersAsPeopleWriteThem) {
  const auto values = values_of(tree_of("uint8[] a"));
  EXPECT_EQ(from_yaml(values, "a: [0, 255, 0xfF, 0o17, 0b101, +1, -0]"), compact("00000007 00ffff0f050100"));
  const auto floats = values_of(tree_of("float32[] a"));
  EXPECT_EQ(from_yaml(floats, "a: [1, -1.5, .5, 1e2, +2, 5.]"),
            compact("00000018 3f800000 bfc00000 3f000000 42c80000 40000000 40a00000"));
  EXPECT_EQ(from_yaml(floats, "a: [.nan, .inf, -.Inf, nan, \"Infinity\", -0.0]"),
            compact("00000018 7fc00000 7f800000 ff800000 7fc00000 7f800000 80000000"));
  EXPECT_EQ(from_json(floats, R"({"a":["NaN","-Infinity",-0,1E2]})"),
            compact("00000010 7fc00000 ff800000 80000000 42c80000"));
}

TEST(Parse, FloatsAreRoundedOnce) {
  // Halfway between two floats and a little: by way of a double, which drops the little, it would become the
  // even neighbour, 1.0.
  const auto values = values_of(tree_of("float32 a"));
  EXPECT_EQ(from_json(values, R"({"a":1.000000059604644775390625000001})"), "3f800001");
  EXPECT_EQ(from_json(values, R"({"a":1.000000059604644775390625})"), "3f800000");
}

TEST(Parse, IntegersThatNoDoubleHolds) {
  const auto values = values_of(tree_of("uint64 a\nint64 b"));
  EXPECT_EQ(from_json(values, R"({"a":18446744073709551615,"b":-9223372036854775808})"),
            "ffffffffffffffff8000000000000000");
  EXPECT_EQ(from_json(values, R"({"a":9007199254740993})"), "00200000000000010000000000000000");
}

TEST(Parse, Strings) {
  const someip::PayloadRules plain{.string_bom = false, .string_terminator = false};
  const auto values = values_of(tree_of("string a\nwstring b"), plain);
  EXPECT_EQ(from_yaml(values, "a: two words\nb: 'ä'"), compact("00000009 74776f20776f726473 00000002 00e4"));
  EXPECT_EQ(from_yaml(values, "a: 5\nb: true"), compact("00000001 35 00000008 0074007200750065"));
  EXPECT_EQ(from_json(values, R"({"a":"\u00e4\ud83d\ude00","b":"\ud83d\ude00"})"),
            compact("00000006 c3a4f09f9880 00000004 d83dde00"));
  EXPECT_EQ(from_json(values, R"({"a":"\u0000"})"), compact("00000001 00 00000000"));
  EXPECT_EQ(from_yaml(values, R"(a: "\0\x41\u00e4\U0001f600")"),
            compact("00000008 0041c3a4f09f9880 00000000"));
}

TEST(Parse, BytesAsOneString) {
  const auto values = values_of(tree_of("uint8[] a\nbyte[3] b\nchar[<=2] c"));
  EXPECT_EQ(from_yaml(values, "a: hex:00fF\nb: \"hex:010203\"\nc: !!binary QUI="),
            compact("00000002 00ff 010203 00000002 4142"));
  EXPECT_EQ(from_json(values, R"({"a":"AAEK/g==","b":"AQID"})"),
            compact("00000004 00010afe 010203 00000000"));
  EXPECT_EQ(from_json(values, R"({"a":"AAEK/g"})"), compact("00000004 00010afe 000000 00000000"));
  EXPECT_EQ(from_yaml(values, "a: !!binary |\n  AAEK\n  /g==\n"),
            compact("00000004 00010afe 000000 00000000"));
  const std::string expected = ": expected a list of uint8, or a string with base64 or \"hex:00ff\", found ";
  EXPECT_EQ(from_yaml(values, "a: 1234"), "1:4: a" + expected + "'1234'");  // no base64: a number is likelier
  for (const char* const bad : {"hex:0", "hex:0g", "A", "AAEK/g=", "AAEK/h==", "A===", "AA=A", "AAE*"}) {
    EXPECT_EQ(from_json(values, fmt::format(R"({{"a":"{}"}})", bad)),
              fmt::format("1:6: a{}the string '{}'", expected, bad));
  }
  EXPECT_EQ(from_yaml(values, "b: hex:0102"),
            "1:4: b: expected a list of 3 byte, or a string with base64 or \"hex:00ff\", found 2 bytes");
  EXPECT_EQ(
      from_yaml(values, "c: hex:010203"),
      "1:4: c: expected a list of at most 2 char, or a string with base64 or \"hex:00ff\", found 3 bytes");
}

TEST(Parse, NamesThePlaceAndTheFieldOfAnError) {
  const auto values = values_of(builtin("sensor_msgs/PointCloud2"));
  EXPECT_EQ(from_yaml(values, "header:\n  stamp:\n    sec: 1\n    nanosec: -1\n"),
            "4:14: header.stamp.nanosec: expected a whole number from 0 to 4294967295, found '-1'");
  EXPECT_EQ(
      from_yaml(values, "height: 1\nfields:\n- name: x\n- {name: z, ofset: 4}\n"),
      "4:13: fields[1]: 'ofset' is no field of sensor_msgs/msg/PointField; expected name, offset, datatype, "
      "count");
  EXPECT_EQ(from_json(values, "{\"height\": 1,\n \"fields\": [ {\"name\" : 5} ]}"),
            "2:24: fields[0].name: expected a string, found '5'");
  EXPECT_EQ(from_json(values, R"({"is_dense":1})"), "1:13: is_dense: expected true or false, found '1'");
  EXPECT_EQ(from_json(values, R"({"is_dense":"true"})"),
            "1:13: is_dense: expected true or false, found the string 'true'");
  EXPECT_EQ(from_yaml(values, "data: [0, 1, 256]"),
            "1:14: data[2]: expected a whole number from 0 to 255, found '256'");
  EXPECT_EQ(from_yaml(values, "height: 1.0"),
            "1:9: height: expected a whole number from 0 to 4294967295, found '1.0'");
  EXPECT_EQ(from_yaml(values, "height: '1'"),
            "1:9: height: expected a whole number from 0 to 4294967295, found the string '1'");
  EXPECT_EQ(from_yaml(values, "width: 1\nheight:"),
            "2:1: height: expected a whole number from 0 to 4294967295, found nothing");
  EXPECT_EQ(
      from_yaml(values, "header: map"),
      "1:9: header: expected a mapping with fields of std_msgs/msg/Header (stamp, frame_id), found 'map'");
  EXPECT_EQ(from_yaml(values, "fields: {name: x}"),
            "1:9: fields: expected a list of sensor_msgs/msg/PointField, found a mapping");
  EXPECT_EQ(
      from_yaml(values, "- 1"),
      "1:1: expected a mapping with fields of sensor_msgs/msg/PointCloud2 (header, height, width, fields, "
      "is_bigendian, point_step, row_step, data, is_dense), found a list of 1 element");
  EXPECT_EQ(from_yaml(values, "height: 1\nwidth: 1\nheight: 2"),
            "3:1: 'height' is given twice, first in line 1");
}

TEST(Parse, EnforcesBounds) {
  const auto values =
      values_of(tree_of("string<=3 a\nwstring<=2 b\nuint16[<=2] c\nfloat32[3] d\nstring<=1[] e"));
  EXPECT_EQ(from_yaml(values, "a: abcd"), "1:4: a: expected a string of at most 3 bytes, found 'abcd'");
  EXPECT_EQ(from_yaml(values, "a: \xc3\xa4\xc3\xa4"),
            "1:4: a: expected a string of at most 3 bytes, found '\xc3\xa4\xc3\xa4'");
  EXPECT_EQ(from_yaml(values, "b: abc"), "1:4: b: expected a string of at most 2 UTF-16 units, found 'abc'");
  EXPECT_EQ(from_yaml(values, "b: a\xf0\x9f\x98\x80").substr(0, 10),
            "1:4: b: ex");  // a surrogate pair is 2 units
  EXPECT_EQ(from_yaml(values, "c: [1, 2, 3]"),
            "1:4: c: expected a list of at most 2 uint16, found a list of 3 elements");
  EXPECT_EQ(from_yaml(values, "d: [1, 2]"),
            "1:4: d: expected a list of 3 float32, found a list of 2 elements");
  EXPECT_EQ(from_yaml(values, "d: [1, 2, 3, 4]"),
            "1:4: d: expected a list of 3 float32, found a list of 4 elements");
  EXPECT_EQ(from_yaml(values, "e: [a, bc]"), "1:8: e[1]: expected a string of at most 1 bytes, found 'bc'");
  EXPECT_EQ(from_yaml(values, "d: [1e39, 0, 0]"),
            "1:5: d[0]: expected a number from -3.4028235e+38 to 3.4028235e+38 or NaN, found '1e39'");
  EXPECT_EQ(from_yaml(values, "d: [0x1p3, 0, 0]").substr(0, 10), "1:5: d[0]:");
  EXPECT_EQ(from_yaml(values, "d: ['1', 0, 0]").substr(0, 10), "1:5: d[0]:");
  EXPECT_EQ(from_yaml(values, "d: [infinit, 0, 0]").substr(0, 10), "1:5: d[0]:");
}

TEST(Parse, RefusesPrintedTextThatIsNotWhole) {
  const auto values = values_of(tree_of("uint8[] a\nstring[] b"));
  const auto payload = hex("00000003 010203 00000000");
  const auto cut_yaml = values.print(payload, ValueForm::yaml, {.longest = 1});
  EXPECT_EQ(from_yaml(values, *cut_yaml), "1:8: a[1]: expected a whole number from 0 to 255, found '...'");
  const auto cut_json = values.print(payload, ValueForm::json, {.longest = 1});
  EXPECT_EQ(from_json(values, *cut_json),
            "1:9: a[1]: expected a whole number from 0 to 255, found the string '... 2 more'");
}

TEST(Parse, NamesTheFieldThatTheWireRulesCannotCarry) {
  const auto values =
      values_of(nested_tree("string[] s", "uint8 n\nPart[] p"),
                {.array_length = someip::FieldWidth::bits32, .string_length = someip::FieldWidth::bits8});
  EXPECT_EQ(from_yaml(values, "p:\n- s: [a]\n- s: [b, " + std::string(300, 'c') + "]"),
            "3:10: p[1].s[1]: more bytes than the length field can say");
  EXPECT_EQ(from_json(values, R"({"n": 1, "p": [{"s": ["a\u0000b"]}]})"),
            "1:23: p[0].s[0]: a string with a zero inside, where zeros end strings");
}

TEST(Parse, SaysInWordsThatANumberDoesNotFitIntoItsBits) {
  MessageRules rules;
  rules.types["test_msgs/msg/Test"].fields["b"].bits = 4;
  const auto values = values_with(tree_of("uint8 a\nuint8 b"), rules);
  EXPECT_EQ(from_yaml(values, "{a: 1, b: 15}"), "010f");
  EXPECT_EQ(from_yaml(values, "{a: 1, b: 16}"), "1:11: b: a number that does not fit into its bits");
}

TEST(Parse, RefusesWhatBecomesTooLarge) {
  const auto values = values_of(tree_of("float64[40000000] a"));
  EXPECT_EQ(from_yaml(values, "{}"), "a: the message becomes larger than 268435456 bytes");
}

}  // namespace
}  // namespace trestle::messages::parse_test
