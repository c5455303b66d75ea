// std::variant as a union.
#include <gmock/gmock.h>

#include "someip/net/parameters.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"

namespace trestle::someip::parameters_union_test {
namespace {

using test::covers;
using test::hex;
using test::to_hex;

using Number = std::variant<std::uint8_t, std::uint16_t>;
using MaybeNumber = std::variant<std::monostate, std::uint8_t, std::uint16_t>;

TEST(UnionParameters, HaveLengthAndTypeBeforeTheElement) {
  covers({"feat_req_someip_263", "feat_req_someip_264", "feat_req_someip_272", "feat_req_someip_273",
          "feat_req_someip_565", "feat_req_someip_566"});
  EXPECT_EQ(to_hex(pack(Number{std::uint8_t{0x12}})), "000000010000000112");
  EXPECT_EQ(to_hex(pack(Number{std::uint16_t{0x1234}}, true)),
            "00000002000000021234"
            "01");
}

TEST(UnionParameters, SkipThePaddingOfTheSender) {
  covers({"feat_req_someip_274"});
  // The figures of feat_req_someip_278 and 289: both padded to 32 bits.
  EXPECT_EQ(unpack<Number>(hex("00000004 00000001 12 000000")), Number{std::uint8_t{0x12}});
  const auto number = unpack<Number, bool>(hex("00000004 00000002 1234 0000 01"));
  ASSERT_TRUE(number);
  EXPECT_EQ(*number, (std::tuple{Number{std::uint16_t{0x1234}}, true}));
}

TEST(UnionParameters, MayBeEmptyWhenTheirTypeSaysSo) {
  covers({"feat_req_someip_273"});
  EXPECT_EQ(to_hex(pack(MaybeNumber{})), "0000000000000000");
  EXPECT_EQ(to_hex(pack(MaybeNumber{std::uint8_t{0x12}})), "000000010000000112") << "still type 1";
  EXPECT_EQ(unpack<MaybeNumber>(hex("00000000 00000000")), MaybeNumber{});
  EXPECT_EQ(unpack<MaybeNumber>(hex("00000002 00000002 1234")), MaybeNumber{std::uint16_t{0x1234}});
  EXPECT_EQ(unpack<Number>(hex("00000000 00000000")).error(), WireError::bad_union_type);
  // An empty union has no bytes, also where structs have a length field.
  EXPECT_EQ(to_hex(pack(PayloadRules{.struct_length = FieldWidth::bits8}, MaybeNumber{})),
            "0000000000000000");
}

TEST(UnionParameters, TellAlternativesOfOneTypeApart) {
  using Level = std::variant<std::uint8_t, std::uint8_t>;
  const Level second{std::in_place_index<1>, std::uint8_t{5}};
  EXPECT_EQ(to_hex(pack(second)), "000000010000000205");
  EXPECT_EQ(unpack<Level>(hex("00000001 00000002 05")), second);
}

TEST(UnionParameters, HoldWhateverIsAParameter) {
  struct Circle {
    std::uint16_t radius = 0;
  };
  struct Drawing {
    std::vector<std::variant<std::string, Circle>> parts;
    std::uint8_t layer = 0;
  };
  const std::string bytes =
      "0000001b"                            // 27 bytes of parts
      "000000090000000100000005efbbbf6100"  // 9 bytes, type 1: the text "a"
      "00000002000000020007"                // 2 bytes, type 2: 7
      "03";
  EXPECT_EQ(to_hex(pack(Drawing{.parts = {"a", Circle{7}}, .layer = 3})), bytes);
  const auto back = unpack<Drawing>(hex(bytes));
  ASSERT_TRUE(back);
  ASSERT_EQ(back->parts.size(), 2U);
  EXPECT_EQ(std::get<std::string>(back->parts[0]), "a");
  EXPECT_EQ(std::get<Circle>(back->parts[1]).radius, 7);
  EXPECT_EQ(back->layer, 3);
}

TEST(UnionParameters, FollowTheRulesOfTheService) {
  covers({"feat_req_someip_563", "feat_req_someip_564", "feat_req_someip_573"});
  const PayloadRules rules{.union_length = FieldWidth::bits8, .union_type = FieldWidth::bits16};
  EXPECT_EQ(to_hex(pack(rules, Number{std::uint16_t{0x1234}})), "0200021234");
  const PayloadRules type_first{
      .union_length = FieldWidth::bits8, .union_type = FieldWidth::bits16, .union_length_first = false};
  EXPECT_EQ(to_hex(pack(type_first, Number{std::uint16_t{0x1234}})), "0002021234");
  EXPECT_EQ(unpack<Number>(hex("0002 02 1234"), type_first), Number{std::uint16_t{0x1234}});
  const PayloadRules little{.byte_order = std::endian::little, .length_fields_always_big = true};
  EXPECT_EQ(to_hex(pack(little, Number{std::uint16_t{0x1234}})), "00000002000000023412");
}

TEST(UnionParameters, ArePaddedToTheLongestWithoutALengthField) {
  covers({"feat_req_someip_571", "feat_req_someip_572", "feat_req_someip_583"});
  const PayloadRules rules{.union_length = FieldWidth::none, .union_type = FieldWidth::bits8};
  struct Pair {
    std::array<std::uint8_t, 2> first{};
    FixedString<5> second;
  };
  using Choice = std::variant<std::monostate, std::uint8_t, Number, Pair>;
  EXPECT_EQ(to_hex(pack(rules, Choice{std::uint8_t{0x12}}, true)), "011200000000000001");
  EXPECT_EQ(to_hex(pack(rules, Choice{Number{std::uint8_t{0x12}}}, true)),
            "02"
            "011200"
            "00000000"
            "01");
  EXPECT_EQ(to_hex(pack(rules, Choice{Pair{{1, 2}, {"a"}}}, true)),
            "03"
            "0102efbbbf6100"
            "01");
  EXPECT_EQ(to_hex(pack(rules, Choice{}, true)), "000000000000000001");
  const auto back = unpack<Choice, bool>(hex("02 011200 00000000 01"), rules);
  ASSERT_TRUE(back);
  EXPECT_EQ(std::get<Number>(std::get<0>(*back)), Number{std::uint8_t{0x12}});
  EXPECT_TRUE(std::get<bool>(*back));
  EXPECT_EQ((unpack<Choice, bool>(hex("01 12 0000000000"), rules).error()), WireError::truncated);
}

TEST(UnionParameters, ThatAreMalformedAreAnError) {
  EXPECT_EQ(unpack<Number>(hex("00000001 00000003 12")).error(), WireError::bad_union_type);
  EXPECT_EQ(unpack<Number>(hex("00000001 ffffffff 12")).error(), WireError::bad_union_type);
  EXPECT_EQ(unpack<MaybeNumber>(hex("00000001 00000003 12")).error(), WireError::bad_union_type);
  EXPECT_EQ(unpack<Number>(hex("00000001 00000002 1234")).error(), WireError::bad_length)
      << "too short for it";
  EXPECT_EQ(unpack<Number>(hex("00000003 00000002 1234")).error(), WireError::truncated);
  EXPECT_EQ(unpack<Number>(hex("00000002 000000")).error(), WireError::truncated);
  // Longer than the array that holds it.
  EXPECT_EQ(unpack<std::vector<Number>>(hex("0000000a 00000003 00000002 1234 56")).error(),
            WireError::bad_length);
}

TEST(UnionParameters, AreRefusedWhereTheirTypeFieldCannotCount) {
  std::variant<std::monostate, bool> flag{true};
  const PayloadRules rules{.union_length = FieldWidth::bits8};
  EXPECT_THROW(
      static_cast<void>(pack(rules, std::variant<std::vector<std::uint8_t>>{std::vector<std::uint8_t>(252)})),
      std::invalid_argument);
  EXPECT_EQ(to_hex(pack(rules, flag)), "010000000101");
}

TEST(UnionParameters, AreArgumentsAndAnswers) {
  const auto twice = typed([](const Number& number) {
    return std::visit([](auto one) { return Number{static_cast<decltype(one)>(2 * one)}; }, number);
  });
  EXPECT_EQ(to_hex(*twice(hex("00000002 00000002 0102"))), "00000002000000020204");
  EXPECT_EQ(twice(hex("00000002 00000003 0102")).error(), ReturnCode::malformed_message);
}

}  // namespace
}  // namespace trestle::someip::parameters_union_test
