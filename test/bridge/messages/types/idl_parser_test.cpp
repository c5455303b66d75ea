#include "bridge/messages/types/parsers.hpp"

#include <gmock/gmock.h>

#include "bridge/messages/types/type_hash.hpp"
#include "test/bridge/messages/types/folder_test.hpp"

namespace trestle::messages::idl_parser_test {
namespace {

using testing::ElementsAre;

tl::expected<std::vector<MessageDefinition>, TypeError> parse(std::string_view text,
                                                              const char* name = "a/msg/A") {
  return parse_idl(text, *interface_name(name), "A.idl");
}

/// A message with these members.
tl::expected<std::vector<MessageDefinition>, TypeError> parse_members(const std::string& members) {
  return parse("module a { module msg { struct A {\n" + members + "\n}; }; };");
}

FieldType type_of(const std::string& member) {
  const auto parsed = parse_members(member);
  EXPECT_TRUE(parsed) << member << ": " << to_string(parsed.error());
  return parsed && parsed->at(0).fields.size() == 1 ? parsed->at(0).fields[0].type : FieldType{};
}

std::string default_of(const std::string& member) {
  const auto parsed = parse_members(member);
  return parsed ? parsed->at(0).fields.at(0).default_value : to_string(parsed.error());
}

std::string error_of(const tl::expected<std::vector<MessageDefinition>, TypeError>& parsed) {
  return parsed ? "no error" : to_string(parsed.error());
}

TEST(IdlParser, ReadsEveryPrimitive) {
  const std::pair<const char*, Primitive> all[] = {
      {"boolean", Primitive::boolean},
      {"octet", Primitive::byte},
      {"char", Primitive::character},
      {"float", Primitive::float32},
      {"double", Primitive::float64},
      {"short", Primitive::int16},
      {"unsigned short", Primitive::uint16},
      {"long", Primitive::int32},
      {"unsigned long", Primitive::uint32},
      {"long long", Primitive::int64},
      {"unsigned long long", Primitive::uint64},
      {"int8", Primitive::int8},
      {"uint8", Primitive::uint8},
      {"int16", Primitive::int16},
      {"uint16", Primitive::uint16},
      {"int32", Primitive::int32},
      {"uint32", Primitive::uint32},
      {"int64", Primitive::int64},
      {"uint64", Primitive::uint64},
      {"string", Primitive::string},
      {"wstring", Primitive::wstring},
  };
  for (const auto& [name, primitive] : all) {
    EXPECT_EQ(type_of(std::string{name} + " x;"), FieldType{.primitive = primitive}) << name;
  }
}

TEST(IdlParser, ReadsArraysSequencesAndBounds) {
  EXPECT_EQ(type_of("sequence<long long> x;"),
            (FieldType{.primitive = Primitive::int64, .array = ArrayKind::unbounded}));
  EXPECT_EQ(type_of("sequence<wstring<7>, 4294967295> x;"), (FieldType{.primitive = Primitive::wstring,
                                                                       .string_bound = 7,
                                                                       .array = ArrayKind::bounded,
                                                                       .array_size = 4294967295}));
  EXPECT_EQ(type_of("float x[36];"),
            (FieldType{.primitive = Primitive::float32, .array = ArrayKind::fixed, .array_size = 36}));
  EXPECT_EQ(type_of("b_msgs::msg::B x;").message, "b_msgs/msg/B");
  EXPECT_EQ(type_of("sequence<::b_msgs::srv::B_Request> x;"),
            (FieldType{.primitive = {}, .message = "b_msgs/srv/B_Request", .array = ArrayKind::unbounded}));
}

TEST(IdlParser, ReadsAMessage) {
  const auto parsed = parse(
      "// a comment\n#include \"b/msg/B.idl\"\n#include <c.idl>\n"
      "module a { module msg { /* more\n */\n"
      "  module A_Constants { const int32 MIN = -3; const string S = \"a\\\"b\" \"c\\x41\\101\"; };\n"
      "  module B_Constants { const float OTHER = 1.5; };\n"
      "  typedef b::msg::B b__msg__B;\n"
      "  typedef b__msg__B b__msg__B__3[3];\n"
      "  typedef sequence<double, 4> few;\n"
      "  @verbatim (language=\"comment\", text=\"about (A\" \"\\n\") @final\n"
      "  struct A {\n"
      "    @unit (value=\"m\") b__msg__B__3 bs;\n"
      "    few numbers;\n"
      "    @default (value=7) @range(min=1, max=9)\n"
      "    uint8 one, two[2];\n"
      "    sequence<b__msg__B> more;\n"
      "  };\n}; };\n");
  // All is skipped that means nothing, and the default value, which `two` cannot have, is found.
  EXPECT_EQ(error_of(parsed), "A.idl:15:21: expected a default value like \"(1, 2)\" for an array");
  const auto good = parse(
      "module a { module msg {\n"
      "  module A_Constants { const int32 MIN = -3; const string S = \"a\\\"b\" \"c\\x41\\101\"; };\n"
      "  module B_Constants { const float OTHER = 1.5; };\n"
      "  typedef b::msg::B b__msg__B;\n"
      "  typedef b__msg__B b__msg__B__3[3];\n"
      "  typedef sequence<double, 4> few;\n"
      "  struct A { b__msg__B__3 bs; few numbers; uint8 one, two[2]; sequence<b__msg__B> more; };\n"
      "}; };\n");
  ASSERT_TRUE(good) << error_of(good);
  ASSERT_EQ(good->size(), 1U);
  const MessageDefinition& message = good->front();
  EXPECT_EQ(message.name, "a/msg/A");
  ASSERT_EQ(message.constants.size(), 2U);
  EXPECT_EQ(message.constants[0].name, "MIN");
  EXPECT_EQ(message.constants[0].value, "-3");
  EXPECT_EQ(message.constants[1].value, "\"a\\\"bcAA\"");
  ASSERT_EQ(message.fields.size(), 5U);
  EXPECT_EQ(message.fields[0].type,
            (FieldType{.primitive = {}, .message = "b/msg/B", .array = ArrayKind::fixed, .array_size = 3}));
  EXPECT_EQ(message.fields[1].type,
            (FieldType{.primitive = Primitive::float64, .array = ArrayKind::bounded, .array_size = 4}));
  EXPECT_EQ(message.fields[2].type, FieldType{.primitive = Primitive::uint8});
  EXPECT_EQ(message.fields[3].type,
            (FieldType{.primitive = Primitive::uint8, .array = ArrayKind::fixed, .array_size = 2}));
  EXPECT_EQ(message.fields[4].type,
            (FieldType{.primitive = {}, .message = "b/msg/B", .array = ArrayKind::unbounded}));
  EXPECT_EQ(message.fields[3].line, 7);
}

TEST(IdlParser, WritesDefaultValuesAsInMsgFiles) {
  EXPECT_EQ(default_of("@default (value=TRUE) boolean x;"), "true");
  EXPECT_EQ(default_of("@default(-1.5e-3) double x;"), "-1.5e-3");
  EXPECT_EQ(default_of("@default (value=\"it's \\\"x\\\"\\n\") string x;"), "\"it's \\\"x\\\"\n\"");
  EXPECT_EQ(default_of("@default (value=\"Hell\\u00f6 \\u30cf\") wstring x;"), "\"Hell\u00f6 \u30cf\"");
  EXPECT_EQ(default_of("@default (value=\"\\u00f6\") string x;"), "\"u00f6\"");
  EXPECT_EQ(default_of("@default (value=\"(1, -2)\") int8 x[2];"), "[1, -2]");
  EXPECT_EQ(default_of("@default (value=\"(1,)\") sequence<int8> x;"), "[1]");
  EXPECT_EQ(default_of("@default (value=\"('', 'a, b')\") sequence<string, 3> x;"), "['', 'a, b']");
  EXPECT_EQ(default_of("@default (value=\"(False, True)\") sequence<boolean> x;"), "[False, True]");
  EXPECT_EQ(default_of("@default (value=256) uint8 x;"), "A.idl:2:17: 256 is out of the range of uint8");
  EXPECT_EQ(default_of("@default (value=\"abc\") string<2> x;"),
            "A.idl:2:17: the string has more than 2 characters");
  EXPECT_EQ(default_of("@default (value=1) string x;"), "A.idl:2:17: expected a string for string, found 1");
  EXPECT_EQ(default_of("@default (value=TRUE) uint8 x;"),
            "A.idl:2:17: expected an integer for uint8, found \"true\"");
}

TEST(IdlParser, TakesTheMemberOfEmptyStructsForNone) {
  const auto parsed = parse_members("uint8 structure_needs_at_least_one_member;");
  ASSERT_TRUE(parsed);
  EXPECT_TRUE(parsed->front().fields.empty());
}

// rmw_fastrtps makes keyless topics of them up to Jazzy.
TEST(IdlParser, TakesKeysForOrdinaryMembers) {
  const auto with_keys = parse_members("@key long x; @key @unit(value=\"m\") string y; @Key octet z;");
  const auto without = parse_members("long x; string y; octet z;");
  ASSERT_TRUE(with_keys) << error_of(with_keys);
  ASSERT_TRUE(without);
  ASSERT_EQ(with_keys->at(0).fields.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(with_keys->at(0).fields[i].name, without->at(0).fields[i].name);
    EXPECT_EQ(with_keys->at(0).fields[i].type, without->at(0).fields[i].type);
  }
}

TEST(IdlParser, RefusesTheOneFileOfTestInterfaceFilesThatSomeipCannotSay) {
  const char* const idl_only_types =
      "module test_msgs {\n"
      "  module msg {\n"
      "    struct IdlOnlyTypes {\n"
      "      wchar wchar_value;\n"
      "      long double long_double_value;\n"
      "    };\n"
      "  };\n"
      "};\n";
  EXPECT_EQ(error_of(parse(idl_only_types, "test_msgs/msg/IdlOnlyTypes")),
            "A.idl:4:7: wchar: SOME/IP has no single wide characters; take a wstring");
}

TEST(IdlParser, MakesServicesAndActionsOfTwoAndThreeStructs) {
  const auto service =
      parse("module a { module srv { struct S_Request { string x; }; struct S_Response { uint8 x; }; }; };",
            "a/srv/S");
  ASSERT_TRUE(service) << error_of(service);
  std::vector<std::string> names;
  std::ranges::transform(*service, std::back_inserter(names), &MessageDefinition::name);
  EXPECT_THAT(names, ElementsAre("a/srv/S_Request", "a/srv/S_Response", "a/srv/S_Event"));
  const auto action = parse(
      "module a { module action { struct G_Goal { string x; }; struct G_Result { uint8 x; };\n"
      "struct G_Feedback { uint8 x; }; }; };",
      "a/action/G");
  ASSERT_TRUE(action) << error_of(action);
  EXPECT_EQ(action->size(), 3U + 3U + 3U + 1U);
}

TEST(IdlParser, SaysWhereAndWhatIsRefused) {
  const std::pair<const char*, const char*> members[] = {
      {"wchar x;", "2:1: wchar: SOME/IP has no single wide characters; take a wstring"},
      {"long double x;", "2:1: long double: SOME/IP has no numbers of more than 64 bits"},
      {"unsigned x;", "2:10: expected short or long, found \"x\""},
      {"map<string, long> x;", "2:1: map: ROS 2 has no maps; take a sequence of keys and values"},
      {"sequence<any> x;", "2:10: any: ROS 2 has no any"},
      {"fixed<3,2> x;", "2:1: fixed: ROS 2 has no fixed-point numbers"},
      {"struct B { long y; } x;", "2:1: struct: a struct within another declaration"},
      {"@optional long x;", "2:2: @optional: rosidl always sends such a member, others do not"},
      {"sequence<sequence<long>> x;", "2:10: ROS 2 has no sequences of arrays or sequences"},
      {"long x[2][3];", "2:10: ROS 2 has no arrays of arrays"},
      {"sequence<long> x[2];", "2:17: ROS 2 has no arrays of arrays"},
      {"long x[0];", "2:8: expected a size from 1 to 4294967295, found \"0\""},
      {"long x[N];", "2:8: expected a size from 1 to 4294967295, found \"N\""},
      {"wstring<N> x;", "2:9: expected a size from 1 to 4294967295, found \"N\""},
      {"string<4294967296> x;", "2:8: expected a size from 1 to 4294967295, found \"4294967296\""},
      {"B x;", "2:1: unknown type B: expected a primitive type, one of a typedef, or package::msg::Type"},
      {"a::B x;",
       "2:1: unknown type a/B: expected a primitive type, one of a typedef, or package::msg::Type"},
      {"a::srv::B x;",
       "2:1: unknown type a/srv/B: expected a primitive type, one of a typedef, or package::msg::Type"},
      {"long x; long x;", "2:14: the name x is used twice"},
      {"long x", "3:1: expected ;, found \"}\""},
      {"long _x;", "2:6: expected a name, found \"_x\""},
      {"", "3:1: expected a member: in ROS, an empty struct has uint8 structure_needs_at_least_one_member"},
      {"@default (value=1) a::msg::B x;", "2:17: a member of type a/msg/B can have no default value"},
      {"@default (value=1+1) long x;", "2:18: expected ), found \"+\""},
      {"@default (value=X) long x;", "2:17: expected a number, TRUE, FALSE or a string, found \"X\""},
      {"@verbatim (text=\"x\" long x;", "3:9: expected ), found the end of the file"},
      {"@verbatim (text=\"x) long x;", "2:17: the string has no closing quote"},
      {"long x; /* y", "2:9: the comment has no end"},
      {"#define x y", "2:1: the only preprocessor directive in ROS is #include \"file\""},
  };
  for (const auto& [text, error] : members) {
    EXPECT_EQ(error_of(parse_members(text)), std::string{"A.idl:"} + error) << text;
  }
  const std::pair<const char*, const char*> files[] = {
      {"", "1:1: expected struct a/msg/A, found the end of the file"},
      {"module a {", "1:11: expected }, found the end of the file"},
      {"module a { module msg { enum E { X }; }; };",
       "1:25: enum: rosidl does not generate enumerations; take an integer and constants"},
      {"module a { module msg { union U switch(long) {}; }; };", "1:25: union: ROS 2 has no unions"},
      {"module a { module msg { struct B { long x; }; }; };",
       "1:32: expected struct a/msg/A, found struct a/msg/B"},
      {"module b { module msg { struct A { long x; }; }; };",
       "1:32: expected struct a/msg/A, found struct b/msg/A"},
      {"module a { module msg { struct A { long x; }; struct B { long x; }; }; };",
       "1:54: expected the end, found struct a/msg/B"},
      {"module a { module msg { struct A : B { long x; }; }; };",
       "1:34: rosidl knows no inheritance of structs"},
      {"module a { typedef long T; typedef short T; };",
       "1:42: the type T is defined twice, and differently"},
      {"module a { const long X = 1; const long X = 1; };", "1:41: the name X is used twice"},
      {"module a { const long X = \"1\"; };", "1:27: expected a number for int32, found \"1\""},
      {"module a { const b::msg::B X = 1; };", "1:18: a constant must be of a primitive type, and no array"},
      {"module a { module msg { module A_Constants { const long x = 1; }; struct A { long x; }; }; };",
       "1:57: the name x is used twice"},
      {"interface I {};", "1:1: interface: ROS 2 writes services as two structs"},
      {"foo", "1:1: expected module, struct, const or typedef, found \"foo\""},
      {"module a { module b { module c { module d { module e { module f { module g { module h { module i {",
       "1:96: modules are nested more than 8 deep"},
  };
  for (const auto& [text, error] : files) {
    EXPECT_EQ(error_of(parse(text)), std::string{"A.idl:"} + error) << text;
  }
}

using IdlFileTest = test::FolderTest;

TEST_F(IdlFileTest, IsFoundWhereThereIsNoOther) {
  write("a/msg/A.idl", "module a { module msg { struct A { char c; sequence<char> d; }; }; };");
  write("a/msg/B.idl", "not looked at");
  write("a/msg/B.msg", "char c\nchar[] d\n");
  write("a/srv/S.idl",
        "module a { module srv { struct S_Request { a::msg::A x; }; struct S_Response { uint8 x; }; }; };");
  TypeLibrary library{{root_}};
  const auto tree = library.resolve("a/A");
  ASSERT_TRUE(tree) << to_string(tree.error());
  EXPECT_EQ(tree->root().file, (root_ / "a/msg/A.idl").string());
  EXPECT_TRUE(library.resolve("a/B"));
  const auto service = library.resolve_service("a/S");
  ASSERT_TRUE(service) << to_string(service.error());
  EXPECT_EQ(service->request.messages.size(), 2U);
  // A char is one here; in a .msg file it is a uint8.
  EXPECT_THAT(
      hashed_description(library, "a/A").value_or(""),
      testing::AllOf(testing::HasSubstr(R"("type_id": 13,)"), testing::HasSubstr(R"("type_id": 157,)")));
  EXPECT_THAT(
      hashed_description(library, "a/B").value_or(""),
      testing::AllOf(testing::HasSubstr(R"("type_id": 3,)"), testing::HasSubstr(R"("type_id": 147,)")));
}

}  // namespace
}  // namespace trestle::messages::idl_parser_test
