#include "someip/wire/header.hpp"

#include <array>

#include "test/bytes.hpp"
#include "test/covers.hpp"

namespace trestle::someip {
namespace {
using test::covers;
using test::hex;
using test::to_hex;

TEST(Header, DecodesEveryFieldBigEndian) {
  covers({"feat_req_someip_42", "feat_req_someip_45", "feat_req_someip_77"});
  const auto bytes = hex("1234 8001 0000000a 5678 9abc 01 03 02 00 cafe");
  const auto message = decode(bytes);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->header.service, ServiceId{0x1234});
  EXPECT_EQ(message->header.method, MethodId{0x8001});
  EXPECT_EQ(message->header.client, ClientId{0x5678});
  EXPECT_EQ(message->header.session, SessionId{0x9abc});
  EXPECT_EQ(message->header.protocol, 1);
  EXPECT_EQ(message->header.interface_version, 3);
  EXPECT_EQ(message->header.type, MessageType::notification);
  EXPECT_EQ(message->header.return_code, ReturnCode::ok);
  EXPECT_EQ(to_hex(message->payload), "cafe");
}

TEST(Header, RefusesALengthBelowEight) {
  covers({"feat_req_someip_798"});
  const auto bytes = hex("1234 8001 00000007 5678 9abc 01 03 02 00");
  EXPECT_EQ(decode(bytes).error(), WireError::bad_length);
}

TEST(Header, AsksForMoreAtEveryTruncation) {
  const auto bytes = hex("1234 8001 0000000a 5678 9abc 01 03 02 00 cafe");
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_EQ(decode(ByteView{bytes}.first(size)).error(), WireError::truncated) << size;
  }
}

TEST(Header, EncodesWhatItDecoded) {
  covers({"feat_req_someip_44"});
  const auto bytes = hex("1234 0421 0000000a 5678 9abc 01 03 a1 5e cafe");
  const auto message = decode(bytes);
  ASSERT_TRUE(message);
  std::array<std::byte, 18> room{};
  const auto again = encode(message->header, message->payload, room);
  ASSERT_TRUE(again);
  EXPECT_EQ(to_hex(*again), to_hex(bytes));
}

TEST(Header, EncodesNothingWithoutRoom) {
  std::array<std::byte, 17> room{};
  EXPECT_EQ(encode(Header{}, hex("cafe"), room).error(), WireError::no_room);
}

TEST(MessageCursor, WalksOverSeveralMessagesOfOneDatagram) {
  covers({"feat_req_someip_702"});
  const auto bytes =
      hex("1234 8001 00000009 0000 0001 01 01 02 00 aa 1234 8002 00000008 0000 0002 01 01 02 00");
  MessageCursor cursor{bytes};
  EXPECT_EQ(cursor.next()->header.method, MethodId{0x8001});
  EXPECT_EQ(cursor.next()->header.method, MethodId{0x8002});
  EXPECT_FALSE(cursor.next());
  EXPECT_FALSE(cursor.error());
}

TEST(MessageCursor, SaysWhereAndWhyItStopped) {
  const auto bytes =
      hex("1234 8001 00000009 0000 0001 01 01 02 00 aa 1234 8002 00000009 0000 0002 01 01 02 00");
  MessageCursor cursor{bytes};
  EXPECT_TRUE(cursor.next());
  EXPECT_FALSE(cursor.next());
  EXPECT_EQ(cursor.error(), WireError::truncated);
  EXPECT_EQ(cursor.offset(), 17U);
}

}  // namespace
}  // namespace trestle::someip
