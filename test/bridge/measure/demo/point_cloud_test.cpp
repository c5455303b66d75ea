#include "bridge/measure/point_cloud.hpp"

#include <gmock/gmock.h>

#include <set>

#include "test/bytes.hpp"

namespace trestle::measure::point_cloud_test {
namespace {

using test::hex;
using test::to_hex;
using Bytes = std::vector<std::byte>;

Bytes whole(const EncodedCloud& encoded) {
  Bytes bytes = encoded.front;
  bytes.insert(bytes.end(), encoded.data.begin(), encoded.data.end());
  bytes.push_back(encoded.tail);
  return bytes;
}

Cloud two_points() {
  Cloud cloud;
  cloud.width = 2;
  cloud.point_bytes = 6;
  cloud.fields = {{"x", 0, FieldType::float32, 1}, {"ring", 4, FieldType::uint16, 1}};
  cloud.data = hex("0000803f 0100  00000040 0200");
  return cloud;
}

TEST(EncodedCloud, IsThePointCloud2ThatRos2Serialises) {
  Cloud cloud = two_points();
  // 7.000000005 s, frame "map"; written down by hand from sensor_msgs/msg/PointCloud2 and XCDR1.
  EXPECT_EQ(to_hex(whole(encode(cloud, 7'000'000'005, "map"))),
            to_hex(hex("00010000"           // little-endian CDR
                       "07000000 05000000"  // stamp
                       "04000000 6d617000"  // frame_id
                       "01000000 02000000"  // height, width
                       "02000000"           // two fields
                       "02000000 7800 0000 00000000 07 000000 01000000"
                       "05000000 72696e6700 000000 04000000 04 000000 01000000"
                       "00 000000 06000000 0c000000"  // is_bigendian, point_step, row_step
                       "0c000000 0000803f0100 000000400200"
                       "01")));  // is_dense
}

TEST(EncodedCloud, IsReadBackInEitherByteOrder) {
  const Bytes bytes =
      hex("00000000 00000007 00000005 00000004 6d617000 00000001 00000002 00000001"
          "00000002 7800 0000 00000000 07 000000 00000001 00 000000 00000004 00000008"
          "00000008 0000803f 00000040 01");
  const auto big = decode(bytes);
  ASSERT_TRUE(big) << big.error();
  EXPECT_EQ(big->stamp_ns, 7'000'000'005);
  EXPECT_EQ(big->frame_id, "map");
  EXPECT_EQ(big->width, 2U);
  EXPECT_EQ(big->point_bytes, 4U);
  EXPECT_EQ(big->data.size(), 8U);
  EXPECT_TRUE(big->dense);
}

TEST(EncodedCloud, KeepsStampsBefore1970) {
  const Bytes bytes = whole(encode(two_points(), -1, "map"));
  EXPECT_EQ(to_hex(ByteView{bytes}.subspan(4, 8)),
            "ffffffff"
            "ffc99a3b");  // -1 s and 999999999 ns
  EXPECT_EQ(decode(bytes)->stamp_ns, -1);
  Bytes damaged = bytes;
  damaged[8] = std::byte{0};  // 1 000 000 000 - 255 - 1: still less than a second
  EXPECT_TRUE(decode(damaged));
  damaged[11] = std::byte{0x3c};
  EXPECT_EQ(decode(damaged).error(), "header.stamp has a second or more of nanoseconds");
}

TEST(EncodedCloud, IsRefusedWhenTruncatedAnywhere) {
  const Bytes bytes = whole(encode(two_points(), 1, "map"));
  ASSERT_TRUE(decode(bytes));
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(decode(ByteView{bytes}.first(size))) << size;
  }
}

TEST(EncodedCloud, MayBeFollowedByPaddingOnly) {
  Bytes bytes = whole(encode(two_points(), 1, "map"));
  bytes.resize(bytes.size() + 3);
  EXPECT_TRUE(decode(bytes));
  bytes.resize(bytes.size() + 1);
  EXPECT_EQ(decode(bytes).error(), "more bytes than the message has");
}

TEST(EncodedCloud, IsRefusedWithCountsThatCannotBe) {
  Bytes bytes = whole(encode(two_points(), 1, "map"));
  Bytes fields = bytes;
  fields[30] = std::byte{0xff};  // the number of fields becomes 0x00ff0002
  EXPECT_FALSE(decode(fields));
  Bytes width = bytes;
  width[24] = std::byte{3};
  EXPECT_EQ(decode(width).error(), "height, width, point_step, row_step and data do not agree");
}

TEST(Checksum, IsTheSameOnBothEnds) {
  const Cloud cloud = two_points();
  const EncodedCloud encoded = encode(cloud, 5'000'000'017, "lidar");
  const Bytes bytes = whole(encoded);
  const auto received = decode(bytes);
  ASSERT_TRUE(received) << received.error();
  EXPECT_EQ(checksum(*received), checksum(encoded));
  EXPECT_NE(checksum(encode(two_points(), 5'000'000'018, "lidar")), checksum(encoded));
  EXPECT_NE(checksum(encode(two_points(), 5'000'000'017, "radar")), checksum(encoded));
}

TEST(Checksum, IsAnotherOneForEachFlippedBit) {
  const Cloud cloud = two_points();
  const EncodedCloud encoded = encode(cloud, 5'000'000'017, "lidar");
  const Bytes bytes = whole(encoded);
  // Padding says nothing, so a change of it is none: the options of the encapsulation, and alignment.
  const std::set<std::size_t> padding{2, 3, 22, 23, 42, 43, 49, 50, 51, 65, 66, 67, 73, 74, 75, 81, 82, 83};
  std::size_t unnoticed = 0;
  for (std::size_t bit = 0; bit < bytes.size() * 8; ++bit) {
    Bytes damaged = bytes;
    damaged[bit / 8] ^= std::byte{1} << (bit % 8);
    const auto received = decode(damaged);
    if (received && !received->big_endian && checksum(*received) == checksum(encoded)) {
      ++unnoticed;
      EXPECT_TRUE(padding.contains(bit / 8)) << "byte " << bit / 8 << " of " << to_hex(bytes);
    }
  }
  EXPECT_EQ(unnoticed, padding.size() * 8);
}

}  // namespace
}  // namespace trestle::measure::point_cloud_test
