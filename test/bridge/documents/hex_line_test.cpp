#include "bridge/documents/hex_line.hpp"

#include <gtest/gtest.h>

#include "test/bytes.hpp"

namespace trestle::documents::hex_line_test {
namespace {

std::string parse(std::string_view line) {
  const auto bytes = parse_hex_line(line);
  return bytes ? test::to_hex(*bytes) : "not after " + std::to_string(bytes.error());
}

TEST(HexLine, ReadsTheUsualWaysToWriteBytes) {
  EXPECT_EQ(parse("1234aBCd"), "1234abcd");
  EXPECT_EQ(parse("0x1234ABCD"), "1234abcd");
  EXPECT_EQ(parse(" 12 34\tab-cd:ef,01\r"), "1234abcdef01");
  EXPECT_EQ(parse("0x12, 0X34"), "1234");
  EXPECT_EQ(parse(""), "");
}

TEST(HexLine, SaysWhereItIsNotHexadecimal) {
  EXPECT_EQ(parse("zz"), "not after 0");
  EXPECT_EQ(parse("12 3"), "not after 4");
  EXPECT_EQ(parse("12 3 4"), "not after 4");
  EXPECT_EQ(parse("12 0x"), "not after 5");
  EXPECT_EQ(parse("12 34 # a comment"), "not after 6");
}

}  // namespace
}  // namespace trestle::documents::hex_line_test
