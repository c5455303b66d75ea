#include "someip/net/parameters.hpp"

#include <gmock/gmock.h>

#include "test/bytes.hpp"
#include "test/covers.hpp"

namespace trestle::someip::parameters_test {
namespace {

using test::covers;
using test::hex;
using test::to_hex;
using ::testing::ElementsAre;
using ::testing::Pair;

enum class Colour : std::uint8_t { red = 7 };

struct Point {
  float x = 0;
  std::int16_t y = 0;
};
struct Path {
  std::string name;
  std::vector<Point> points;
  std::array<std::uint16_t, 2> ends{};
  Colour colour{};
};

TEST(Parameters, AreLaidOutOneAfterAnother) {
  covers({"feat_req_someip_169", "feat_req_someip_230"});
  EXPECT_EQ(to_hex(pack()), "");
  EXPECT_EQ(to_hex(pack(true, std::uint8_t{1}, std::int8_t{-2}, std::uint16_t{3}, std::int16_t{-4})),
            "01"
            "01"
            "fe"
            "0003"
            "fffc");
  EXPECT_EQ(to_hex(pack(std::uint32_t{5}, -6, std::uint64_t{7}, std::int64_t{-8})),
            "00000005"
            "fffffffa"
            "0000000000000007"
            "fffffffffffffff8");
  EXPECT_EQ(to_hex(pack(1.0F, -2.0, Colour::red)),
            "3f800000"
            "c000000000000000"
            "07");
}

TEST(Parameters, MayBeEnumeratorsThatNobodyDefined) {
  covers({"feat_req_someip_799"});
  constexpr Colour unknown{0xfe};
  EXPECT_EQ(to_hex(pack(unknown, std::vector{Colour::red, unknown})), "fe0000000207fe");
  const auto back = unpack<Colour, std::vector<Colour>>(hex("fe 00000002 07fe"));
  ASSERT_TRUE(back);
  EXPECT_EQ(std::get<0>(*back), unknown);
  EXPECT_THAT(std::get<1>(*back), ElementsAre(Colour::red, unknown));
}

TEST(Parameters, HaveTextAndArraysWithLengths) {
  // BOM and terminator count.
  EXPECT_EQ(to_hex(pack("hi")), "00000006efbbbf686900");
  EXPECT_EQ(to_hex(pack(std::vector<std::uint16_t>{1, 2})), "0000000400010002");
  EXPECT_EQ(to_hex(pack(std::vector<bool>{true, false})), "000000020100");
  EXPECT_EQ(to_hex(pack(hex("0a0b0c"))), "000000030a0b0c");
  EXPECT_EQ(to_hex(pack(std::array<std::uint8_t, 3>{1, 2, 3})), "010203");
  EXPECT_EQ(to_hex(pack(std::map<std::uint8_t, std::uint16_t>{{1, 2}, {3, 4}})), "00000006010002030004");
}

TEST(Parameters, AreStructsOfPlainMembers) {
  const Path path{.name = "a", .points = {{1.0F, -1}}, .ends = {1, 2}, .colour = Colour::red};
  const std::string bytes =
      "00000005efbbbf6100"    // name
      "000000063f800000ffff"  // points
      "00010002"
      "07";
  EXPECT_EQ(to_hex(pack(path)), bytes);
  const auto back = unpack<Path>(hex(bytes));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->name, "a");
  ASSERT_EQ(back->points.size(), 1U);
  EXPECT_EQ(back->points[0].x, 1.0F);
  EXPECT_EQ(back->points[0].y, -1);
  EXPECT_THAT(back->ends, ElementsAre(1, 2));
  EXPECT_EQ(back->colour, Colour::red);
}

TEST(Parameters, FollowTheRulesOfTheService) {
  const PayloadRules rules{.byte_order = std::endian::little,
                           .array_length = FieldWidth::bits8,
                           .struct_length = FieldWidth::bits16,
                           .string_encoding = StringEncoding::utf16le};
  const auto payload = pack(rules, std::string{"\xc3\xa4"}, std::vector<std::uint16_t>{1},
                            std::pair<bool, std::uint8_t>{true, 2});
  EXPECT_EQ(to_hex(payload),
            "00000006fffee4000000"  // lengths are big endian always
            "020100"
            "00020102");
  const auto back =
      unpack<std::string, std::vector<std::uint16_t>, std::pair<bool, std::uint8_t>>(payload, rules);
  ASSERT_TRUE(back);
  const auto& [text, numbers, both] = *back;
  EXPECT_EQ(text, "\xc3\xa4");
  EXPECT_THAT(numbers, ElementsAre(1));
  EXPECT_THAT(both, Pair(true, 2));
}

TEST(Parameters, ThatAreOptionalAreArraysOfNoneOrOne) {
  covers({"feat_req_someip_252"});
  EXPECT_EQ(to_hex(pack(std::vector<std::uint16_t>{}, true)), "0000000001");
  EXPECT_EQ(to_hex(pack(std::vector<std::uint16_t>{7}, true)), "00000002000701");
}

struct Limits {
  std::uint16_t low = 0;
  BigEndian<std::uint16_t> high;
};
struct Mixed {
  std::uint32_t first = 0;
  LittleEndian<std::uint32_t> second;
  LittleEndian<std::vector<std::uint16_t>> numbers;
  LittleEndian<std::array<float, 2>> pair;
  LittleEndian<Limits> limits;
  LittleEndian<std::variant<std::uint8_t, std::int16_t>> choice;
  std::vector<LittleEndian<std::int32_t>> each;
  std::uint16_t last = 0;
};

TEST(Parameters, HaveByteOrdersOfTheirOwn) {
  covers({"feat_req_someip_224"});
  const Mixed mixed{.first = 0x01020304,
                    .second = {0x05060708},
                    .numbers = {{0x0102, 0x0304}},
                    .pair = {{1.0F, -2.0F}},
                    .limits = {{.low = 0x0506, .high = {0x0708}}},
                    .choice = {std::int16_t{-2}},
                    .each = {{-3}},
                    .last = 0x090a};
  const std::string_view bytes =
      "01020304 08070605  00000004 0201 0403  0000803f 000000c0  0605 0708"
      "00000002 00000002 feff  00000004 fdffffff  090a";
  EXPECT_EQ(to_hex(pack(mixed)), to_hex(hex(bytes)));
  const auto back = unpack<Mixed>(hex(bytes));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->first, mixed.first);
  EXPECT_EQ(back->second, mixed.second);
  EXPECT_EQ(back->numbers, mixed.numbers);
  EXPECT_EQ(back->pair, mixed.pair);
  EXPECT_EQ(back->limits.value.low, 0x0506);
  EXPECT_EQ(back->limits.value.high, (BigEndian<std::uint16_t>{0x0708}));
  EXPECT_EQ(back->choice, mixed.choice);
  EXPECT_EQ(back->each, mixed.each);
  EXPECT_EQ(back->last, mixed.last);
}

