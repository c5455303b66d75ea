#include "someip/wire/header.hpp"

#include <array>

#include "someip/wire/return_code_name.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"

namespace trestle::someip::header_test {
namespace {
using test::covers;
using test::hex;
using test::to_hex;

TEST(Header, DecodesEveryFieldBigEndian) {
  covers({"feat_req_someip_42", "feat_req_someip_45", "feat_req_someip_77", "feat_req_someip_539",
          "feat_req_someip_56", "feat_req_someip_625", "feat_req_someip_67", "feat_req_someip_83",
          "feat_req_someip_165"});
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
  covers({"feat_req_someip_44", "feat_req_someip_60", "feat_req_someip_142"});
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

TEST(Header, BelongsToTheFirstProtocolVersionAndReportsSuccessUnlessToldOtherwise) {
  covers({"feat_req_someip_90", "feat_req_someip_144", "feat_req_someip_92"});
  std::array<std::byte, 16> room{};
  const Header event{.service = ServiceId{0x1234},
                     .method = MethodId{0x8001},
                     .session = SessionId{1},
                     .interface_version = 3,
                     .type = MessageType::notification};
  EXPECT_EQ(to_hex(*encode(event, {}, room)), to_hex(hex("1234 8001 00000008 0000 0001 01 03 02 00")));
  EXPECT_EQ(to_hex(*encode(Header{}, {}, room)), to_hex(hex("0000 0000 00000008 0000 0000 01 00 00 00")));
}

TEST(Header, IsRefusedWhenTheLengthFieldCannotSayHowMuchFollows) {
  std::array<std::byte, 16> room{};
  EXPECT_EQ(to_hex(*encode_header({}, 0xffff'fff7, room)),
            to_hex(hex("0000 0000 ffffffff 0000 0000 01 00 00 00")));
  EXPECT_EQ(encode_header({}, 0xffff'fff8, room).error(), WireError::bad_length);
}

TEST(MessageType, HasTheNumbersOfTheSpecification) {
  covers({"feat_req_someip_95", "feat_req_someip_684", "feat_req_someip_761", "feat_req_someip_142"});
  const auto byte_of = [](MessageType type) {
    std::array<std::byte, 16> room{};
    return std::to_integer<int>((*encode({.type = type}, {}, room))[14]);
  };
  EXPECT_EQ(byte_of(MessageType::request), 0x00);
  EXPECT_EQ(byte_of(MessageType::request_no_return), 0x01);
  EXPECT_EQ(byte_of(MessageType::notification), 0x02);
  EXPECT_EQ(byte_of(MessageType::response), 0x80);
  EXPECT_EQ(byte_of(MessageType::error), 0x81);
  EXPECT_EQ(byte_of(MessageType::tp_request), 0x20);
  EXPECT_EQ(byte_of(MessageType::tp_request_no_return), 0x21);
  EXPECT_EQ(byte_of(MessageType::tp_notification), 0x22);
  EXPECT_EQ(byte_of(MessageType::tp_response), 0xa0);
  EXPECT_EQ(byte_of(MessageType::tp_error), 0xa1);
}

TEST(MessageType, SaysWithOneBitWhetherItIsASegment) {
  covers({"feat_req_someip_761"});
  for (int byte = 0; byte < 256; ++byte) {
    const auto type = static_cast<MessageType>(byte);
    EXPECT_EQ(is_tp(type), (byte & 0x20) != 0) << byte;
    EXPECT_EQ(static_cast<int>(with_tp(type)), byte | 0x20) << byte;
    EXPECT_EQ(static_cast<int>(without_tp(type)), byte & 0xdf) << byte;
  }
}

TEST(ReturnCode, HasTheNumbersOfTheSpecification) {
  covers({"feat_req_someip_371"});
  const auto byte_of = [](ReturnCode code) {
    std::array<std::byte, 16> room{};
    return std::to_integer<int>((*encode({.return_code = code}, {}, room))[15]);
  };
  EXPECT_EQ(byte_of(ReturnCode::ok), 0x00);
  EXPECT_EQ(byte_of(ReturnCode::not_ok), 0x01);
  EXPECT_EQ(byte_of(ReturnCode::unknown_service), 0x02);
  EXPECT_EQ(byte_of(ReturnCode::unknown_method), 0x03);
  EXPECT_EQ(byte_of(ReturnCode::not_ready), 0x04);
  EXPECT_EQ(byte_of(ReturnCode::not_reachable), 0x05);
  EXPECT_EQ(byte_of(ReturnCode::timeout), 0x06);
  EXPECT_EQ(byte_of(ReturnCode::wrong_protocol_version), 0x07);
  EXPECT_EQ(byte_of(ReturnCode::wrong_interface_version), 0x08);
  EXPECT_EQ(byte_of(ReturnCode::malformed_message), 0x09);
  EXPECT_EQ(byte_of(ReturnCode::wrong_message_type), 0x0a);
  EXPECT_EQ(byte_of(ReturnCode::e2e_repeated), 0x0b);
  EXPECT_EQ(byte_of(ReturnCode::e2e_wrong_sequence), 0x0c);
  EXPECT_EQ(byte_of(ReturnCode::e2e), 0x0d);
  EXPECT_EQ(byte_of(ReturnCode::e2e_not_available), 0x0e);
  EXPECT_EQ(byte_of(ReturnCode::e2e_no_new_data), 0x0f);
}

TEST(ReturnCode, HasTheNameOfTheSpecification) {
  covers({"feat_req_someip_371"});
  EXPECT_EQ(name_of(ReturnCode::ok), "E_OK");
  EXPECT_EQ(name_of(ReturnCode::wrong_message_type), "E_WRONG_MESSAGE_TYPE");
  EXPECT_EQ(name_of(ReturnCode::e2e_no_new_data), "E_E2E_NO_NEW_DATA");
  EXPECT_EQ(name_of(ReturnCode{0x10}), "");
  EXPECT_EQ(name_of(ReturnCode{0xff}), "");
}

TEST(WireError, HasTheNameThatItsReadersSee) {
  EXPECT_STREQ(to_string(WireError::truncated), "truncated");
  EXPECT_STREQ(to_string(WireError::bad_length), "bad_length");
  EXPECT_STREQ(to_string(WireError::no_room), "no_room");
  EXPECT_STREQ(to_string(WireError::bad_tp_offset), "bad_tp_offset");
  EXPECT_STREQ(to_string(WireError::bad_tp_flags), "bad_tp_flags");
  EXPECT_STREQ(to_string(WireError::bad_string_encoding), "bad_string_encoding");
  EXPECT_STREQ(to_string(WireError::bad_union_type), "bad_union_type");
  EXPECT_STREQ(to_string(WireError::bad_tag), "bad_tag");
  EXPECT_STREQ(to_string(WireError::not_sd), "not_sd");
  EXPECT_STREQ(to_string(WireError::bad_entries_length), "bad_entries_length");
  EXPECT_STREQ(to_string(WireError::bad_options_length), "bad_options_length");
  EXPECT_STREQ(to_string(WireError::bad_option_length), "bad_option_length");
  EXPECT_STREQ(to_string(WireError::bad_entry_type), "bad_entry_type");
  EXPECT_STREQ(to_string(WireError::bad_option_reference), "bad_option_reference");
  EXPECT_STREQ(to_string(WireError::bad_value), "bad_value");
}

TEST(Ids, ThatAreReservedNameNothing) {
  covers({"feat_req_someip_627", "feat_req_someip_579", "feat_req_someipids_505", "feat_req_someipids_529",
          "feat_req_someipids_555"});
  for (std::uint32_t id = 0; id <= 0xffff; ++id) {
    const bool ordinary = id != 0 && id != 0xffff;
    ASSERT_EQ(names_a_service(static_cast<ServiceId>(id)), ordinary) << id;
    ASSERT_EQ(names_an_instance(static_cast<InstanceId>(id)), ordinary) << id;
    ASSERT_EQ(names_an_eventgroup(static_cast<EventgroupId>(id)), ordinary) << id;
  }
}

TEST(MessageCursor, WalksOverSeveralMessagesOfOneDatagram) {
  covers({"feat_req_someip_702", "feat_req_someip_584"});
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
}  // namespace trestle::someip::header_test
