// YAML and JSON as such, before any type is known.
#include "test/bridge/messages/values/support.hpp"

namespace trestle::messages::text_value_test {
namespace {

using namespace trestle::test;

/// "kind@line:column text" with the elements in brackets.
std::string shown(const TextValue& value) {
  const char* const kinds[] = {"nothing", "literal", "plain", "quoted", "binary", "list", "mapping"};
  std::string result = fmt::format("{}@{}:{}", kinds[static_cast<std::size_t>(value.kind)], value.place.line,
                                   value.place.column);
  if (!value.key.empty()) {
    result = fmt::format("{}@{}:{}={}", value.key, value.key_place.line, value.key_place.column, result);
  }
  if (!value.text.empty()) {
    result += " " + value.text;
  }
  if (value.kind == TextValue::Kind::list || value.kind == TextValue::Kind::mapping) {
    result += "(";
    for (const TextValue& element : value.elements) {
      result += (&element == value.elements.data() ? "" : ", ") + shown(element);
    }
    result += ")";
  }
  return result;
}

std::string yaml_shown(std::string_view text) {
  const auto value = parse_yaml_text(text);
  return value ? shown(*value) : to_string(value.error());
}
std::string json_shown(std::string_view text) {
  const auto value = parse_json_text(text);
  return value ? shown(*value) : to_string(value.error());
}

TEST(JsonText, HasThePlaceOfEveryToken) {
  EXPECT_EQ(json_shown(R"( {"a" : 1, "b":[true,null ,-1.5e3],
 "c":{"d":"x,\"]"} , "e":[ ]})"),
            "mapping@1:2(a@1:3=literal@1:9 1, b@1:12=list@1:16(literal@1:17 true, nothing@1:22 null, "
            "literal@1:28 -1.5e3), c@2:2=mapping@2:6(d@2:7=quoted@2:11 x,\"]), e@2:22=list@2:26())");
  EXPECT_EQ(json_shown("12"), "literal@1:1 12");
  EXPECT_EQ(json_shown("[1]"), "list@1:1(literal@1:2 1)");
  EXPECT_EQ(json_shown("[[1],[2],3 ]"),
            "list@1:1(list@1:2(literal@1:3 1), list@1:6(literal@1:7 2), literal@1:10 3)");
  EXPECT_EQ(json_shown("\xef\xbb\xbf[1]"), "list@1:1(literal@1:2 1)");
  EXPECT_EQ(json_shown("[0.1000000000000000055511151231257827021181583404541015625]"),
            "list@1:1(literal@1:2 0.1000000000000000055511151231257827021181583404541015625)");
}

TEST(JsonText, SaysWhereItIsNotJson) {
  EXPECT_THAT(json_shown("{\"a\":\n  tru}"), testing::StartsWith("2:6: not valid JSON: syntax error"));
  EXPECT_THAT(json_shown("{\"a\":1,}"), testing::StartsWith("1:8: not valid JSON: syntax error"));
  EXPECT_THAT(json_shown("[1"), testing::StartsWith("1:3: not valid JSON: syntax error"));
  EXPECT_THAT(json_shown(""), testing::StartsWith("1:1: not valid JSON: "));
  EXPECT_THAT(json_shown("1 2"), testing::StartsWith("1:3: not valid JSON: syntax error"));
  EXPECT_THAT(json_shown("[NaN]"), testing::StartsWith("1:2: not valid JSON: syntax error"));
  EXPECT_THAT(json_shown("'a'"), testing::StartsWith("1:1: not valid JSON: syntax error"));
  EXPECT_THAT(json_shown("[01]"), testing::StartsWith("1:3: not valid JSON: syntax error"));
  EXPECT_THAT(json_shown(R"(["\ud83d"])"), testing::HasSubstr("not valid JSON: syntax error"));
  EXPECT_THAT(json_shown("[1e999]"), testing::HasSubstr("1e999"));
}

TEST(YamlText, SaysWhereABracketIsMissing) {
  EXPECT_EQ(yaml_shown("{gear: 2"), "1:9: not valid YAML: '{' of 1:1 is not closed; expected '}'");
  EXPECT_EQ(yaml_shown("\xef\xbb\xbf{gear: 2 \n\n"),
            "1:9: not valid YAML: '{' of 1:1 is not closed; expected '}'");
  EXPECT_EQ(yaml_shown("{a: 1, b: [2, 3"), "1:16: not valid YAML: '[' of 1:11 is not closed; expected ']'");
  EXPECT_EQ(yaml_shown("{a: 1, b: {c: [2]}"), "1:19: not valid YAML: '{' of 1:1 is not closed; expected '}'");
  EXPECT_EQ(yaml_shown("a:\n  b: [1,\n      2\n"),
            "3:8: not valid YAML: '[' of 2:6 is not closed; expected ']'");
  EXPECT_EQ(yaml_shown("[a: 1"), "1:6: not valid YAML: '[' of 1:1 is not closed; expected ']'");
  EXPECT_EQ(yaml_shown("[{a: 1]"), "1:7: not valid YAML: illegal flow end");
}

TEST(YamlText, HasThePlaceOfEveryToken) {
  EXPECT_EQ(yaml_shown("a: 1\nb:\n- x\n- 'y z'\nc: {d: ~, e: [true, \"f\"]}\ng:\n  h: !!binary AAEC\n"),
            "mapping@1:1(a@1:1=plain@1:4 1, b@2:1=list@3:1(plain@3:3 x, quoted@4:3 y z), "
            "c@5:1=mapping@5:4(d@5:5=nothing@5:8, e@5:11=list@5:14(plain@5:15 true, quoted@5:21 f)), "
            "g@6:1=mapping@7:3(h@7:3=binary@7:6 AAEC))");
}

TEST(YamlText, IsOneDocument) {
  EXPECT_EQ(yaml_shown(""), "mapping@0:0()");
  EXPECT_EQ(yaml_shown("# nothing\n"), "mapping@0:0()");
  EXPECT_EQ(yaml_shown("---\na: 1\n---\n"), "mapping@2:1(a@2:1=plain@2:4 1)");
  EXPECT_EQ(yaml_shown("a: 1\n---\nb: 2\n"), "2:1: expected the end of the message");
}

TEST(YamlText, RefusesWhatCouldGrow) {
  EXPECT_EQ(yaml_shown("a: &x [1]\nb: *x"), "1:4: not valid YAML: anchors and aliases cannot be used here");
  EXPECT_EQ(yaml_shown("a: !mine 1"), "1:4: not valid YAML: unknown tag '!mine'");
  EXPECT_EQ(yaml_shown("[1]: 2"), "1:1: not valid YAML: expected the name of a field");
  EXPECT_THAT(yaml_shown("a: [1\nb: 2"), testing::HasSubstr("not valid YAML"));
  EXPECT_THAT(yaml_shown("a: 1]"), testing::StartsWith("mapping"));  // a string to YAML, and no number to us
}

TEST(Text, IsRefusedWhenNestedTooDeep) {
  const std::string deep = std::string(80, '[') + std::string(80, ']');
  EXPECT_THAT(json_shown(deep), testing::StartsWith("list"));
  EXPECT_THAT(yaml_shown(deep), testing::StartsWith("list"));
  EXPECT_EQ(json_shown("[" + deep + "]"), "1:81: lists and objects are nested too deep");
  EXPECT_EQ(yaml_shown("[" + deep + "]"), "1:81: not valid YAML: lists and mappings are nested too deep");
  EXPECT_EQ(json_shown(std::string(1'000'000, '[')), "1:81: lists and objects are nested too deep");
  EXPECT_THAT(yaml_shown(std::string(100'000, '[')), testing::HasSubstr("not valid YAML"));
}

TEST(Text, IsRefusedWhenItIsNoText) {
  for (const auto shown : {yaml_shown, json_shown}) {
    EXPECT_EQ(shown("{\n\"\xff\": 1}"), "2:2: the text is not valid UTF-8");
    EXPECT_EQ(shown(std::string_view{"[1\0]", 4}), "1:3: a zero byte in the text");
    EXPECT_EQ(shown(std::string(max_text_bytes + 1, ' ')), "the text is longer than 8388608 bytes");
  }
}

}  // namespace
}  // namespace trestle::messages::text_value_test