TEST(Parameters, HaveByteOrdersThatTheRulesDoNotChange) {
  covers({"feat_req_someip_224"});
  // No struct of its own, so without its length field.
  const PayloadRules little{.byte_order = std::endian::little, .struct_length = FieldWidth::bits8};
  const auto payload =
      pack(little, std::uint16_t{0x0102}, BigEndian<std::uint16_t>{0x0304}, LittleEndian<std::int16_t>{-2});
  EXPECT_EQ(to_hex(payload), to_hex(hex("0201 0304 feff")));
  EXPECT_EQ(
      (unpack<std::uint16_t, BigEndian<std::uint16_t>, LittleEndian<std::int16_t>>(payload, little)),
      (std::tuple{std::uint16_t{0x0102}, BigEndian<std::uint16_t>{0x0304}, LittleEndian<std::int16_t>{-2}}));
  // A union without length field is padded to the longest of its types, also to one of these.
  const PayloadRules padded{.union_length = FieldWidth::none, .union_type = FieldWidth::bits8};
  using Choice = std::variant<std::uint8_t, LittleEndian<std::uint32_t>>;
  EXPECT_EQ(to_hex(pack(padded, Choice{std::uint8_t{5}}, Choice{LittleEndian<std::uint32_t>{6}})),
            to_hex(hex("01 05000000  02 06000000")));
}

