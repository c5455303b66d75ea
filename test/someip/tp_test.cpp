#include "someip/wire/tp.hpp"

#include <array>

#include "test/bytes.hpp"
#include "test/covers.hpp"

namespace trestle::someip::tp_test {
namespace {
using test::covers;
using test::hex;
using test::to_hex;

TEST(Tp, DecodesOffsetAndMoreSegmentsFlag) {
  covers(
      {"feat_req_someiptp_766", "feat_req_someiptp_832", "feat_req_someiptp_768", "feat_req_someiptp_771"});
  // Length 28 = 8 of the header + 4 TP + 16 slice. Offset field 0x57 units of 16 bytes = 1392.
  const auto bytes =
      hex("1234 8001 0000001c 0000 0007 01 01 22 00"
          "00000571 000102030405060708090a0b0c0d0e0f");
  const auto segment = decode_tp(*decode(bytes));
  ASSERT_TRUE(segment);
  EXPECT_EQ(segment->header.offset, 1392U);
  EXPECT_TRUE(segment->header.more);
  EXPECT_EQ(segment->header.reserved, 0);
  EXPECT_EQ(to_hex(segment->slice), "000102030405060708090a0b0c0d0e0f");
}

TEST(Tp, IgnoresTheReservedBits) {
  covers({"feat_req_someiptp_769"});
  const auto bytes = hex("1234 8001 0000000d 0000 0007 01 01 22 00 fffffffe aa");
  const auto segment = decode_tp(*decode(bytes));
  ASSERT_TRUE(segment);
  EXPECT_EQ(segment->header.offset, 0xfffffff0U);
  EXPECT_FALSE(segment->header.more);
  EXPECT_EQ(segment->header.reserved, 7);
}

TEST(Tp, RefusesAMessageWithoutTheTpFlag) {
  covers({"feat_req_someiptp_765"});
  const auto bytes = hex("1234 8001 0000000d 0000 0007 01 01 02 00 00000000 aa");
  EXPECT_EQ(decode_tp(*decode(bytes)).error(), WireError::bad_tp_flags);
}

TEST(Tp, RefusesASegmentTooShortForItsHeader) {
  const auto bytes = hex("1234 8001 0000000b 0000 0007 01 01 22 00 000000");
  EXPECT_EQ(decode_tp(*decode(bytes)).error(), WireError::truncated);
}

TEST(Tp, RefusesAnUnalignedLengthOfAllButTheLastSegment) {
  covers({"feat_req_someiptp_772", "feat_req_someiptp_792"});
  const auto middle = hex("1234 8001 0000000d 0000 0007 01 01 22 00 00000001 aa");
  EXPECT_EQ(decode_tp(*decode(middle)).error(), WireError::bad_tp_offset);
  const auto last = hex("1234 8001 0000000d 0000 0007 01 01 22 00 00000000 aa");
  EXPECT_TRUE(decode_tp(*decode(last)));
}

TEST(Tp, EncodesTheOriginalsHeaderWithTheTpFlagAndTheTpHeader) {
  covers(
      {"feat_req_someiptp_765", "feat_req_someiptp_767", "feat_req_someiptp_770", "feat_req_someiptp_774"});
  const Header original{.service = ServiceId{0x1234},
                        .method = MethodId{0x0421},
                        .client = ClientId{0x5678},
                        .session = SessionId{0x9abc},
                        .interface_version = 3,
                        .type = MessageType::error,
                        .return_code = ReturnCode::not_ready};
  std::array<std::byte, 20> room{};
  // Length 1404 = 0x57c = 8 + 4 + 1392.
  EXPECT_EQ(to_hex(*encode_tp_header(original, {.offset = 2784, .more = true}, 1392, room)),
            "123404210000057c56789abc0103a10400000ae1");
  EXPECT_EQ(to_hex(*encode_tp_header(original, {.offset = 2784, .more = false}, 1, room)),
            "123404210000000d56789abc0103a10400000ae0");
}

TEST(Tp, EncodesNothingThatItWouldNotDecode) {
  std::array<std::byte, 20> room{};
  EXPECT_EQ(encode_tp_header({}, {.offset = 8, .more = false}, 16, room).error(), WireError::bad_tp_offset);
  EXPECT_EQ(encode_tp_header({}, {.offset = 16, .more = true}, 15, room).error(), WireError::bad_tp_offset);
  EXPECT_EQ(encode_tp_header({}, {}, 16, ByteSpan{room}.first(19)).error(), WireError::no_room);
  EXPECT_EQ(encode_tp_header({}, {}, 0xfffffff8, room).error(), WireError::bad_length);
}

}  // namespace
}  // namespace trestle::someip::tp_test
