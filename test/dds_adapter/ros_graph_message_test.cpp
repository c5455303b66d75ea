#include "dds_adapter/ros_graph_message.hpp"

#include <gmock/gmock.h>

#include "test/bytes.hpp"

namespace trestle::test::ros_graph_message_test {
namespace {

using namespace dds::detail;

Gid gid(std::uint8_t first) {
  Gid result{};
  result.front() = std::byte{first};
  result.back() = std::byte{0x04};
  return result;
}

const ParticipantEntities lidar{
    .participant = gid(0xc1),
    .nodes = {
        {.name_space = "/", .name = "lidar", .readers = {gid(0xaa)}, .writers = {gid(0xbb), gid(0xcc)}}}};

// rmw_dds_common/msg/ParticipantEntitiesInfo. Both are byte for byte what the library rosbags 0.11.9, whose
// serializer is its own, makes of the same values with its definitions of Iron and Humble:
//
//     store = rosbags.typesys.get_typestore(Stores.ROS2_HUMBLE)
//     store.serialize_cdr(message, "rmw_dds_common/msg/ParticipantEntitiesInfo").hex()
//
// In Humble Gid.msg is `char[24] data` (ros2/rmw_dds_common, branch humble, d7f6621); since Iron char[16]
// (5ab4f59). What an id has beyond its GUID, prefix and entity, is zero there: create_rmw_gid() of
// ros2/rmw_fastrtps, branch humble.
const std::string lidar_iron =
    "00 01 00 00"
    "c1 00 00 00 00 00 00 00 00 00 00 00 00 00 00 04"  // the participant
    "01 00 00 00"                                      // nodes
    "02 00 00 00 2f 00 00 00"                          // "/", and 2 bytes of padding
    "06 00 00 00 6c 69 64 61 72 00 00 00"              // "lidar", and 2 bytes of padding
    "01 00 00 00"                                      // readers
    "aa 00 00 00 00 00 00 00 00 00 00 00 00 00 00 04"
    "02 00 00 00"  // writers
    "bb 00 00 00 00 00 00 00 00 00 00 00 00 00 00 04"
    "cc 00 00 00 00 00 00 00 00 00 00 00 00 00 00 04";

const std::string lidar_humble =
    "00 01 00 00"
    "c1 00 00 00 00 00 00 00 00 00 00 00 00 00 00 04 00 00 00 00 00 00 00 00"
    "01 00 00 00"
    "02 00 00 00 2f 00 00 00"
    "06 00 00 00 6c 69 64 61 72 00 00 00"
    "01 00 00 00"
    "aa 00 00 00 00 00 00 00 00 00 00 00 00 00 00 04 00 00 00 00 00 00 00 00"
    "02 00 00 00"
    "bb 00 00 00 00 00 00 00 00 00 00 00 00 00 00 04 00 00 00 00 00 00 00 00"
    "cc 00 00 00 00 00 00 00 00 00 00 00 00 00 00 04 00 00 00 00 00 00 00 00";

TEST(RosGraphMessage, HasIdsOfSixteenBytesSinceIron) {
  EXPECT_EQ(encode(lidar, GidForm::iron), hex(lidar_iron));
}

TEST(RosGraphMessage, HasIdsOfTwentyFourBytesInHumble) {
  EXPECT_EQ(encode(lidar, GidForm::humble), hex(lidar_humble));
}

TEST(RosGraphMessage, TellsItsFormByItsSize) {
  for (const auto& [text, form] : {std::pair{lidar_iron, GidForm::iron}, {lidar_humble, GidForm::humble}}) {
    const auto decoded = decode_entities(hex(text));
    ASSERT_TRUE(decoded);
    EXPECT_EQ(decoded->form, form);
    EXPECT_EQ(decoded->entities, lidar);
  }
}

TEST(RosGraphMessage, TellsItsFormWithoutAnyNode) {
  const std::string participant = "00 01 00 00 c1 00 00 00 00 00 00 00 00 00 00 00 00 00 00 04";
  EXPECT_EQ(decode_entities(hex(participant + "00 00 00 00"))->form, GidForm::iron);
  EXPECT_EQ(decode_entities(hex(participant + "00 00 00 00 00 00 00 00 00 00 00 00"))->form, GidForm::humble);
}

TEST(RosGraphMessage, IsReadInBigEndianToo) {
  const auto decoded =
      decode_entities(hex("00 00 00 00"
                          "c1 00 00 00 00 00 00 00 00 00 00 00 00 00 00 04"
                          "00 00 00 01"
                          "00 00 00 02 2f 00 00 00"
                          "00 00 00 06 6c 69 64 61 72 00 00 00"
                          "00 00 00 01"
                          "aa 00 00 00 00 00 00 00 00 00 00 00 00 00 00 04"
                          "00 00 00 02"
                          "bb 00 00 00 00 00 00 00 00 00 00 00 00 00 00 04"
                          "cc 00 00 00 00 00 00 00 00 00 00 00 00 00 00 04"));
  ASSERT_TRUE(decoded);
  EXPECT_EQ(decoded->entities, lidar);
}

TEST(RosGraphMessage, IsRefusedWhenItIsCutOrGoesOn) {
  for (const std::string& text : {lidar_iron, lidar_humble}) {
    auto sample = hex(text);
    for (std::size_t size = 0; size < sample.size(); ++size) {
      if (text == lidar_humble && size >= 24 && size < 28) {
        continue;  // so much of it is the message of a participant without a node, with ids of 16 bytes
      }
      EXPECT_FALSE(decode_entities(std::span{sample}.first(size))) << size;
    }
    sample.resize(sample.size() + 3);  // DDS may fill up to a multiple of 4
    EXPECT_TRUE(decode_entities(sample));
    sample.resize(sample.size() + 1);
    EXPECT_FALSE(decode_entities(sample));
  }
}

TEST(RosGraphMessage, IsRefusedWithNamesThatRosDoesNotAllow) {
  const std::string before = "00 01 00 00 c1 00 00 00 00 00 00 00 00 00 00 00 00 00 00 04 01 00 00 00";
  const std::string after = "00 00 00 00 00 00 00 00";
  ASSERT_TRUE(decode_entities(hex(before + "02 00 00 00 2f 00 00 00" + "02 00 00 00 61 00 00 00" + after)));
  // No terminator; no character at all; 257 characters.
  EXPECT_FALSE(decode_entities(hex(before + "02 00 00 00 2f 2f 00 00" + "02 00 00 00 61 00 00 00" + after)));
  EXPECT_FALSE(decode_entities(hex(before + "00 00 00 00" + "02 00 00 00 61 00 00 00" + after)));
  std::string long_name = "02 01 00 00";
  for (int i = 0; i < 257; ++i) {
    long_name += "61";
  }
  EXPECT_FALSE(decode_entities(hex(before + "02 00 00 00 2f 00 00 00" + long_name + "00 00 00" + after)));
}

TEST(RosGraphMessage, WithCountsThatItCannotHoldTakesNoMemory) {
  // 0xffffffff nodes; a node with 0xffffffff readers.
  EXPECT_FALSE(
      decode_entities(hex("00 01 00 00 c1 00 00 00 00 00 00 00 00 00 00 00 00 00 00 04 ff ff ff ff")));
  EXPECT_FALSE(
      decode_entities(hex("00 01 00 00 c1 00 00 00 00 00 00 00 00 00 00 00 00 00 00 04 01 00 00 00"
                          "02 00 00 00 2f 00 00 00 02 00 00 00 61 00 00 00 ff ff ff ff")));
}

}  // namespace
}  // namespace trestle::test::ros_graph_message_test