struct Plate {
  FixedString<10> number;
  std::uint8_t country = 0;
};

TEST(Parameters, HaveTextOfFixedSize) {
  covers({"feat_req_someip_233", "feat_req_someip_662", "feat_req_someip_687"});
  // BOM, "B-1", terminator, and zeros up to 10 bytes; no length field.
  EXPECT_EQ(to_hex(pack(Plate{.number = {"B-1"}, .country = 0x31})), "efbbbf422d310000000031");
  const auto plate = unpack<Plate>(hex("efbbbf 422d31 00000000 31"));
  ASSERT_TRUE(plate);
  EXPECT_EQ(plate->number, (FixedString<10>{"B-1"}));
  EXPECT_EQ(plate->country, 0x31);
  EXPECT_EQ(to_hex(pack(FixedString<10>{"B-1234"})), "efbbbf422d3132333400");  // exactly
  EXPECT_THROW(static_cast<void>(pack(FixedString<10>{"B-12345"})), std::invalid_argument);
  EXPECT_EQ(unpack<FixedString<10>>(hex("efbbbf 422d31 000000")).error(), WireError::truncated);
  EXPECT_EQ(unpack<FixedString<6>>(hex("efbbbf 422d31")).error(), WireError::bad_string_encoding);
  const PayloadRules utf16{.string_encoding = StringEncoding::utf16be};
  EXPECT_EQ(to_hex(pack(utf16, FixedString<8>{"\xc3\xa4"})), "feff00e400000000");
  EXPECT_EQ(unpack<FixedString<8>>(hex("feff 00e4 0000 0000"), utf16), (FixedString<8>{"\xc3\xa4"}));
}

TEST(Parameters, HaveTextInUtf16BesideOtherText) {
  covers({"feat_req_someip_234", "feat_req_someip_235", "feat_req_someip_238", "feat_req_someip_639",
          "feat_req_someip_640", "feat_req_someip_642"});
  // BOM, U+00E4, U+1F600 as a surrogate pair, two zeros.
  const std::u16string text{u"\u00e4\U0001F600"};
  EXPECT_EQ(to_hex(pack(text)), "0000000afeff00e4d83dde000000");
  EXPECT_EQ(to_hex(pack(u"\u00e4", "a")), "00000006feff00e4000000000005efbbbf6100");
  EXPECT_EQ(unpack<std::u16string>(hex("0000000a feff 00e4 d83d de00 0000")), text);
  const auto both = unpack<std::u16string, std::string>(hex("00000006 feff 00e4 0000 00000005 efbbbf 61 00"));
  ASSERT_TRUE(both);
  EXPECT_EQ(*both, (std::tuple{std::u16string{u"\u00e4"}, std::string{"a"}}));
  // Little endian where the service's texts are; the length field is none of them.
  const PayloadRules little{.string_encoding = StringEncoding::utf16le};
  EXPECT_EQ(to_hex(pack(little, text)), "0000000afffee4003dd800de0000");
  EXPECT_EQ(unpack<std::u16string>(hex("0000000a fffe e400 3dd8 00de 0000"), little), text);
  // An odd last byte is ignored.  [feat_req_someip_641]
  EXPECT_EQ(unpack<std::u16string>(hex("00000007 feff 00e4 0000 00")), u"\u00e4");
}

TEST(Parameters, RefuseTextThatIsNotUtf16) {
  covers({"feat_req_someip_666"});
  EXPECT_THROW(static_cast<void>(pack(std::u16string{char16_t{0xd83d}})), std::invalid_argument);
  EXPECT_EQ(unpack<std::u16string>(hex("00000006 feff d83d 0000")).error(), WireError::bad_string_encoding);
  EXPECT_EQ(unpack<std::u16string>(hex("00000006 fffe e400 0000")).error(), WireError::bad_string_encoding);
  EXPECT_EQ(unpack<std::u16string>(hex("00000005 efbbbf 61 00")).error(), WireError::bad_string_encoding);
}

