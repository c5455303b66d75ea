// Structs with data_ids: members with tags, some of them optional.
#include <gmock/gmock.h>

#include "someip/net/parameters.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"

namespace trestle::someip::parameters_tagged_test {
namespace {

using test::covers;
using test::hex;
using test::to_hex;
using ::testing::ElementsAre;

struct Reading {
  std::uint16_t sensor = 0;
  std::optional<float> distance{};
  std::optional<std::string> note{};
  static constexpr std::array data_ids{1, 2, 0xabc};
  friend bool operator==(const Reading&, const Reading&) = default;
};

TEST(TaggedParameters, HaveATagBeforeEachMember) {
  // Wire types 1 (16 bits), 2 (32 bits) and 4 (behind a length field of 32 bits).
  const Reading all{.sensor = 7, .distance = 1.5F, .note = "a"};
  const std::string bytes =
      "10010007"
      "20023fc00000"
      "4abc00000005efbbbf6100";
  EXPECT_EQ(to_hex(pack(all)), bytes);
  EXPECT_EQ(unpack<Reading>(hex(bytes)), all);
}

TEST(TaggedParameters, LeaveOutWhatIsNotThere) {
  EXPECT_EQ(to_hex(pack(Reading{.sensor = 7})), "10010007");
  EXPECT_EQ(to_hex(pack(Reading{.sensor = 7, .note = ""})), "100100074abc00000004efbbbf00");
  EXPECT_EQ(unpack<Reading>(hex("1001 0007")), Reading{.sensor = 7});
}

TEST(TaggedParameters, ComeInAnyOrder) {
  EXPECT_EQ(unpack<Reading>(hex("2002 3fc00000 1001 0007")), (Reading{.sensor = 7, .distance = 1.5F}));
}

TEST(TaggedParameters, SkipMembersThatAreNotKnown) {
  // Ids 3 to 9 with wire types 0 to 7, the last with the reserved bit.
  const auto reading =
      unpack<Reading>(hex("0003 ff"
                          "1004 ffff"
                          "2005 ffffffff"
                          "1001 0007"
                          "3006 ffffffffffffffff"
                          "4007 00000001 ff"
                          "5008 01 ff"
                          "6009 0001 ff"
                          "f00a 00000001 ff"));
  EXPECT_EQ(reading, Reading{.sensor = 7});
}

TEST(TaggedParameters, ThatAreNotOptionalHaveToBeThere) {
  EXPECT_EQ(unpack<Reading>({}).error(), WireError::truncated);
  EXPECT_EQ(unpack<Reading>(hex("2002 3fc00000")).error(), WireError::truncated);
  int calls = 0;
  const auto count = typed([&](const Reading&) { ++calls; });
  EXPECT_EQ(count(hex("2002 3fc00000")).error(), ReturnCode::malformed_message);
  EXPECT_EQ(calls, 0);
}

TEST(TaggedParameters, ThatAreMalformedAreAnError) {
  EXPECT_EQ(unpack<Reading>(hex("10")).error(), WireError::truncated);
  EXPECT_EQ(unpack<Reading>(hex("1001 00")).error(), WireError::truncated);
  EXPECT_EQ(unpack<Reading>(hex("2001 00000007")).error(), WireError::bad_tag)
      << "32 bits are not the member's";
  EXPECT_EQ(unpack<Reading>(hex("4001 00000002 0007")).error(), WireError::bad_tag);
  EXPECT_EQ(unpack<Reading>(hex("1001 0007 1001 0008")).error(), WireError::bad_tag) << "twice";
  EXPECT_EQ(unpack<Reading>(hex("1001 0007 4abc 00000006 efbbbf 61 00")).error(), WireError::truncated);
  EXPECT_EQ(unpack<Reading>(hex("1001 0007 5003 02 ff")).error(), WireError::truncated)
      << "not known, too long";
  // The member ends after its struct does.
  EXPECT_EQ(unpack<Reading>(hex("06 1001 0007 2002 3fc00000"), {.struct_length = FieldWidth::bits8}).error(),
            WireError::bad_length);
}

struct Route {
  std::vector<std::uint16_t> points;
  std::array<std::uint8_t, 2> ends{};
  std::pair<bool, std::uint8_t> kind;
  std::variant<std::monostate, std::uint16_t> limit;
  FixedString<6> name;
  std::u16string title;
  std::optional<Reading> last;
  static constexpr int data_ids[]{0, 1, 2, 3, 4, 5, 6};
};

TEST(TaggedParameters, AreOfAnyType) {
  const std::string bytes =
      "40000000000400010002"  // points
      "4001000000020304"      // a fixed array and structs get a length field with the tag
      "4002000000020105"
      "400300000006000000010032"  // that of a union counts its type, too
      "400400000006efbbbf610000"
      "400500000006feff00620000"
      "40060000000410010007";
  const Route route{.points = {1, 2},
                    .ends = {3, 4},
                    .kind = {true, 5},
                    .limit = std::uint16_t{50},
                    .name = {"a"},
                    .title = u"b",
                    .last = Reading{.sensor = 7}};
  EXPECT_EQ(to_hex(pack(route)), bytes);
  const auto back = unpack<Route>(hex(bytes));
  ASSERT_TRUE(back);
  EXPECT_THAT(back->points, ElementsAre(1, 2));
  EXPECT_THAT(back->ends, ElementsAre(3, 4));
  EXPECT_EQ(back->kind, (std::pair<bool, std::uint8_t>{true, 5}));
  EXPECT_EQ(back->limit, route.limit);
  EXPECT_EQ(back->name, route.name);
  EXPECT_EQ(back->title, u"b");
  EXPECT_EQ(back->last, route.last);
  // Lengths of a member and of what is in it are bounds of their own.
  EXPECT_EQ(unpack<Route>(hex("4006 00000004 1001 0007")).error(), WireError::truncated);
  EXPECT_EQ(unpack<Route>(hex("4006 00000003 1001 0007")).error(), WireError::bad_length);
  EXPECT_EQ(unpack<Route>(hex("4006 00000006 2002 3fc00000")).error(), WireError::truncated);
}

TEST(TaggedParameters, FollowTheRulesOfTheService) {
  const PayloadRules rules{.byte_order = std::endian::little,
                           .length_fields_always_big = true,
                           .struct_length = FieldWidth::bits16,
                           .smallest_tagged_length = true};
  const Reading reading{.sensor = 7, .note = "a"};
  // The note's length has 8 bits, which wire type 5 says.
  EXPECT_EQ(to_hex(pack(rules, reading, true)),
            "000c"
            "10010700"
            "5abc05efbbbf6100"
            "01");
  const auto back = unpack<Reading, bool>(hex("000c 1001 0700 5abc 05 efbbbf6100 01"), rules);
  ASSERT_TRUE(back);
  EXPECT_EQ(*back, (std::tuple{reading, true}));
  EXPECT_THROW(static_cast<void>(pack(PayloadRules{.alignment = 4}, reading)), std::invalid_argument);
}

struct Mixed {
  LittleEndian<std::uint16_t> first;
  std::optional<LittleEndian<std::vector<std::uint16_t>>> second{};
  std::uint16_t third = 0;
  static constexpr std::array data_ids{1, 2, 3};
  friend bool operator==(const Mixed&, const Mixed&) = default;
};

TEST(TaggedParameters, HaveByteOrdersOfTheirOwn) {
  covers({"feat_req_someip_224"});
  const Mixed mixed{.first = {0x0102}, .second = {{{0x0304}}}, .third = 0x0506};
  EXPECT_EQ(to_hex(pack(mixed)), to_hex(hex("1001 0201  4002 00000002 0403  1003 0506")));
  EXPECT_EQ(unpack<Mixed>(hex("1003 0506  4002 00000002 0403  1001 0201")), mixed);
  EXPECT_EQ(unpack<Mixed>(hex("1003 0506  1001 0201")), (Mixed{.first = {0x0102}, .third = 0x0506}));
}

TEST(TaggedParameters, AreRefusedWhereNobodyCouldTellTheirEnd) {
  const Reading reading{.sensor = 7};
  EXPECT_THROW(static_cast<void>(pack(reading, true)), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(pack(std::pair{reading, true})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(pack(std::vector{reading})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(pack(std::array{reading, reading})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(pack(std::variant<std::pair<Reading, bool>>{std::pair{reading, true}})),
               std::invalid_argument);
  // The end of the message, of a union and of a tagged member do.
  EXPECT_EQ(to_hex(pack(true, reading)), "0110010007");
  EXPECT_EQ(to_hex(pack(std::variant<Reading>{reading}, true)), "00000004000000011001000701");
  const auto back = unpack<std::variant<Reading>, bool>(hex("00000004 00000001 1001 0007 01"));
  ASSERT_TRUE(back);
  EXPECT_EQ(std::get<Reading>(std::get<0>(*back)), reading);
  EXPECT_EQ(to_hex(pack(PayloadRules{.struct_length = FieldWidth::bits8}, std::vector{reading, reading})),
            "0000000a"
            "0410010007"
            "0410010007");
}

}  // namespace
}  // namespace trestle::someip::parameters_tagged_test
