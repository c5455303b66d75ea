#include "bridge/messages/types/parsers.hpp"

#include <gtest/gtest.h>

#include <string>

namespace trestle::messages::msg_parser_test {
namespace {

tl::expected<MessageDefinition, TypeError> parse(std::string_view text) {
  return parse_msg(text, "my_msgs/msg/Thing", "Thing.msg");
}

std::string error_of(std::string_view text) {
  const auto parsed = parse(text);
  return parsed ? "no error" : to_string(parsed.error());
}

FieldType type_of(const std::string& field) {
  const auto parsed = parse(field + " x");
  EXPECT_TRUE(parsed) << field << ": " << error_of(field + " x");
  return parsed && parsed->fields.size() == 1 ? parsed->fields[0].type : FieldType{};
}

TEST(MsgParser, ReadsEveryPrimitive) {
  const std::pair<const char*, Primitive> all[] = {
      {"bool", Primitive::boolean},    {"byte", Primitive::byte},     {"char", Primitive::character},
      {"int8", Primitive::int8},       {"uint8", Primitive::uint8},   {"int16", Primitive::int16},
      {"uint16", Primitive::uint16},   {"int32", Primitive::int32},   {"uint32", Primitive::uint32},
      {"int64", Primitive::int64},     {"uint64", Primitive::uint64}, {"float32", Primitive::float32},
      {"float64", Primitive::float64}, {"string", Primitive::string}, {"wstring", Primitive::wstring},
  };
  for (const auto& [name, primitive] : all) {
    EXPECT_EQ(type_of(name), FieldType{.primitive = primitive}) << name;
    EXPECT_STREQ(to_string(primitive), name);
  }
}

// As Comments.msg of test_interface_files has them, of a version after Jazzy's.
TEST(MsgParser, PassesOverComments) {
  const auto parsed = parse(
      "# Normal comment\n"
      "uint8 value1\n"
      "\n"
      "# \tTab\n"
      "uint8 value2\n"
      "\n"
      "# Not a tab \\t\n"
      "uint8 value3\n"
      "\n"
      "# Not a newline (TODO: Doesn't work now)\n"
      "uint8 value4\n"
      "\n");
  ASSERT_TRUE(parsed) << to_string(parsed.error());
  ASSERT_EQ(parsed->fields.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(parsed->fields[i].name, "value" + std::to_string(i + 1));
    EXPECT_EQ(parsed->fields[i].type, FieldType{.primitive = Primitive::uint8});
  }
}

TEST(MsgParser, ReadsArraysAndBounds) {
  EXPECT_EQ(type_of("uint8[]"), (FieldType{.primitive = Primitive::uint8, .array = ArrayKind::unbounded}));
  EXPECT_EQ(type_of("float64[36]"),
            (FieldType{.primitive = Primitive::float64, .array = ArrayKind::fixed, .array_size = 36}));
  EXPECT_EQ(
      type_of("int16[<=4294967295]"),
      (FieldType{.primitive = Primitive::int16, .array = ArrayKind::bounded, .array_size = 4294967295}));
  EXPECT_EQ(type_of("string<=10"), (FieldType{.primitive = Primitive::string, .string_bound = 10}));
  EXPECT_EQ(type_of("wstring<=7"), (FieldType{.primitive = Primitive::wstring, .string_bound = 7}));
  EXPECT_EQ(
      type_of("string<=10[<=5]"),
      (FieldType{
          .primitive = Primitive::string, .string_bound = 10, .array = ArrayKind::bounded, .array_size = 5}));
}

TEST(MsgParser, CompletesNamesOfMessages) {
  EXPECT_EQ(type_of("Point").message, "my_msgs/msg/Point");
  EXPECT_EQ(type_of("geometry_msgs/Point").message, "geometry_msgs/msg/Point");
  EXPECT_EQ(type_of("geometry_msgs/msg/Point[3]"), (FieldType{.primitive = {},
                                                              .message = "geometry_msgs/msg/Point",
                                                              .array = ArrayKind::fixed,
                                                              .array_size = 3}));
}

TEST(MsgParser, ReadsConstantsDefaultsAndComments) {
  const auto parsed = parse(
      "# A comment, and an empty line\r\n"
      "\r\n"
      "uint8 SMALL=1   # without blanks\n"
      "\tint32 NEGATIVE = -0x10\n"
      "float64 PI=3.14159\n"
      "bool YES=true\n"
      "string PLAIN=it's plain,\r# and a comment\n"
      "string QUOTED=\"with # inside\" # and a comment\n"
      "string EMPTY=\n"
      "uint8 count 42\n"
      "string name \"a=b # c\"   # default with signs in it\n"
      "float32[3] rgb [0.5, 1e3, -2]\n"
      "string[] words [\"one, two\", 'three']\n"
      "int8[] none []\n"
      "builtin_interfaces/Time stamp#no blank before\n"
      "uint8 last");
  ASSERT_TRUE(parsed) << to_string(parsed.error());
  ASSERT_EQ(parsed->constants.size(), 7U);
  EXPECT_EQ(parsed->constants[0].name, "SMALL");
  EXPECT_EQ(parsed->constants[0].value, "1");
  EXPECT_EQ(parsed->constants[1].value, "-0x10");
  EXPECT_EQ(parsed->constants[4].value, "it's plain,");
  EXPECT_EQ(parsed->constants[5].value, "\"with # inside\"");
  EXPECT_EQ(parsed->constants[6].value, "");
  ASSERT_EQ(parsed->fields.size(), 7U);
  EXPECT_EQ(parsed->fields[0].default_value, "42");
  EXPECT_EQ(parsed->fields[1].default_value, "\"a=b # c\"");
  EXPECT_EQ(parsed->fields[2].default_value, "[0.5, 1e3, -2]");
  EXPECT_EQ(parsed->fields[3].default_value, "[\"one, two\", 'three']");
  EXPECT_EQ(parsed->fields[4].default_value, "[]");
  EXPECT_EQ(parsed->fields[5].name, "stamp");
  EXPECT_EQ(parsed->fields[5].line, 15);
  EXPECT_EQ(parsed->fields[6].name, "last");
}

TEST(MsgParser, AcceptsAMessageWithoutFields) {
  const auto parsed = parse("# nothing\nuint8 ONLY=1\n");
  ASSERT_TRUE(parsed);
  EXPECT_TRUE(parsed->fields.empty());
  EXPECT_EQ(parsed->constants.size(), 1U);
}

TEST(MsgParser, SaysWhereAndWhatWasExpected) {
  const std::pair<const char*, const char*> cases[] = {
      {"uint8 a\n\n  uint8",
       "Thing.msg:3:8: expected a blank and a name after the type, found the end of the line"},
      {"uint8 ", "Thing.msg:1:6: expected a blank and a name after the type, found the end of the line"},
      {"uint8 9lives", "Thing.msg:1:7: expected a field or constant name, found \"9lives\""},
      {"uint8 a-b", "Thing.msg:1:8: expected the end of the name, found \"-b\""},
      {"uint8 a\nint8 a", "Thing.msg:2:6: the name a is used twice"},
      {"---", "Thing.msg:1:1: expected a type, found \"---\""},
      {"a/b/c/d x",
       "Thing.msg:1:1: \"a/b/c/d\" is no type: expected a primitive type, Type, pkg/Type or pkg/msg/Type"},
      {"../etc/passwd x", "Thing.msg:1:1: expected a type, found \"../etc/passwd\""},
      {"a/srv/B x",
       "Thing.msg:1:1: \"a/srv/B\" is no type: expected a primitive type, Type, pkg/Type or "
       "pkg/msg/Type"},
      {"time t", "Thing.msg:1:1: \"time\" is a ROS 1 type; ROS 2 has builtin_interfaces/Time"},
      {"uint8[0] x", "Thing.msg:1:7: expected an array's size from 1 to 4294967295, found \"0]\""},
      {"uint8[4294967296] x",
       "Thing.msg:1:7: expected an array's size from 1 to 4294967295, found \"4294967296]\""},
      {"uint8[3 x", "Thing.msg:1:8: expected ], found \" x\""},
      {"uint8[3][4] x", "Thing.msg:1:9: arrays of arrays do not exist in .msg files"},
      {"string<= x", "Thing.msg:1:9: expected a string's bound from 1 to 4294967295, found \" x\""},
      {"uint8<=3 x", "Thing.msg:1:6: only string and wstring can be bounded by <=; uint8 cannot"},
      {"uint8 A=256", "Thing.msg:1:9: 256 is out of the range of uint8"},
      {"int8 A=-129", "Thing.msg:1:8: -129 is out of the range of int8"},
      {"uint64 A=18446744073709551616", "Thing.msg:1:10: 18446744073709551616 is out of the range of uint64"},
      {"uint8 A=one", "Thing.msg:1:9: expected an integer for uint8, found \"one\""},
      {"uint8 A=", "Thing.msg:1:9: expected a value for the constant A"},
      {"bool A=yes", "Thing.msg:1:8: expected true or false, found \"yes\""},
      {"float32 A=1.0.0", "Thing.msg:1:11: expected a number for float32, found \"1.0.0\""},
      {"string A=\"open", "Thing.msg:1:10: the string \"open has no closing quote"},
      {"string A=\"a\" b", "Thing.msg:1:10: nothing may follow the closing quote in \"a\" b"},
      {"string<=2 a abc", "Thing.msg:1:13: the string has more than 2 characters"},
      {"uint8[2] A=1", "Thing.msg:1:1: a constant must be of a primitive type, and no array"},
      {"Point A=1", "Thing.msg:1:1: a constant must be of a primitive type, and no array"},
      {"Point a 1",
       "Thing.msg:1:9: a field of type my_msgs/msg/Point can have no default value, found \"1\""},
      {"uint8[2] a 1", "Thing.msg:1:12: expected a default value like [1, 2] for an array, found \"1\""},
      {"uint8[2] a [1]", "Thing.msg:1:12: the default value has 1 elements, the array 2"},
      {"uint8[<=2] a [1,2,3]", "Thing.msg:1:14: the default value has 3 elements, the array at most 2"},
      {"uint8[] a [1,]", "Thing.msg:1:11: expected a value after the last comma"},
  };
  for (const auto& [text, error] : cases) {
    EXPECT_EQ(error_of(text), error) << text;
  }
}

TEST(MsgParser, AcceptsTheWholeRangeOfIntegers) {
  EXPECT_EQ(
      error_of("int64 A=-9223372036854775808\nint64 B=9223372036854775807\nuint64 C=0xffffffffffffffff\n"
               "int8 D=-128\nuint16 E=0b1111111111111111\nint32 F=+0o17"),
      "no error");
  EXPECT_EQ(error_of("int64 A=9223372036854775808"),
            "Thing.msg:1:9: 9223372036854775808 is out of the range of int64");
}

TEST(MsgParser, RefusesHugeFilesUnread) {
  EXPECT_EQ(error_of(std::string(max_msg_file_bytes + 1, '#')), "Thing.msg: larger than 1048576 bytes");
  EXPECT_EQ(error_of(std::string(max_msg_file_bytes, '#')), "no error");
}

TEST(FullTypeName, AddsTheMiddlePart) {
  EXPECT_EQ(full_type_name("std_msgs/String"), "std_msgs/msg/String");
  EXPECT_EQ(full_type_name("std_msgs/msg/String"), "std_msgs/msg/String");
  for (const char* name : {"", "String", "/", "a/", "/b", "a/b/c", "a/msg/", "a//b", "../a/msg/B",
                           "a/msg/../B", "std_msgs::msg::String", "a/msg/msg/B"}) {
    EXPECT_EQ(full_type_name(name), std::nullopt) << name;
  }
}

}  // namespace
}  // namespace trestle::messages::msg_parser_test