TEST(Parameters, ComeBack) {
  covers({"feat_req_someip_168"});
  const auto one = unpack<std::uint16_t>(hex("1234 ffff"));  // what is behind belongs to a newer interface
  ASSERT_TRUE(one);
  EXPECT_EQ(*one, 0x1234);
  const auto map = unpack<std::map<std::uint8_t, std::uint16_t>>(hex("00000006 010002 030004"));
  ASSERT_TRUE(map);
  EXPECT_THAT(*map, ElementsAre(Pair(1, 2), Pair(3, 4)));
  const auto bytes = unpack<std::vector<std::uint8_t>>(hex("00000002 0a0b"));
  ASSERT_TRUE(bytes);
  EXPECT_THAT(*bytes, ElementsAre(0x0a, 0x0b));
  const auto flags = unpack<std::vector<bool>>(hex("00000002 0100"));
  ASSERT_TRUE(flags);
  EXPECT_THAT(*flags, ElementsAre(true, false));
  EXPECT_TRUE(unpack<>({}));
  // More than the first guess of what room they need.
  const std::vector<std::string> many(1000, std::string(100, 'x'));
  const auto long_again = unpack<std::vector<std::string>>(pack(many));
  ASSERT_TRUE(long_again);
  EXPECT_EQ(*long_again, many);
}

TEST(Parameters, ThatAreNotThereAreAnError) {
  EXPECT_EQ(unpack<std::uint16_t>(hex("12")).error(), WireError::truncated);
  EXPECT_EQ(unpack<std::string>(hex("00000005 61")).error(), WireError::truncated);
  EXPECT_EQ((unpack<std::uint8_t, std::uint8_t>(hex("01")).error()), WireError::truncated);
  EXPECT_EQ(unpack<std::vector<std::uint16_t>>(hex("00000003 000102")).error(), WireError::truncated);
  EXPECT_EQ(unpack<std::vector<std::tuple<>>>(hex("00000003 000102")).error(), WireError::bad_length);
}

TEST(Parameters, ThatCannotBeSentAreRefused) {
  EXPECT_THROW(static_cast<void>(pack("\xff")), std::invalid_argument);
  const PayloadRules rules{.array_length = FieldWidth::bits8};
  EXPECT_THROW(static_cast<void>(pack(rules, std::vector<std::uint8_t>(256))), std::invalid_argument);
}

TEST(TypedFunction, TakesAndReturnsValues) {
  const auto multiply = typed([](std::int32_t a, std::int32_t b) { return a * b; });
  EXPECT_EQ(to_hex(*multiply(hex("00000003 fffffffe"))), "fffffffa");
  const auto divide =
      typed([](std::uint8_t a, std::uint8_t b) -> Result<std::tuple<std::uint8_t, bool>, ReturnCode> {
        if (b == 0) {
          return tl::unexpected{ReturnCode{0x21}};
        }
        return std::tuple{static_cast<std::uint8_t>(a / b), a % b == 0};
      });
  EXPECT_EQ(to_hex(*divide(hex("0702"))), "0300");
  EXPECT_EQ(divide(hex("0700")).error(), ReturnCode{0x21});
  std::string heard;
  const auto hear = typed([&](const std::string& text) { heard = text; });
  EXPECT_EQ(to_hex(*hear(hex("00000006 efbbbf 6869 00"))), "");
  EXPECT_EQ(heard, "hi");
  const auto forbid =
      typed([]() -> Result<void, ReturnCode> { return tl::unexpected{ReturnCode::not_ready}; });
  EXPECT_EQ(forbid({}).error(), ReturnCode::not_ready);
  const auto allow = typed([]() -> Result<void, ReturnCode> { return {}; });
  EXPECT_EQ(to_hex(*allow({})), "");
}

TEST(TypedFunction, IsNotCalledWithoutItsArguments) {
  int calls = 0;
  const auto count = typed([&](std::uint32_t) { ++calls; });
  EXPECT_EQ(count(hex("000001")).error(), ReturnCode::malformed_message);
  EXPECT_EQ(calls, 0);
}

}  // namespace
}  // namespace trestle::someip::parameters_test
