// What single rules make of CDR bytes. The bytes are written out by hand.
#include <gmock/gmock.h>

#include "test/bridge/messages/map/mappings.hpp"

namespace trestle::messages::map_rules_test {
namespace {

using namespace trestle::test;

constexpr auto to_ros = MapDirection::to_ros;
constexpr auto to_payload = MapDirection::to_payload;

std::string compact(std::string_view digits) {
  return to_hex(hex(digits));
}

FieldMap one_map(const MapTypes& types, std::vector<MapRule> rules, MapDirection direction = to_ros) {
  return map_of(types, {.rules = std::move(rules), .others_default = true}, direction);
}

TEST(FieldMap, AlignsWhatItReadsAndWrites) {
  const MapTypes types{"uint8 a\nuint64 b\nuint16 c", "uint16 c\nuint8 a\nuint64 b"};
  const FieldMap map = one_map(types, {from("c", "c"), from("a", "a"), from("b", "b")});
  EXPECT_EQ(converted(map, "00010000 01 00000000000000 0807060504030201 3412"),
            compact("00010000 3412 01 0000000000 0807060504030201"));
  EXPECT_EQ(converted(map, "00000000 01 00000000000000 0102030405060708 1234"),
            compact("00010000 3412 01 0000000000 0807060504030201"));
}

TEST(FieldMap, ReadsWhatStandsBehindStringsAndArrays) {
  const MapTypes types{"string s\nuint16[] n\ngeometry_msgs/Point32[] p\nstring[] t\nwstring w\nuint8 last",
                       "uint8 last\nuint32 x"};
  const FieldMap map = one_map(types, {from("last", "last")});
  EXPECT_EQ(
      converted(map,
                "00010000 03000000 616200 00 03000000 010002000300 0000 01000000 0000803f 00000000 00000000"
                "02000000 01000000 00 000000 02000000 6100 0000 01000000 41000000 07"),
      compact("00010000 07 000000 00000000"));
}

TEST(FieldMap, CopiesStringsAndArraysAsAWhole) {
  const MapTypes types{"uint8 a\nstring s\nwstring w\nuint16[] n\nstring[<=2] t\ngeometry_msgs/Point32[] p",
                       "string[<=2] t\ngeometry_msgs/Point32[] p\nuint16[] n\nstring s\nwstring w"};
  const FieldMap map =
      one_map(types, {from("t", "t"), from("p", "p"), from("n", "n"), from("s", "s"), from("w", "w")});
  EXPECT_EQ(
      converted(
          map,
          "00000000 01 000000 00000003 616200 00 00000001 00000041 00000002 0102 0304 00000001 00000002 7a00"
          "0000 00000001 3f800000 40000000 40400000"),
      compact("00010000 01000000 02000000 7a00 0000 01000000 0000803f 00000040 00004040 02000000 0201 0403"
              "03000000 616200 00 01000000 41000000"));
}

TEST(FieldMap, EnforcesTheBoundsOfWhatItMakes) {
  const MapTypes types{"string s\nuint8[] n\nstring[] t", "string<=2 s\nuint8[<=2] n\nstring[<=1] t"};
  const FieldMap map = one_map(types, {from("s", "s"), from("n", "n"), from("t", "t")});
  EXPECT_EQ(converted(map, "00010000 03000000 616200 00 02000000 0102 0000 00000000"),
            compact("00010000 03000000 616200 00 02000000 0102 0000 00000000"));
  EXPECT_EQ(converted(map, "00010000 04000000 61626300 00000000 00000000"), "bound_exceeded at byte 4 in s");
  EXPECT_EQ(converted(map, "00010000 01000000 00 000000 03000000 010203 00 00000000"),
            "bound_exceeded at byte 16 in n");
  EXPECT_EQ(converted(map, "00010000 01000000 00 000000 00000000 02000000"), "truncated at byte 20 in t");
  EXPECT_EQ(converted(map, "00010000 01000000 00 000000 00000000 02000000 01000000 00 000000 01000000 00"),
            "bound_exceeded at byte 16 in t");
}

TEST(FieldMap, MakesArraysOfOtherSizes) {
  const MapTypes types{"uint16[2] two\nuint16[] any", "uint16[] any\nuint16[2] two"};
  const FieldMap map = one_map(types, {from("any", "two"), from("two", "any")});
  EXPECT_EQ(converted(map, "00010000 0100 0200 02000000 0300 0400"),
            compact("00010000 02000000 0100 0200 0300 0400"));
  EXPECT_EQ(converted(map, "00010000 0100 0200 01000000 0300"), "bad_length at byte 12 in two");
}

TEST(FieldMap, GivesDefaults) {
  const MapTypes types{
      "uint8 a",
      "uint8 a\nstring s \"hi\"\nfloat64 d 0.5\nint16[] n [1, -2]\nstring e\ngeometry_msgs/Point[2] p\n"
      "wstring w\nbool b true"};
  const FieldMap map = one_map(types, {from("a", "a")});
  const std::string zeros(12 * 8, '0');
  EXPECT_EQ(
      converted(map, "00010000 09"),
      compact(
          "00010000 09 000000 03000000 686900 0000000000 000000000000e03f 02000000 0100 feff 01000000 00" +
          std::string(6, '0') + zeros + "00000000 01"));
}

TEST(FieldMap, KeepsTimes) {
  const MapTypes types{"uint64 t\nfloat64 s\nint32 d",
                       "builtin_interfaces/Time t\nbuiltin_interfaces/Time s\n"
                       "builtin_interfaces/Duration d"};
  const std::vector<MapRule> rules{from("t", "t", {.unit = TimeUnit::us}),
                                   from("s", "s", {.unit = TimeUnit::s}),
                                   from("d", "d", {.unit = TimeUnit::ms})};
  // 3,000,005 us; 1.5 s; -1 ms.
  const std::string payload = compact("00010000 c5c62d0000000000 000000000000f83f ffffffff");
  const std::string ros = compact("00010000 03000000 88130000 01000000 0065cd1d ffffffff c0878b3b");
  EXPECT_EQ(converted(one_map(types, rules), payload), ros);
  EXPECT_EQ(converted(one_map(types, rules, to_payload), ros), payload);
}

TEST(FieldMap, SaturatesTimesThatAreTooFar) {
  const MapTypes types{"uint64 t", "builtin_interfaces/Time t"};
  const FieldMap map = one_map(types, {from("t", "t", {.unit = TimeUnit::s})});
  MapCounters counters;
  EXPECT_EQ(converted(map, hex("00010000 ffffffffffffffff"), counters),
            compact("00010000 ffffff7f ffc99a3b"));
  EXPECT_EQ(counters.saturated, 1U);
}

TEST(FieldMap, StampsWithTheTimeAtWhichAMessageCame) {
  const MapTypes types{"uint8 a", "std_msgs/Header h"};
  FieldMapping mapping{.rules = {received("h.stamp"), fixed("h.frame_id", "x")}, .dropped = {{"a", {}}}};
  const FieldMap map = map_of(types, mapping, to_ros);
  EXPECT_TRUE(map.needs_time());
  MapCounters counters;
  EXPECT_EQ(converted(map, hex("00010000 01"), counters, std::chrono::nanoseconds{5'000'000'007}),
            compact("00010000 05000000 07000000 02000000 7800"));
}

TEST(FieldMap, LooksUpConstantsOfBothMessages) {
  const MapTypes types{"uint8 OFF=0\nuint8 ON=1\nuint8 raw", "uint8 PARK=22\nuint8 DRIVE=2\nuint8 gear"};
  const std::vector<MapRule> rules{from("gear", "raw", {.table = table({{"OFF", "PARK"}, {"ON", "DRIVE"}})})};
  EXPECT_EQ(converted(one_map(types, rules), "00010000 01"), compact("00010000 02"));
  EXPECT_EQ(converted(one_map(types, rules), "00010000 05"), "not_in_table at byte 4 in raw");
  EXPECT_EQ(converted(one_map(types, rules, to_payload), "00010000 16"), compact("00010000 00"));
  EXPECT_EQ(converted(one_map(types, rules, to_payload), "00010000 17"), "not_in_table at byte 4 in gear");
}

TEST(FieldMap, TakesTheWayBackThatIsSaid) {
  const MapTypes types{"uint8 raw", "uint8 gear"};
  const std::vector<MapRule> rules{
      from("gear", "raw", {.table = table({{"1", "2"}, {"3", "2"}}), .back = table({{"2", "3"}})})};
  EXPECT_EQ(converted(one_map(types, rules), "00010000 01"), compact("00010000 02"));
  EXPECT_EQ(converted(one_map(types, rules, to_payload), "00010000 02"), compact("00010000 03"));
}

TEST(FieldMap, ReachesIntoMessagesAndArrays) {
  const MapTypes types{"geometry_msgs/Point[2] corners\nuint8 end",
                       "geometry_msgs/Point corner\nfloat64 x\nfloat64[3] all"};
  const FieldMap map = one_map(
      types, {from("corner", "corners[1]"), from("x", "corners[0].x"), from("all[2]", "corners[1].z")});
  const std::string number = "000000000000f03f";  // 1
  const std::string zero(16, '0');
  EXPECT_EQ(converted(map, "00010000 " + number + zero + zero + zero + zero + number + "07"),
            compact("00010000" + zero + zero + number + number + zero + zero + number));
}

TEST(FieldMap, RefusesWhatIsNoSampleOfItsType) {
  const MapTypes types{"uint8 a\nstring s\nbool b", "uint8 a\nuint8 b"};
  const FieldMap map = one_map(types, {from("a", "a"), from("b", "b")});
  EXPECT_EQ(converted(map, "000100"), "truncated at byte 0");
  EXPECT_EQ(converted(map, "00030000 01"), "bad_encapsulation at byte 0");
  EXPECT_EQ(converted(map, "00010000"), "truncated at byte 4 in a");
  EXPECT_EQ(converted(map, "00010000 01 000000 ff000000 00"), "truncated at byte 12 in s");
  EXPECT_EQ(converted(map, "00010000 01 000000 02000000 6162 01"), "bad_string at byte 14 in s");
  EXPECT_EQ(converted(map, "00010000 01 000000 01000000 00 02"), "bad_bool at byte 13 in b");
  EXPECT_EQ(converted(map, "00010000 01 000000 01000000 00 01 000000"), compact("00010000 01 01"));
  EXPECT_EQ(converted(map, "00010000 01 000000 01000000 00 01 00000000"), "trailing_bytes at byte 14");
}

TEST(FieldMap, RefersToLargeArrays) {
  const MapTypes types{"uint8 a\nuint8[] data", "uint8[] data\nuint8 a"};
  const FieldMap map = one_map(types, {from("data", "data"), from("a", "a")});
  std::vector<std::byte> sample = hex("00010000 07 000000 00200000");
  sample.resize(sample.size() + 0x2000, std::byte{5});
  MapScratch scratch;
  MapCounters counters;
  const auto made = map.convert(sample, {}, 4096, scratch, counters);
  ASSERT_TRUE(made);
  ASSERT_EQ(made->slices.size(), 3U);
  EXPECT_EQ(made->slices[1].data(), sample.data() + 12);
}

}  // namespace
}  // namespace trestle::messages::map_rules_test
