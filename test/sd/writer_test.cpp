#include "sd/wire/writer.hpp"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "test/bytes.hpp"
#include "test/covers.hpp"

namespace trestle::sd::writer_test {
namespace {
using test::covers;
using test::hex;
using test::to_hex;

constexpr Endpoint server{IpAddress::v4(10, 0, 0, 1), 30509};

Entry offer(std::uint16_t service) {
  return {.type = EntryType::offer_service,
          .service = ServiceId{service},
          .instance = InstanceId{0x5678},
          .major = 1,
          .ttl_s = 3,
          .tail = 0};
}

std::string plain(std::string_view digits) {
  return to_hex(hex(digits));
}

TEST(SdWriter, WritesTheOfferThatVsomeipSends) {
  covers({"feat_req_someipsd_26", "feat_req_someipsd_100", "feat_req_someipsd_256", "feat_req_someipsd_348"});
  std::array<std::byte, 1400> room{};
  SdWriter writer{room};
  const OwnedOption udp = EndpointOption{EndpointRole::unicast, server, Transport::udp}.encode();
  ASSERT_TRUE(writer.add(offer(0x1234), std::array{udp.view()}));
  // Frame 7 of sd_offer_find_subscribe_ack_udp.pcap.
  EXPECT_EQ(to_hex(writer.finish(reboot_flag | unicast_flag, SessionId{1})),
            plain("ffff8100 00000030 00000001 01010200 c0000000 00000010"
                  "01000010 12345678 01000003 00000000"
                  "0000000c 000904000a0000010011772d"));
}

TEST(SdWriter, WritesAnEmptyMessage) {
  std::array<std::byte, SdWriter::min_room_bytes> room{};
  SdWriter writer{room};
  EXPECT_FALSE(writer.add(offer(1), {}));
  EXPECT_EQ(to_hex(writer.finish(unicast_flag, SessionId{0xffff})),
            plain("ffff8100 00000014 0000ffff 01010200 40000000 00000000 00000000"));
}

TEST(SdWriter, TakesOptionsUpToWhatTheirLengthCanSay) {
  std::vector<std::byte> room(70'000);
  const std::vector<std::byte> body(0x10000);
  SdWriter writer{room};
  EXPECT_FALSE(writer.add(offer(1), std::array{Option{OptionType::configuration, body}}));
  EXPECT_TRUE(
      writer.add(offer(1), std::array{Option{OptionType::configuration, ByteView{body}.first(0xffff)}}));
  EXPECT_EQ(writer.finish(unicast_flag, SessionId{1}).size(), 16U + 8 + 16 + 4 + 3 + 0xffff);
}

// Options without a body, so that only their order is seen.
Option mark(std::uint8_t type) {
  return {OptionType{type}, {}};
}

struct Runs {
  OptionRun first;
  OptionRun second;
  friend bool operator==(const Runs&, const Runs&) = default;
};

Runs runs_of(ByteView datagram, std::size_t index) {
  const auto message = decode(*someip::decode(datagram));
  const Entry entry = message->entry(index);
  return {entry.first_run, entry.second_run};
}

TEST(SdWriter, SharesOptionsInsteadOfRepeatingThem) {
  covers({"feat_req_someipsd_900", "feat_req_someipsd_343"});
  std::array<std::byte, 1400> room{};
  SdWriter writer{room};
  ASSERT_TRUE(writer.add(offer(1), std::array{mark(0xa0), mark(0xa1)}));
  ASSERT_TRUE(writer.add(offer(2), std::array{mark(0xa0), mark(0xa1)}));  // the same
  ASSERT_TRUE(writer.add(offer(3), std::array{mark(0xa1)}));              // a part
  ASSERT_TRUE(writer.add(offer(4), std::array{mark(0xa1), mark(0xa2)}));  // the end goes on
  ASSERT_TRUE(writer.add(offer(5), std::array{mark(0xa2), mark(0xa0)}));  // both there, but apart
  ASSERT_TRUE(writer.add(offer(6), std::array{mark(0xa3), mark(0xa0)}));  // one new, one there
  ASSERT_TRUE(writer.add(offer(7), std::array{mark(0xa0), mark(0xa4)}));  // one there, one new
  ASSERT_TRUE(writer.add(offer(8), {}));
  const ByteView datagram = writer.finish(0, SessionId{1});
  EXPECT_EQ(to_hex(datagram.last(19)), plain("0000000f 0000a0 0000a1 0000a2 0000a3 0000a4"));
  EXPECT_EQ(runs_of(datagram, 0), (Runs{{0, 2}, {}}));
  EXPECT_EQ(runs_of(datagram, 1), (Runs{{0, 2}, {}}));
  EXPECT_EQ(runs_of(datagram, 2), (Runs{{1, 1}, {}}));
  EXPECT_EQ(runs_of(datagram, 3), (Runs{{1, 2}, {}}));
  EXPECT_EQ(runs_of(datagram, 4), (Runs{{2, 1}, {0, 1}}));
  EXPECT_EQ(runs_of(datagram, 5), (Runs{{3, 1}, {0, 1}}));
  EXPECT_EQ(runs_of(datagram, 6), (Runs{{0, 1}, {4, 1}}));
  EXPECT_EQ(runs_of(datagram, 7), (Runs{{}, {}}));
}

TEST(SdWriter, PutsAnUnreferencedOptionFirst) {
  covers({"feat_req_someipsd_1114", "feat_req_someipsd_1151"});
  std::array<std::byte, 1400> room{};
  SdWriter writer{room};
  const OwnedOption sd = EndpointOption{EndpointRole::sd, {IpAddress::v4(192, 168, 0, 1), 30490}}.encode();
  const OwnedOption udp =
      EndpointOption{EndpointRole::unicast, {IpAddress::v4(192, 168, 0, 1), 0xd903}}.encode();
  ASSERT_TRUE(writer.add_unreferenced(sd.view()));
  ASSERT_TRUE(writer.add({.service = ServiceId{0x4711},
                          .instance = someip::any_instance,
                          .major = any_major,
                          .ttl_s = 3600,
                          .tail = any_minor},
                         {}));
  Entry entry = offer(0x1234);
  entry.instance = InstanceId{1};
  entry.tail = 0x32;
  ASSERT_TRUE(writer.add(entry, std::array{udp.view()}));
  // The example of the specification.
  EXPECT_EQ(to_hex(writer.finish(reboot_flag, SessionId{1})),
            plain("ffff8100 0000004c 00000001 01010200 80000000 00000020"
                  "00000000 4711ffff ff000e10 ffffffff 01010010 12340001 01000003 00000032"
                  "00000018 000924 00 c0a80001 00 11 771a 000904 00 c0a80001 00 11 d903"));
}

TEST(SdWriter, PutsAnUnreferencedOptionFirstOnIpv6Too) {
  covers({"feat_req_someipsd_1113", "feat_req_someipsd_1153"});
  constexpr IpAddress address{{0xfd, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1}, true};
  std::array<std::byte, 1400> room{};
  SdWriter writer{room};
  const OwnedOption sd = EndpointOption{EndpointRole::sd, {address, 30490}}.encode();
  const OwnedOption udp = EndpointOption{EndpointRole::unicast, {address, 30509}}.encode();
  ASSERT_TRUE(writer.add_unreferenced(sd.view()));
  ASSERT_TRUE(writer.add(offer(0x1234), std::array{udp.view()}));
  EXPECT_EQ(to_hex(writer.finish(unicast_flag, SessionId{1})),
            plain("ffff8100 00000054 00000001 01010200 40000000 00000010"
                  "01010010 12345678 01000003 00000000 00000030"
                  "001526 00 fd000000000000000000000000000001 00 11 771a"
                  "001506 00 fd000000000000000000000000000001 00 11 772d"));
}

TEST(SdWriter, RefusesWhatDoesNotFitAndStaysAsItWas) {
  // Room for one entry with one IPv4 option, exactly.
  std::array<std::byte, SdWriter::min_room_bytes + 16 + 12> room{};
  const OwnedOption udp = EndpointOption{EndpointRole::unicast, server, Transport::udp}.encode();
  const OwnedOption tcp = EndpointOption{EndpointRole::unicast, server, Transport::tcp}.encode();
  SdWriter writer{room};
  EXPECT_FALSE(writer.add(offer(1), std::array{udp.view(), tcp.view()}));
  EXPECT_TRUE(writer.add(offer(2), std::array{udp.view()}));
  EXPECT_FALSE(writer.add(offer(3), std::array{udp.view()}));
  EXPECT_FALSE(writer.add_unreferenced(mark(0xa0)));
  EXPECT_EQ(writer.entry_count(), 1U);
  EXPECT_EQ(writer.finish(0, SessionId{1}).size(), room.size());
  SdWriter narrow{std::span{room}.first(room.size() - 1)};
  EXPECT_FALSE(narrow.add(offer(2), std::array{udp.view()}));
}

TEST(SdWriter, CutsManyOptionsIntoTwoRuns) {
  std::array<std::byte, 1400> room{};
  SdWriter writer{room};
  std::vector<Option> options;
  for (std::uint8_t type = 0; type < 31; ++type) {
    options.push_back(mark(type));
  }
  EXPECT_FALSE(writer.add(offer(1), options));
  ASSERT_TRUE(writer.add(offer(1), std::span{options}.first(30)));
  EXPECT_EQ(runs_of(writer.finish(0, SessionId{1}), 0), (Runs{{0, 15}, {15, 15}}));
}

TEST(SdWriter, NamesNoOptionBeyondIndex255) {
  std::vector<std::byte> room(6000);
  SdWriter writer{room};
  const std::array<std::byte, 2> bodies{std::byte{0}, std::byte{1}};
  for (unsigned i = 0; i < 256; ++i) {  // 256 different options
    const std::array<std::byte, 1> body{static_cast<std::byte>(i)};
    ASSERT_TRUE(writer.add(offer(1), std::array{Option{OptionType{0xa0}, body}}));
  }
  EXPECT_FALSE(writer.add(offer(2), std::array{Option{OptionType{0xa0}, bodies}}));
  EXPECT_TRUE(writer.add(offer(2), std::array{Option{OptionType{0xa0}, std::span{bodies}.first(1)}}));
  EXPECT_EQ(writer.entry_count(), 257U);
}

}  // namespace
}  // namespace trestle::sd::writer_test
