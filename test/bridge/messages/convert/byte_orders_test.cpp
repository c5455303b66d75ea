// Fields with a byte order of their own.
#include <gmock/gmock.h>

#include "test/bridge/messages/convert/type_rules.hpp"
#include "test/covers.hpp"

namespace trestle::messages::byte_orders_test {
namespace {

using namespace trestle::test;
using someip::DataId;
using someip::FieldWidth;
using std::endian;

MessageRules rules_for_test(std::map<std::string, endian, std::less<>> orders, endian rest = endian::big) {
  MessageRules rules;
  rules.payload.byte_order = rest;
  rules.types["test_msgs/msg/Test"].byte_orders = std::move(orders);
  return rules;
}

/// Also from CDR in big endian, for what has the numbers of `cdr` in reverse order.
void expect_both_ways(const ConversionPlan& plan, std::string_view cdr, std::string_view big_cdr,
                      std::string_view payload) {
  test::expect_both_ways(plan, cdr, payload);
  EXPECT_EQ(to_someip(plan, big_cdr), compact(payload));
}

TEST(ByteOrders, AreThoseOfEachNumber) {
  covers({"feat_req_someip_224"});
  const TypeTree tree = tree_of("uint16 a\nuint16 b\nuint8 c\nuint32 d\nfloat64 e\nuint16 f");
  constexpr std::string_view cdr = "00010000 0201 0403 05 000000 09080706 00000000 000000000000f83f 0b0a";
  constexpr std::string_view big_cdr = "00000000 0102 0304 05 000000 06070809 00000000 3ff8000000000000 0a0b";
  expect_both_ways(plan(tree, rules_for_test({{"b", endian::little}, {"e", endian::little}})), cdr, big_cdr,
                   "0102 0403 05 06070809 000000000000f83f 0a0b");
  expect_both_ways(plan(tree, rules_for_test({{"b", endian::big}, {"d", endian::big}, {"f", endian::little}},
                                             endian::little)),
                   cdr, big_cdr, "0201 0304 05 06070809 000000000000f83f 0b0a");
}

TEST(ByteOrders, AreThoseOfAllElements) {
  covers({"feat_req_someip_224"});
  const TypeTree tree = tree_of("uint16[2] a\nuint16[] b\nuint32[<=2] c\nuint16[] d");
  constexpr std::string_view cdr = "00010000 0201 0403 02000000 0605 0807 01000000 0c0b0a09 01000000 0e0d";
  constexpr std::string_view big_cdr =
      "00000000 0102 0304 00000002 0506 0708 00000001 090a0b0c 00000001 0d0e";
  const MessageRules rules =
      rules_for_test({{"a", endian::little}, {"b", endian::little}, {"c", endian::little}});
  // Length fields don't follow.
  expect_both_ways(plan(tree, rules), cdr, big_cdr,
                   "0201 0403 00000004 0605 0807 00000004 0c0b0a09 00000002 0d0e");
  MessageRules as_payload =
      rules_for_test({{"a", endian::big}, {"b", endian::big}, {"c", endian::big}}, endian::little);
  as_payload.payload.length_fields_always_big = false;
  as_payload.payload.fixed_array_length = FieldWidth::bits16;
  expect_both_ways(plan(tree, as_payload), cdr, big_cdr,
                   "0400 0102 0304 04000000 0506 0708 04000000 090a0b0c 02000000 0e0d");
}

TEST(ByteOrders, AreThoseOfLongArrays) {
  // Longer than what is copied number by number, or not copied at all where nothing changes.
  covers({"feat_req_someip_224"});
  constexpr std::size_t numbers = 3000;
  std::string little;
  std::string big;
  for (std::size_t i = 0; i < numbers; ++i) {
    const std::array number{static_cast<std::byte>(i >> 8U), static_cast<std::byte>(i)};
    big += to_hex(number);
    little += to_hex(std::array{number[1], number[0]});
  }
  const auto of = [](const std::string& first, const std::string& second) { return first + second; };
  const std::string cdr = "00010000" + of(little, little) + "b80b0000" + of(little, "b80b0000") + little;
  const std::string payload = of(big, little) + "00001770" + of(big, "00001770") + little;
  const auto both = plan(tree_of("uint16[3000] a\nuint16[3000] b\nuint16[] c\nuint16[] d"),
                         rules_for_test({{"b", endian::little}, {"d", endian::little}}));
  test::expect_both_ways(both, cdr, payload);
}

TEST(ByteOrders, ReachIntoNestedMessagesUnlessTheseSayOtherwise) {
  covers({"feat_req_someip_224"});
  const TypeTree tree = trees({{"Inner", "uint16 x\nuint16 y\nstring s"},
                               {"Test", "Inner one\nInner[] more\nInner[2] two\nInner plain\nuint16 last"}});
  MessageRules rules =
      rules_for_test({{"one", endian::little}, {"more", endian::little}, {"two", endian::little}});
  rules.payload.string_bom = rules.payload.string_terminator = false;
  rules.payload.string_length = FieldWidth::bits16;
  constexpr std::string_view cdr =
      "00010000 0201 0403 02000000 6100 0000"
      "01000000 0201 0403 02000000 6200"
      "0201 0403 0000 02000000 6300 0201 0403 0000 02000000 6400"
      "0201 0403 0000 02000000 6500 0605";
  test::expect_both_ways(plan(tree, rules), cdr,
                         "0201 0403 0001 61"
                         "00000007 0201 0403 0001 62"
                         "0201 0403 0001 63 0201 0403 0001 64"
                         "0102 0304 0001 65 0506");
  rules.types["test_msgs/msg/Inner"].byte_orders = {{"y", endian::big}};
  test::expect_both_ways(plan(tree, rules), cdr,
                         "0201 0304 0001 61"
                         "00000007 0201 0304 0001 62"
                         "0201 0304 0001 63 0201 0304 0001 64"
                         "0102 0304 0001 65 0506");
}

TEST(ByteOrders, KeepRunsOfNestedMessagesApart) {
  // Arrays of messages of like numbers are one run only where all have the same byte order.
  covers({"feat_req_someip_224"});
  const TypeTree tree =
      trees({{"Same", "uint16 x\nuint16 y"},
             {"Mixed", "uint16 x\nuint16 y"},
             {"Test", "uint16 a\nSame[2] same\nMixed[2] mixed\nSame[] sames\nMixed[] others"}});
  MessageRules rules;
  rules.types["test_msgs/msg/Same"].byte_orders = {{"x", endian::little}, {"y", endian::little}};
  rules.types["test_msgs/msg/Mixed"].byte_orders = {{"y", endian::little}};
  const auto both = plan(tree, rules);
  test::expect_both_ways(both,
                         "00010000 0201 0403 0605 0807 0a09 0c0b 0e0d 100f 1211 0000"
                         "01000000 0403 0605 01000000 0c0b 0e0d",
                         "0102 0403 0605 0807 0a09 0b0c 0e0d 0f10 1211"
                         "00000004 0403 0605 00000004 0b0c 0e0d");
  EXPECT_EQ(to_cdr(both, "0102 0403 0605 0807 0a"), "truncated at byte 8 in same[1]");
}

TEST(ByteOrders, AreThoseOfTaggedMembersUnionsAndBitFields) {
  covers({"feat_req_someip_224"});
  const TypeTree tree = trees({{"Flags", "bool[9] bits"},
                               {"Shape", "uint16[<=1] line\nuint32[<=1] circle"},
                               {"Test", "uint16 a\nuint16[<=1] b\nuint16[] c\nFlags flags\nShape shape"}});
  MessageRules rules =
      rules_for_test({{"b", endian::little}, {"c", endian::little}, {"flags", endian::little}});
  rules.types["test_msgs/msg/Flags"].form = TypeRules::Form::bits16;
  rules.types["test_msgs/msg/Shape"].form = TypeRules::Form::choice;
  rules.types["test_msgs/msg/Shape"].byte_orders = {{"circle", endian::little}};
  rules.types["test_msgs/msg/Test"].tags = {
      {"a", DataId{1}}, {"b", DataId{2}}, {"c", DataId{3}}, {"flags", DataId{4}}, {"shape", DataId{5}}};
  rules.payload.tagged_length = FieldWidth::bits8;
  rules.payload.union_type = FieldWidth::bits16;
  const std::string begin = "00010000 0201 0000 01000000 0403 0000 01000000 0605 010000000000000001 00";
  const std::string members = "1001 0102 1002 0403 4003 02 0605 1004 0101";
  test::expect_both_ways(plan(tree, rules), begin + "00000000 01000000 0a090807",
                         members + "4005 06 0002 0a090807");
  test::expect_both_ways(plan(tree, rules), begin + "01000000 0807 0000 00000000",
                         members + "4005 04 0001 0708");
}

TEST(ByteOrders, LeaveDefaultsAlone) {
  covers({"feat_req_someip_224"});
  MessageRules rules = rules_for_test({{"b", endian::little}});
  rules.default_missing = true;
  EXPECT_EQ(to_cdr(plan(tree_of("uint16 a\nuint16 b 258"), rules), "0304"), compact("00010000 0403 0201"));
}

TEST(ByteOrders, AreForNumbersThatAreThere) {
  covers({"feat_req_someip_224"});
  const std::string begin = "test_msgs/msg/Test cannot be carried: test_msgs/msg/Test has ";
  const TypeTree tree = tree_of("uint16 number\nuint8[] bytes\nstring text\nbool truth");
  EXPECT_EQ(compile_error(tree, rules_for_test({{"numbre", endian::little}})),
            begin + "no field numbre, for which there is a byte order");
  for (const std::string field : {"bytes", "text", "truth"}) {
    EXPECT_EQ(compile_error(tree, rules_for_test({{field, endian::little}})),
              begin + "a byte order for " + field + ", which has no numbers of several bytes");
  }
}

}  // namespace
}  // namespace trestle::messages::byte_orders_test
