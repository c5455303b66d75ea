#include "sd/wire/message.hpp"

#include <gmock/gmock.h>

#include <array>
#include <vector>

#include "test/bytes.hpp"
#include "test/covers.hpp"

namespace trestle::sd::message_test {
namespace {
using test::covers;
using test::hex;
using test::to_hex;

// The example PDU of the specification: a Find for service 0x4711 and an Offer of 0x1234.0001 that references
// the second option.
constexpr std::string_view example =
    "ffff8100 0000004c 00000001 01010200"
    "80000000 00000020"
    "00000000 4711ffff ff000e10 ffffffff"
    "01010010 12340001 01000003 00000032"
    "00000018"
    "000924 00 c0a80001 00 11 771a"
    "000904 00 c0a80001 00 11 d903";

std::vector<std::byte> example_payload() {
  auto bytes = hex(example);
  bytes.erase(bytes.begin(), bytes.begin() + 16);
  return bytes;
}

TEST(SdMessage, DecodesTheExampleOfTheSpecification) {
  covers({"feat_req_someipsd_26", "feat_req_someipsd_38", "feat_req_someipsd_39", "feat_req_someipsd_40",
          "feat_req_someipsd_42", "feat_req_someipsd_44", "feat_req_someipsd_101", "feat_req_someipsd_103",
          "feat_req_someipsd_122", "feat_req_someipsd_205", "feat_req_someipsd_239",
          "feat_req_someipsd_342"});
  const auto bytes = hex(example);
  const auto header_and_payload = someip::decode(bytes);
  ASSERT_TRUE(header_and_payload);
  const auto message = decode(*header_and_payload);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->flags(), 0x80);
  EXPECT_TRUE(message->reboot());
  EXPECT_FALSE(message->unicast());
  EXPECT_FALSE(message->explicit_initial_data());
  EXPECT_EQ(message->reserved(), 0U);
  ASSERT_EQ(message->entry_count(), 2U);
  const Entry find = message->entry(0);
  EXPECT_EQ(find.kind(), EntryKind::find_service);
  EXPECT_EQ(find.service, ServiceId{0x4711});
  EXPECT_EQ(find.instance, someip::any_instance);
  EXPECT_EQ(find.major, any_major);
  EXPECT_EQ(find.ttl_s, 3600U);
  EXPECT_EQ(find.minor(), any_minor);
  EXPECT_EQ(find.option_count(), 0U);
  const Entry offer = message->entry(1);
  EXPECT_EQ(offer.kind(), EntryKind::offer_service);
  EXPECT_EQ(offer.minor(), 0x32U);
  ASSERT_EQ(offer.option_count(), 1U);
  const auto option = message->option_of(offer, 0);
  ASSERT_TRUE(option);
  const auto endpoint = EndpointOption::decode(*option);
  ASSERT_TRUE(endpoint);
  EXPECT_EQ(endpoint->endpoint, (Endpoint{IpAddress::v4(192, 168, 0, 1), 0xd903}));
  EXPECT_EQ(find_fault(*message), std::nullopt);
}

TEST(SdMessage, ComesOutAsItWentIn) {
  covers({"feat_req_someipsd_1180"});  // undefined flags are no reason to refuse it
  std::vector<std::vector<std::byte>> payloads{
      example_payload(),
      // No entries, no options.
      hex("c0000000 00000000 00000000"),
      // Every flag and reserved bit set, an unknown entry, trailing bytes, reserved bytes in an option, one
      // of unknown type, one of length 0, a configuration, none of them referenced.
      hex("ffffffff 00000010 3fffffff ffffffff ffffffff ffffffff"
          "00000020 0009 04 ff 0a000001 7f 99 0000 0003 77 80dead 0000 01 0008 01 00 03 613d62 00 00ff"
          "cafe"),
  };
  for (const auto& payload : payloads) {
    const auto message = decode(payload);
    ASSERT_TRUE(message);
    std::vector<std::byte> room(payload.size());
    const auto again = encode(*message, room);
    ASSERT_TRUE(again);
    EXPECT_EQ(to_hex(*again), to_hex(payload));
    EXPECT_EQ(encode(*message, ByteSpan{room}.first(room.size() - 1)).error(), WireError::no_room);
  }
}

TEST(SdMessage, IsRefusedAtEveryTruncation) {
  covers({"feat_req_someipsd_1163", "feat_req_someipsd_1164"});
  const auto payload = example_payload();
  for (std::size_t size = 0; size < payload.size(); ++size) {
    const auto message = decode(ByteView{payload}.first(size));
    ASSERT_FALSE(message) << size;
    // 8 bytes of header and entries length, 32 of entries, then 4 of options length.
    const WireFault expected = size < 4    ? WireFault{WireError::truncated, 0}
                               : size < 8  ? WireFault{WireError::truncated, 4}
                               : size < 40 ? WireFault{WireError::bad_entries_length, 4}
                               : size < 44 ? WireFault{WireError::truncated, 40}
                                           : WireFault{WireError::bad_options_length, 40};
    EXPECT_EQ(message.error(), expected) << size;
  }
}

TEST(SdMessage, IsRefusedWithAWrongEntriesLength) {
  covers({"feat_req_someipsd_44"});
  for (const char* bytes : {"c0000000 0000000f 00000000 00000000 00000000 000000 00000000",
                            "c0000000 00000011 00000000 00000000 00000000 00000000 00 00000000",
                            "c0000000 ffffffff 00000000", "c0000000 fffffff0 00000000"}) {
    const auto payload = hex(bytes);
    const auto message = decode(payload);
    ASSERT_FALSE(message);
    EXPECT_EQ(message.error(), (WireFault{WireError::bad_entries_length, 4})) << bytes;
  }
}

TEST(SdMessage, IsRefusedWithAnOptionsArrayBeyondItsEnd) {
  for (const char* bytes : {"c0000000 00000000 00000001", "c0000000 00000000 ffffffff 000000"}) {
    const auto payload = hex(bytes);
    ASSERT_FALSE(decode(payload));
    EXPECT_EQ(decode(payload).error(), (WireFault{WireError::bad_options_length, 8})) << bytes;
  }
}

TEST(SdMessage, KeepsTheOptionsBeforeABrokenOne) {
  covers({"feat_req_someipsd_1164"});
  // Two entries, with options 0 and 1; the array's second option says it is longer than the array's rest.
  const auto payload =
      hex("c0000000 00000020"
          "06000010 12345678 01000003 00000001"
          "06010010 12345678 01000003 00000002"
          "00000018 000904 00 0a000002 00 11 e7f1 000a04 00 0a000002 00 11 e7f1");
  const auto message = decode(payload);
  ASSERT_TRUE(message);
  EXPECT_TRUE(message->option_of(message->entry(0), 0));
  ASSERT_FALSE(message->option_of(message->entry(1), 0));
  EXPECT_EQ(message->option_of(message->entry(1), 0).error(), WireError::bad_option_reference);
  OptionCursor cursor = message->options();
  EXPECT_TRUE(cursor.next());
  EXPECT_FALSE(cursor.next());
  EXPECT_EQ(cursor.error(), WireError::bad_option_length);
  EXPECT_EQ(cursor.offset(), 56U);
  std::array<std::byte, 100> room{};
  EXPECT_EQ(encode(*message, room).error(), WireError::bad_option_length);
}

TEST(SdMessage, JoinsBothRunsOfAnEntry) {
  covers({"feat_req_someipsd_336", "feat_req_someipsd_342"});
  // Options of unknown types 0xa0 to 0xa3; the entry's runs are {2, 3} and {0}.
  const auto payload =
      hex("c0000000 00000010 01020021 12345678 01000003 00000000"
          "0000000c 0000a0 0000a1 0000a2 0000a3");
  const auto message = decode(payload);
  ASSERT_TRUE(message);
  const Entry entry = message->entry(0);
  ASSERT_EQ(entry.option_count(), 3U);
  EXPECT_EQ(message->option_of(entry, 0)->type, OptionType{0xa2});
  EXPECT_EQ(message->option_of(entry, 1)->type, OptionType{0xa3});
  EXPECT_EQ(message->option_of(entry, 2)->type, OptionType{0xa0});
}

TEST(SdMessage, ReachesTheLastOptionThatAnEntryCanName) {
  // 270 empty options; the run begins at 255 and is 15 long.
  std::string digits = "c0000000 00000010 01ff00f0 12345678 01000003 00000000 0000032a";
  for (int i = 0; i < 270; ++i) {
    digits += i == 269 ? "0000bb" : "0000aa";
  }
  const auto payload = hex(digits);
  const auto message = decode(payload);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->option_of(message->entry(0), 14)->type, OptionType{0xbb});
}

