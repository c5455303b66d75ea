#include "bridge/messages/map/number_map.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

namespace trestle::messages::number_map_test {
namespace {

using enum Primitive;

std::string lost(const MapCounters& counters) {
  return std::to_string(counters.saturated) + " " + std::to_string(counters.rounded) + " " +
         std::to_string(counters.not_a_number);
}

std::uint64_t bits(float number) {
  return std::bit_cast<std::uint32_t>(number);
}
std::uint64_t bits(double number) {
  return std::bit_cast<std::uint64_t>(number);
}

/// The bits that a number becomes, and what was lost: "255, 1 0 0".
std::string becomes(const NumberMap& map, std::uint64_t number) {
  MapCounters counters;
  return map.convert(number, counters) ? std::to_string(number) + ", " + lost(counters) : "not in the table";
}

TEST(NumberMap, KeepsWholeNumbersThatTheOtherTypeCanHold) {
  EXPECT_EQ(becomes({.from = uint8, .to = uint64}, 255), "255, 0 0 0");
  EXPECT_EQ(becomes({.from = int8, .to = int32}, 0xff), "4294967295, 0 0 0");  // -1
  EXPECT_EQ(becomes({.from = int64, .to = int8}, ~std::uint64_t{0}), "255, 0 0 0");
  EXPECT_EQ(becomes({.from = uint64, .to = uint64}, ~std::uint64_t{0}), "18446744073709551615, 0 0 0");
  EXPECT_EQ(becomes({.from = boolean, .to = uint16}, 1), "1, 0 0 0");
}

TEST(NumberMap, TakesTheNearestWholeNumberThatThereIs) {
  EXPECT_EQ(becomes({.from = uint16, .to = uint8}, 256), "255, 1 0 0");
  EXPECT_EQ(becomes({.from = int16, .to = uint8}, 0xffff), "0, 1 0 0");   // -1
  EXPECT_EQ(becomes({.from = int16, .to = int8}, 0xff7f), "128, 1 0 0");  // -129 becomes -128
  EXPECT_EQ(becomes({.from = int16, .to = int8}, 0xff80), "128, 0 0 0");
  EXPECT_EQ(becomes({.from = uint64, .to = int64}, std::uint64_t{1} << 63U), "9223372036854775807, 1 0 0");
  EXPECT_EQ(becomes({.from = int64, .to = uint64}, std::uint64_t{1} << 63U), "0, 1 0 0");
  EXPECT_EQ(becomes({.from = uint8, .to = boolean}, 2), "1, 1 0 0");
}

TEST(NumberMap, RoundsHalvesAwayFromZeroAndCounts) {
  const NumberMap map{.from = float64, .to = int8};
  EXPECT_EQ(becomes(map, bits(2.5)), "3, 0 1 0");
  EXPECT_EQ(becomes(map, bits(-2.5)), "253, 0 1 0");
  EXPECT_EQ(becomes(map, bits(2.0000001)), "2, 0 0 0");  // what a scale loses is not counted
  EXPECT_EQ(becomes(map, bits(127.4)), "127, 0 1 0");
  EXPECT_EQ(becomes(map, bits(127.6)), "127, 1 0 0");
  EXPECT_EQ(becomes(map, bits(-128.6)), "128, 1 0 0");
  EXPECT_EQ(becomes(map, bits(std::nan(""))), "0, 0 0 1");
  EXPECT_EQ(becomes(map, bits(std::numeric_limits<double>::infinity())), "127, 1 0 0");
  EXPECT_EQ(becomes({.from = float64, .to = uint64}, bits(0x1p64)), "18446744073709551615, 1 0 0");
  EXPECT_EQ(becomes({.from = float64, .to = uint64}, bits(0x1p63)), "9223372036854775808, 0 0 0");
  EXPECT_EQ(becomes({.from = float64, .to = int64}, bits(-0x1p63)), "9223372036854775808, 0 0 0");
  EXPECT_EQ(becomes({.from = float64, .to = int64}, bits(0x1p63)), "9223372036854775807, 1 0 0");
  EXPECT_EQ(becomes({.from = float32, .to = boolean}, bits(0.7F)), "1, 0 1 0");
}

TEST(NumberMap, ScalesThereAndBack) {
  EXPECT_EQ(becomes({.from = uint16, .to = float64, .scale = 0.01, .offset = -40}, 5000),
            std::to_string(bits(10.0)) + ", 0 0 0");
  EXPECT_EQ(
      becomes({.from = float64, .to = uint16, .scale = 0.01, .offset = -40, .backwards = true}, bits(10.0)),
      "5000, 0 0 0");
  EXPECT_EQ(becomes({.from = uint8, .to = uint16, .scale = 3}, 7), "21, 0 0 0");
  EXPECT_EQ(becomes({.from = float64, .to = float32}, bits(1e300)),
            std::to_string(bits(std::numeric_limits<float>::max())) + ", 1 0 0");
  EXPECT_EQ(becomes({.from = float64, .to = float32}, bits(-std::numeric_limits<double>::infinity())),
            std::to_string(bits(-std::numeric_limits<float>::infinity())) + ", 0 0 0");
}

TEST(NumberMap, LooksUpInItsTable) {
  NumberMap map{.from = int8, .to = uint16, .has_table = true, .table = {{-1, 7}, {0, 1}, {3, 300}}};
  EXPECT_EQ(becomes(map, 0xff), "7, 0 0 0");
  EXPECT_EQ(becomes(map, 3), "300, 0 0 0");
  EXPECT_EQ(becomes(map, 4), "not in the table");
  map.otherwise = Otherwise::value;
  map.otherwise_bits = 9;
  EXPECT_EQ(becomes(map, 4), "9, 0 0 0");
  map.otherwise = Otherwise::keep;
  EXPECT_EQ(becomes(map, 4), "4, 0 0 0");
  EXPECT_EQ(becomes(map, 0xfe), "0, 1 0 0");  // -2
}

}  // namespace
}  // namespace trestle::messages::number_map_test
