#include "bridge/measure/demo/pcd.hpp"

#include <gmock/gmock.h>

#include <filesystem>

#include "test/bytes.hpp"

namespace trestle::measure::demo::pcd_test {
namespace {

using test::hex;
using test::to_hex;
using testing::ElementsAre;
using testing::HasSubstr;
using Bytes = std::vector<std::byte>;

/// A header of two points of x (float32), padding (4 bytes), ring (uint16).
std::string header_for(const std::string& data) {
  return "# .PCD v0.7 - Point Cloud Data file format\n"
         "VERSION 0.7\n"
         "FIELDS x _ ring\n"
         "SIZE 4 1 2\n"
         "TYPE F U U\n"
         "COUNT 1 4 1\n"
         "WIDTH 2\n"
         "HEIGHT 1\n"
         "VIEWPOINT 0 0 0 1 0 0 0\n"
         "POINTS 2\n"
         "DATA " +
         data + "\n";
}

std::string text_of(const Bytes& bytes) {
  std::string text;
  for (const std::byte byte : bytes) {
    text += static_cast<char>(byte);
  }
  return text;
}

void expect_two_points(const tl::expected<Cloud, std::string>& cloud) {
  ASSERT_TRUE(cloud) << cloud.error();
  EXPECT_EQ(cloud->width, 2U);
  EXPECT_EQ(cloud->height, 1U);
  EXPECT_EQ(cloud->point_bytes, 10U);
  EXPECT_TRUE(cloud->dense);
  EXPECT_THAT(cloud->fields, ElementsAre(PointField{"x", 0, FieldType::float32, 1},
                                         PointField{"ring", 8, FieldType::uint16, 1}));
  EXPECT_EQ(to_hex(cloud->data),
            "0000c03f"
            "01020304"
            "0500"
            "00000040"
            "05060708"
            "ffff");
}

TEST(Pcd, ReadsAscii) {
  expect_two_points(parse_pcd(header_for("ascii") + "1.5 1 2 3 4 5\r\n2 5 6 7 8 65535", "f"));
}

TEST(Pcd, ReadsBinary) {
  expect_two_points(
      parse_pcd(header_for("binary") + text_of(hex("0000c03f 01020304 0500 00000040 05060708 ffff")), "f"));
}

TEST(Pcd, ReadsBinaryCompressed) {
  // Column by column: both x, both paddings, both rings; as one literal run of 20 bytes.
  expect_two_points(
      parse_pcd(header_for("binary_compressed") +
                    text_of(hex("15000000 14000000 13 0000c03f00000040 0102030405060708 0500ffff")),
                "f"));
}

TEST(Pcd, MarksCloudsWithNanAsNotDense) {
  const auto cloud = parse_pcd(header_for("ascii") + "nan 1 2 3 4 5\n2 5 6 7 8 9\n", "f");
  ASSERT_TRUE(cloud) << cloud.error();
  EXPECT_FALSE(cloud->dense);
}

TEST(Pcd, KnowsAllTypesOfPointCloud2) {
  const auto cloud = parse_pcd(
      "FIELDS a b c d e f g h\nSIZE 1 1 2 2 4 4 4 8\nTYPE I U I U I U F F\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA "
      "ascii\n"
      "-1 255 -2 65535 -3 4294967295 0.5 0.25\n",
      "f");
  ASSERT_TRUE(cloud) << cloud.error();
  EXPECT_EQ(to_hex(cloud->data),
            "ff"
            "ff"
            "feff"
            "ffff"
            "fdffffff"
            "ffffffff"
            "0000003f"
            "000000000000d03f");
  EXPECT_EQ(cloud->fields[7], (PointField{"h", 18, FieldType::float64, 1}));
}

std::string error_of(const std::string& text) {
  const auto cloud = parse_pcd(text, "f.pcd");
  return cloud ? "no error" : cloud.error();
}

TEST(Pcd, NamesTheLineOfAnError) {
  EXPECT_EQ(error_of(""), "f.pcd:0: the file ends before its DATA line");
  EXPECT_EQ(error_of("VERSION 0.7\nSHAPE 1\n"), "f.pcd:2: unknown key 'SHAPE' in the header");
  EXPECT_EQ(error_of("FIELDS x y\nSIZE 4\n"), "f.pcd:2: SIZE has 1 values for 2 FIELDS");
  EXPECT_EQ(error_of("FIELDS x\nTYPE Q\n"), "f.pcd:2: unknown TYPE 'Q': expected F, U or I");
  EXPECT_EQ(error_of("FIELDS x\nSIZE 8\nTYPE U\nDATA ascii\n"),
            "f.pcd:4: field 'x' of TYPE U and SIZE 8 has no counterpart in PointCloud2");
  EXPECT_EQ(error_of("FIELDS x\nSIZE 4\nTYPE F\nCOUNT 0\n"), "f.pcd:4: COUNT 0 is out of range: 1 to 4096");
  EXPECT_EQ(error_of("FIELDS x\nSIZE 4\nTYPE F\nWIDTH 3\nHEIGHT 1\nPOINTS 4\nDATA ascii\n"),
            "f.pcd:7: POINTS 4 is not WIDTH 3 times HEIGHT 1");
  EXPECT_EQ(
      error_of("FIELDS x\nSIZE 4\nTYPE F\nWIDTH 4294967295\nHEIGHT 4294967295\nPOINTS 1\nDATA binary\n"),
      "f.pcd:7: POINTS 1 is not WIDTH 4294967295 times HEIGHT 4294967295");
  EXPECT_EQ(
      error_of("FIELDS x\nSIZE 4\nTYPE F\nWIDTH 4294967295\nHEIGHT 1\nPOINTS 4294967295\nDATA binary\n"),
      "f.pcd:7: 4294967295 points of 4 bytes are more than 67108864 bytes");
  EXPECT_EQ(error_of("WIDTH -1\n"), "f.pcd:1: '-1' is not a number that fits here");
  EXPECT_EQ(error_of("FIELDS x\nSIZE 4\nTYPE F\nDATA zip\n"),
            "f.pcd:4: DATA must be ascii, binary or binary_compressed");
  EXPECT_EQ(error_of(header_for("ascii") + "1 2 3 4 5 6\n"), "f.pcd:12: the file ends after 1 of 2 points");
  EXPECT_EQ(error_of(header_for("ascii") + "1 2 3\n"), "f.pcd:12: 3 values where a point has 6");
  EXPECT_EQ(error_of(header_for("ascii") + "1 2 3 4 5 65536\n"),
            "f.pcd:12: '65536' is not a number that fits here");
}

TEST(Pcd, NamesTheByteOfAnErrorInBinaryData) {
  const std::string binary = header_for("binary");
  EXPECT_EQ(error_of(binary + "short"),
            "f.pcd: byte " + std::to_string(binary.size()) + ": 5 bytes are left where 20 are needed");
  const std::string compressed = header_for("binary_compressed");
  EXPECT_THAT(error_of(compressed + text_of(hex("15000000 13000000"))),
              HasSubstr("19 bytes uncompressed where the header promises 20"));
  EXPECT_EQ(error_of(compressed + text_of(hex("03000000 14000000 13 0000"))),
            "f.pcd: byte " + std::to_string(compressed.size() + 8) + ": damaged compressed data");
}

TEST(Pcd, IsRefusedWhenTruncatedAnywhere) {
  const std::string text = header_for("binary_compressed") +
                           text_of(hex("15000000 14000000 13 0000c03f00000040 0102030405060708 0500ffff"));
  for (std::size_t size = 0; size < text.size(); ++size) {
    EXPECT_FALSE(parse_pcd(std::string_view{text}.substr(0, size), "f")) << size;
  }
}

TEST(Pcd, SaysWhyAFileCannotBeRead) {
  EXPECT_EQ(load_pcd("/nowhere/f.pcd").error(), "/nowhere/f.pcd: No such file or directory");
}

TEST(Lzf, RepeatsWhatItHasSeen) {
  Bytes room(11);
  // "ab", then 9 bytes from 2 back: length 7 + 0, plus 2.
  EXPECT_TRUE(expand_lzf(hex("01 6162 e0 00 01"), room));
  EXPECT_EQ(to_hex(room), "6162616261626162616261");
}

TEST(Lzf, RefusesWhatReachesOutside) {
  Bytes room(4);
  EXPECT_FALSE(expand_lzf(hex("01 6162 20 02"), room));    // from 3 back, where only 2 are
  EXPECT_FALSE(expand_lzf(hex("01 6162 60 00"), room));    // 5 bytes where 2 fit
  EXPECT_FALSE(expand_lzf(hex("05 616263646566"), room));  // a literal of 6
  EXPECT_FALSE(expand_lzf(hex("03 6162"), room));          // truncated
  EXPECT_FALSE(expand_lzf(hex("01 6162 20"), room));       // truncated
  EXPECT_FALSE(expand_lzf(hex("01 6162"), room));          // too few come out
  EXPECT_TRUE(expand_lzf(hex("03 61626364"), room));
}

}  // namespace
}  // namespace trestle::measure::demo::pcd_test