TEST(SdMessage, NamesTheFirstFaultAndItsPlace) {
  const auto fault_of = [](std::string_view digits) {
    const auto payload = hex(digits);
    const auto message = decode(payload);
    EXPECT_TRUE(message) << digits;
    return find_fault(*message);
  };
  EXPECT_EQ(fault_of("c0000000 00000010 3f000000 12345678 01000003 00000000 00000000"),
            (WireFault{WireError::bad_entry_type, 8}));
  EXPECT_EQ(fault_of("c0000000 00000020 00000000 12345678 01000003 00000000"
                     "01000010 12345678 01000003 00000000 00000000"),
            (WireFault{WireError::bad_option_reference, 24}));
  EXPECT_EQ(
      fault_of("c0000000 00000000 00000018 000904 00 0a000001 00 11 e7f1 000904 00 0a000001 00 11 0000"),
      (WireFault{WireError::bad_value, 24}));
  EXPECT_EQ(fault_of("c0000000 00000000 00000004 000204 00"), (WireFault{WireError::bad_option_length, 12}));
  EXPECT_EQ(fault_of("c0000000 00000000 00000000"), std::nullopt);
}

TEST(SdMessage, IsKnownByItsHeader) {
  covers({"feat_req_someipsd_26", "feat_req_someipsd_1220", "feat_req_someipids_530"});
  const someip::Header sd = sd_header(SessionId{7});
  EXPECT_TRUE(is_sd(sd));
  const auto changed = [sd](auto change) {
    someip::Header header = sd;
    change(header);
    return is_sd(header);
  };
  EXPECT_FALSE(changed([](auto& h) { h.service = ServiceId{0xfffe}; }));
  EXPECT_FALSE(changed([](auto& h) { h.method = someip::MethodId{0x8101}; }));
  EXPECT_FALSE(changed([](auto& h) { h.protocol = 2; }));
  EXPECT_FALSE(changed([](auto& h) { h.interface_version = 2; }));
  EXPECT_FALSE(changed([](auto& h) { h.type = someip::MessageType::request; }));
  EXPECT_TRUE(changed([](auto& h) { h.client = someip::ClientId{1}; }));
  const auto payload = hex("c0000000 00000000 00000000");
  EXPECT_EQ(decode(someip::Message{someip::Header{}, payload}).error(), (WireFault{WireError::not_sd, 0}));
}

}  // namespace
}  // namespace trestle::sd::message_test
