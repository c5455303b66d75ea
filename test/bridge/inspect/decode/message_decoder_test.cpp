#include "bridge/inspect/decode/message_decoder.hpp"

#include <gmock/gmock.h>

#include "test/bridge/inspect/decode/printed.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"

namespace trestle::inspect::message_decoder_test {
namespace {
using test::covers;
using test::hex;
using test::Printed;
using testing::ElementsAre;
using testing::SizeIs;

Printed decode(const std::string& digits, bool reassemble = false) {
  Printed printed;
  MessageDecoder decoder{reassemble, printed.hooks()};
  decoder.datagram({}, hex(digits));
  return printed;
}

// An offer of 1234.5678 version 1.2 for 3 s at 10.0.0.1, UDP 30509.
const std::string offer =
    "ffff8100 00000030 00000001 01010200 c0000000 00000010 01 00 00 10 1234 5678 01 000003 00000002"
    "0000000c 0009 04 00 0a000001 00 11 772d";

TEST(MessageDecoder, PrintsEveryFieldOfAMessage) {
  const Printed printed = decode("1234 0421 0000000a 5678 9abc 01 03 80 5e cafe");
  ASSERT_THAT(printed.objects, SizeIs(1));
  EXPECT_EQ(
      printed.objects[0].dump(),
      R"({"offset":0,"service":"0x1234","method":"0x0421","length":10,"client":"0x5678","session":"0x9abc",)"
      R"("protocol_version":1,"interface_version":3,"message_type":"RESPONSE","message_type_value":128,)"
      R"("return_code":null,"return_code_value":94,"payload":"cafe"})");
}

TEST(MessageDecoder, NamesTypesAsTheSpecificationDoes) {
  covers({"feat_req_someip_684", "feat_req_someip_761"});
  const auto name = [](const std::string& type) {
    return decode("1234 0421 0000000c 0001 0001 01 01" + type + "00 00000000")
        .objects[0]["message_type"]
        .dump();
  };
  EXPECT_EQ(name("00"), R"("REQUEST")");
  EXPECT_EQ(name("01"), R"("REQUEST_NO_RETURN")");
  EXPECT_EQ(name("02"), R"("NOTIFICATION")");
  EXPECT_EQ(name("80"), R"("RESPONSE")");
  EXPECT_EQ(name("81"), R"("EXCEPTION")");
  EXPECT_EQ(name("20"), R"("TP_REQUEST")");
  EXPECT_EQ(name("a1"), R"("TP_EXCEPTION")");
  EXPECT_EQ(name("55"), "null");
}

TEST(MessageDecoder, PrintsAnSdMessageInFull) {
  const Printed printed = decode(offer);
  ASSERT_THAT(printed.objects, SizeIs(1));
  EXPECT_EQ(
      printed.objects[0]["sd"].dump(),
      R"({"flags":{"value":192,"reboot":true,"unicast":true,"explicit_initial_data":false},"reserved":0,)"
      R"("entries":[{"type":"offer_service","type_value":1,"service":"0x1234","instance":"0x5678",)"
      R"("major_version":1,"ttl":3,"minor_version":2,"first_run":{"index":0,"count":1},)"
      R"("second_run":{"index":0,"count":0}}],)"
      R"("options":[{"type":"ipv4_endpoint","type_value":4,"length":9,"discardable":false,)"
      R"("address":"10.0.0.1","transport":"udp","transport_value":17,"port":30509}]})");
}

TEST(MessageDecoder, PrintsEveryKindOfOption) {
  // A subscription; configuration, load balancing, IPv6 endpoint, and one of an unknown type.
  const Printed printed = decode(
      "ffff8100 0000005d 00000001 01010200 c0000000 00000010 06 00 00 40 1234 5678 01 000003 00 83 0007"
      "00000039 0010 01 00 03 613d62 01 63 02 643d 04 653d5a41 00"
      "0005 02 80 0001 0002"
      "0015 06 00 fe800000000000000000000000000001 00 06 772d"
      "0003 77 00 cafe");
  EXPECT_THAT(printed.summary(), ElementsAre("ffff.8100@0"));
  const Json& entry = printed.objects[0]["sd"]["entries"][0];
  EXPECT_EQ(entry["type"], "subscribe_eventgroup");
  EXPECT_EQ(entry["eventgroup"], "0x0007");
  EXPECT_EQ(entry["counter"], 3);
  EXPECT_EQ(entry["initial_data_requested"], true);
  EXPECT_FALSE(entry.contains("minor_version"));
  const Json& options = printed.objects[0]["sd"]["options"];
  ASSERT_THAT(options, SizeIs(4));
  EXPECT_EQ(
      options[0].dump(),
      R"({"type":"configuration","type_value":1,"length":16,"discardable":false,"items":[)"
      R"({"key":"a","value":"b"},{"key":"c","value":null},{"key":"d","value":""},{"key":"e","value":"ZA"}]})");
  EXPECT_EQ(
      options[1].dump(),
      R"({"type":"load_balancing","type_value":2,"length":5,"discardable":true,"priority":1,"weight":2})");
  EXPECT_EQ(options[2].dump(),
            R"({"type":"ipv6_endpoint","type_value":6,"length":21,"discardable":false,"address":"fe80::1",)"
            R"("transport":"tcp","transport_value":6,"port":30509})");
  EXPECT_EQ(options[3].dump(),
            R"({"type":null,"type_value":119,"length":3,"discardable":false,"body":"00cafe"})");
}

TEST(MessageDecoder, PrintsWhereAMacGroupcastGoes) {
  covers({"feat_req_someipsd_1251", "feat_req_someipsd_1252", "feat_req_someipsd_1253"});
  // Offers of other protocols: a stream of IEEE 1722, one with an identifier that is longer than what we
  // know, and one that is cut off.
  const Printed printed = decode(
      "ffff8100 0000005a 00000001 01010200 c0000000 00000010 01 00 00 30 fffe 0001 01 000003 00000000"
      "00000036"
      "0011 15 00 91e0f0000efe 22f0 0a1b2c3d4e5f0007"
      "0016 15 80 91e0f0000efe 22f0 000102030405060708090a0b0c"
      "0006 15 00 91e0f0000e");
  const Json& options = printed.objects[0]["sd"]["options"];
  ASSERT_THAT(options, SizeIs(3));
  EXPECT_EQ(options[0].dump(), R"({"type":"mac_groupcast","type_value":21,"length":17,"discardable":false,)"
                               R"("address":"91:e0:f0:00:0e:fe","protocol":"0x22f0",)"
                               R"("identifier":"0a1b2c3d4e5f0007"})");
  EXPECT_EQ(options[1].dump(), R"({"type":"mac_groupcast","type_value":21,"length":22,"discardable":true,)"
                               R"("body":"8091e0f0000efe22f0000102030405060708090a0b0c"})");
  EXPECT_EQ(options[2].dump(), R"({"type":"mac_groupcast","type_value":21,"length":6,"discardable":false,)"
                               R"("body":"0091e0f0000e"})");
  EXPECT_EQ(printed.objects[0]["error"]["name"], "bad_option_length");
}

TEST(MessageDecoder, AnswersEveryTruncationOfAMessage) {
  covers({"feat_req_someip_77", "feat_req_someip_798"});
  const auto whole = hex("1234 0421 0000000a 5678 9abc 01 03 80 00 cafe");
  for (std::size_t size = 1; size < whole.size(); ++size) {
    Printed printed;
    MessageDecoder decoder{false, printed.hooks()};
    EXPECT_FALSE(decoder.datagram({}, ByteView{whole}.first(size)));
    ASSERT_THAT(printed.objects, SizeIs(1)) << size;
    EXPECT_EQ(printed.objects[0]["error"]["name"], "truncated") << size;
    EXPECT_EQ(printed.objects[0]["error"]["rule"], size < 16 ? "feat_req_someip_45" : "feat_req_someip_77")
        << size;
    EXPECT_EQ(printed.objects[0]["bytes"], test::to_hex(ByteView{whole}.first(size))) << size;
  }
}

TEST(MessageDecoder, AnswersEveryTruncationOfAnSdMessage) {
  const auto whole = hex(offer);
  for (std::size_t size = 1; size < whole.size(); ++size) {
    Printed printed;
    MessageDecoder decoder{false, printed.hooks()};
    EXPECT_FALSE(decoder.datagram({}, ByteView{whole}.first(size)));
    ASSERT_THAT(printed.objects, SizeIs(1)) << size;
    EXPECT_TRUE(printed.objects[0].contains("error")) << size;
  }
}

TEST(MessageDecoder, AnswersEveryTruncationOfAnSdPayloadWhoseLengthSaysSo) {
  auto whole = hex(offer);
  for (std::size_t size = 16; size < whole.size(); ++size) {
    whole[7] = static_cast<std::byte>(size - 8);
    Printed printed;
    MessageDecoder decoder{false, printed.hooks()};
    EXPECT_FALSE(decoder.datagram({}, ByteView{whole}.first(size)));
    ASSERT_THAT(printed.objects, SizeIs(1)) << size;
    EXPECT_TRUE(printed.objects[0].contains("error")) << size;
    EXPECT_EQ(printed.objects[0]["service"], "0xffff") << size;
  }
}

TEST(MessageDecoder, SaysWhereAnSdMessageIsWrong) {
  covers({"feat_req_someipsd_44", "feat_req_someipsd_102", "feat_req_someipsd_133"});
  const auto summary = [](std::size_t at, const std::string& digits) {
    auto bytes = hex(offer);
    const auto patch = hex(digits);
    std::ranges::copy(patch, bytes.begin() + static_cast<std::ptrdiff_t>(at));
    return decode(test::to_hex(bytes)).summary();
  };
  EXPECT_THAT(summary(14, "00"), ElementsAre("ffff.8100@0!not_sd@0"));  // a request
  EXPECT_THAT(summary(20, "0000000f"), ElementsAre("ffff.8100@0!bad_entries_length@20"));
  EXPECT_THAT(summary(20, "ffffffff"), ElementsAre("ffff.8100@0!bad_entries_length@20"));
  EXPECT_THAT(summary(24, "55"), ElementsAre("ffff.8100@0!bad_entry_type@24"));
  EXPECT_THAT(summary(27, "20"), ElementsAre("ffff.8100@0!bad_option_reference@24"));
  EXPECT_THAT(summary(40, "0000000d"), ElementsAre("ffff.8100@0!bad_options_length@40"));
  EXPECT_THAT(summary(40, "ffffffff"), ElementsAre("ffff.8100@0!bad_options_length@40"));
  EXPECT_THAT(summary(54, "0000"), ElementsAre("ffff.8100@0!bad_value@44"));  // port 0
}

TEST(MessageDecoder, WalksOverAllMessagesOfADatagram) {
  covers({"feat_req_someip_702", "feat_req_someip_319"});
  EXPECT_THAT(decode("1234 8001 00000009 0000 0001 01 01 02 00 aa"
                     "1234 8002 00000008 0000 0001 01 01 02 00"
                     "1234 8003 00000007 0000 0001 01 01 02 00")
                  .summary(),
              ElementsAre("1234.8001@0", "1234.8002@17", "!bad_length@37"));
}

TEST(MessageDecoder, PrintsSegmentsAndWhatIsWrongWithThem) {
  covers({"feat_req_someiptp_766", "feat_req_someiptp_772"});
  const std::string slice = "000102030405060708090a0b0c0d0e0f";
  const Printed good = decode("1234 8001 0000001c 0000 0001 01 01 22 00 00000577" + slice);
  ASSERT_THAT(good.objects, SizeIs(1));
  EXPECT_EQ(good.objects[0]["tp"].dump(), R"({"offset":1392,"more_segments":true,"reserved":3})");
  EXPECT_EQ(good.objects[0]["payload"], slice);
  EXPECT_THAT(decode("1234 8001 0000000d 0000 0001 01 01 22 00 00000001 aa").summary(),
              ElementsAre("1234.8001@0!bad_tp_offset@16"));
  EXPECT_THAT(decode("1234 8001 0000000b 0000 0001 01 01 22 00 000000").summary(),
              ElementsAre("1234.8001@0!truncated@16"));
}

TEST(MessageDecoder, PutsSegmentsTogetherWhenAsked) {
  covers({"feat_req_someiptp_784", "feat_req_someiptp_785"});
  const std::string slice = "000102030405060708090a0b0c0d0e0f";
  const std::string segments = "1234 8001 0000001c 0000 0001 01 01 22 00 00000001" + slice +
                               "1234 8001 0000000e 0000 0001 01 01 22 00 00000010 cafe";
  EXPECT_THAT(decode(segments).objects, SizeIs(2));
  const Printed printed = decode(segments, true);
  ASSERT_THAT(printed.objects, SizeIs(3));
  EXPECT_EQ(printed.objects[2]["reassembled"], true);
  EXPECT_EQ(printed.objects[2]["message_type"], "NOTIFICATION");
  EXPECT_EQ(printed.objects[2]["length"], 8 + 18);
  EXPECT_EQ(printed.objects[2]["payload"], slice + "cafe");
  EXPECT_FALSE(printed.objects[1].contains("reassembled"));
}

TEST(MessageDecoder, SaysWhyASegmentIsNotUsed) {
  const std::string first =
      "1234 8001 0000001c 0000 0001 01 01 22 00 00000001 000102030405060708090a0b0c0d0e0f";
  const Printed printed = decode(first + first, true);
  ASSERT_THAT(printed.objects, SizeIs(2));
  EXPECT_FALSE(printed.objects[0]["tp"].contains("dropped"));
  EXPECT_EQ(printed.objects[1]["tp"]["dropped"], "overlap");
}

TEST(MessageDecoder, KnowsMagicCookies) {
  covers({"feat_req_someip_589", "feat_req_someip_609"});
  const auto cookie = [](const std::string& digits) {
    return decode(digits).objects[0].value("magic_cookie", "none");
  };
  EXPECT_EQ(cookie("ffff 0000 00000008 dead beef 01 01 01 00"), "client");
  EXPECT_EQ(cookie("ffff 8000 00000008 dead beef 01 01 02 00"), "server");
  EXPECT_EQ(cookie("ffff 8000 00000008 dead beef 01 01 01 00"), "none");
  EXPECT_EQ(cookie("ffff 0000 00000008 dead beee 01 01 01 00"), "none");
}

TEST(MessageDecoder, TellsItsCallerWhatSdAnnounces) {
  std::vector<std::string> announced;
  MessageDecoder decoder{false,
                         {[](const Json&) {},
                          [&](Transport transport, const Endpoint& endpoint) {
                            announced.push_back(std::to_string(static_cast<int>(transport)) + ":" +
                                                std::to_string(endpoint.port));
                          }}};
  decoder.datagram({}, hex(offer));
  EXPECT_THAT(announced, ElementsAre("17:30509"));
}

}  // namespace
}  // namespace trestle::inspect::message_decoder_test
