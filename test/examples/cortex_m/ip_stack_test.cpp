// The network layer of the firmware example. The frames of peers, and what ours must be, were made with
// scapy 2.5.
#include "examples/cortex_m/net/ip_stack.hpp"

#include <gmock/gmock.h>

#include "test/bytes.hpp"

namespace trestle::net {

namespace {

using namespace std::chrono_literals;
using test::hex;
using test::to_hex;

constexpr TimePoint start{1h};
const IpAddress ours = IpAddress::v4(10, 0, 0, 2);
const IpAddress theirs = IpAddress::v4(10, 0, 0, 1);
const IpAddress group = IpAddress::v4(224, 244, 224, 245);

// Ethernet, then IPv4 or ARP.
const std::string to_us = "020000000002 020000000001 ";
const std::string from_us = "020000000001 020000000002 ";
const std::string to_all = "ffffffffffff 020000000001 ";
const std::string arp_request =
    to_all + "0806 0001 0800 0604 0001 020000000001 0a000001 000000000000 0a000002";
const std::string their_arp_reply =
    to_us + "0806 0001 0800 0604 0002 020000000001 0a000001 020000000002 0a000002";
const std::string our_arp_request =
    "ffffffffffff 020000000002 0806 0001 0800 0604 0001 020000000002 0a000002 000000000000 0a000001";
const std::string udp_to_us =
    to_us + "0800 45000021 12340000 4011 5496 0a000001 0a000002 9c40 772d 000d cf5d 0102030405";
const std::string udp_to_group =
    "01005e74e0f5 020000000001 0800 4500001e 00010000 4011 aee3 0a000001 e0f4e0f5 771a 771a 000a 9afe aabb";
const std::string echo_request =
    to_us + "0800 4500001f 00070000 4001 66d5 0a000001 0a000002 0800 338a 0011 0002 616263";
const std::string general_query =
    "01005e000001 020000000001 0800 4500001c 00000000 0102 cfde 0a000001 e0000001 1164 ee9b 00000000";
const std::string query_of_the_group =
    "01005e74e0f5 020000000001 0800 4500001c 00000000 0102 edf5 0a000001 e0f4e0f5 110a 2d0b e0f4e0f5";
const std::string query_of_another_group =
    "01005e010101 020000000001 0800 4500001c 00000000 0102 cedd 0a000001 e0010101 110a 0df3 e0010101";
const std::string their_report =
    "01005e74e0f5 020000000001 0800 4500001c 00000000 0102 edf5 0a000001 e0f4e0f5 1600 2815 e0f4e0f5";

std::string plain(const std::string& digits) {
  return to_hex(hex(digits));
}

/// The report of the group, with that packet id and the header checksum that goes with it.
std::string our_report(const std::string& id, const std::string& header_checksum) {
  return plain("01005e74e0f5 020000000002 0800 46000020" + id + "4000 0102" + header_checksum +
               "0a000002 e0f4e0f5 94040000 1600 2815 e0f4e0f5");
}

class Ip : public testing::Test {
 protected:
  Ip() { EXPECT_FALSE(stack.on_time(room, start).empty()); }  // the announcement

  Arrival takes(const std::string& frame, TimePoint now = start) {
    input = hex(frame);
    return stack.on_frame(input, room, now);
  }
  /// What it sends as answer, in hexadecimal.
  std::string answer(const std::string& frame, TimePoint now = start) {
    const Arrival arrival = takes(frame, now);
    EXPECT_FALSE(arrival.datagram);
    return to_hex(arrival.answer);
  }
  std::string sends(const Endpoint& to, const std::string& payload, TimePoint now = start) {
    return to_hex(stack.send(30509, to, hex(payload), room, now));
  }
  std::string next(TimePoint now) { return to_hex(stack.on_time(room, now)); }
  void is_dropped(const std::string& frame, Drop reason) {
    const std::uint32_t before = stack.dropped(reason);
    const Arrival arrival = takes(frame);
    EXPECT_FALSE(arrival.datagram) << frame;
    EXPECT_EQ(to_hex(arrival.answer), "") << frame;
    EXPECT_EQ(stack.dropped(reason), before + 1) << frame;
  }

  std::array<std::byte, IpStack::max_frame> room{};
  std::vector<std::byte> input;
  IpStack stack{{.mac = {2, 0, 0, 0, 0, 2}, .address = ours, .gateway = {}}, 1};
};

TEST_F(Ip, AnnouncesItsAddressOnce) {
  IpStack fresh{{.mac = {2, 0, 0, 0, 0, 2}, .address = ours, .gateway = {}}, 1};
  EXPECT_TRUE(fresh.deadline());
  EXPECT_EQ(
      to_hex(fresh.on_time(room, start)),
      plain(
          "ffffffffffff 020000000002 0806 0001 0800 0604 0001 020000000002 0a000002 000000000000 0a000002"));
  EXPECT_EQ(to_hex(fresh.on_time(room, start)), "");
  EXPECT_FALSE(fresh.deadline());
}

TEST_F(Ip, AnswersWhoAsksForItsAddress) {
  EXPECT_EQ(answer(arp_request),
            plain(from_us + "0806 0001 0800 0604 0002 020000000002 0a000002 020000000001 0a000001"));
  // Who asks before taking the address has none yet.
  EXPECT_EQ(answer(to_all + "0806 0001 0800 0604 0001 020000000001 00000000 000000000000 0a000002"),
            plain(from_us + "0806 0001 0800 0604 0002 020000000002 0a000002 020000000001 00000000"));
  EXPECT_EQ(answer(to_all + "0806 0001 0800 0604 0001 020000000001 0a000001 000000000000 0a000003"), "");
}

TEST_F(Ip, AnswersPing) {
  EXPECT_EQ(answer(echo_request),
            plain(from_us + "0800 4500001f 00004000 4001 26dc 0a000002 0a000001 0000 3b8a 0011 0002 616263"));
}

TEST_F(Ip, HandsOverADatagram) {
  const Arrival arrival = takes(udp_to_us);
  ASSERT_TRUE(arrival.datagram);
  EXPECT_EQ(arrival.datagram->from, (Endpoint{theirs, 40000}));
  EXPECT_EQ(arrival.datagram->to, (Endpoint{ours, 30509}));
  EXPECT_EQ(to_hex(arrival.datagram->payload), "0102030405");
  EXPECT_EQ(to_hex(arrival.answer), "");
}

TEST_F(Ip, LeavesOutIpOptionsAndTheFillingOfShortFrames) {
  const Arrival arrival = takes(to_us +
                                "0800 46000025 12340000 4011 bf8d 0a000001 0a000002 94040000 9c40 772d 000d "
                                "cf5d 0102030405 000000000000000000");
  ASSERT_TRUE(arrival.datagram);
  EXPECT_EQ(to_hex(arrival.datagram->payload), "0102030405");
}

TEST_F(Ip, TakesADatagramWithoutChecksum) {
  EXPECT_TRUE(
      takes(to_us + "0800 45000021 12340000 4011 5496 0a000001 0a000002 9c40 772d 000d 0000 0102030405")
          .datagram);
}

TEST_F(Ip, SendsToAPeerThatItHasHeardFrom) {
  ASSERT_TRUE(takes(udp_to_us).datagram);
  EXPECT_EQ(
      sends({theirs, 40000}, "0102030405"),
      plain(from_us + "0800 45000021 00004000 4011 26ca 0a000002 0a000001 772d 9c40 000d cf5d 0102030405"));
}

TEST_F(Ip, WritesAChecksumThatWouldBeZeroAsAllOnes) {
  ASSERT_TRUE(takes(udp_to_us).datagram);
  EXPECT_EQ(to_hex(stack.send(1, {theirs, 2}, hex("ebd4"), room, start)),
            plain(from_us + "0800 4500001e 00004000 4011 26cd 0a000002 0a000001 0001 0002 000a ffff ebd4"));
}

TEST_F(Ip, SendsAPayloadThatLiesInTheFrameAlready) {
  ASSERT_TRUE(takes(udp_to_us).datagram);
  const auto payload = hex("0102030405");
  std::ranges::copy(payload, room.begin() + IpStack::headers);
  EXPECT_EQ(
      to_hex(stack.send(30509, {theirs, 40000}, ByteView{room}.subspan(IpStack::headers, 5), room, start)),
      plain(from_us + "0800 45000021 00004000 4011 26ca 0a000002 0a000001 772d 9c40 000d cf5d 0102030405"));
}

TEST_F(Ip, SendsToAGroupWithoutAskingForAMac) {
  EXPECT_EQ(
      to_hex(stack.send(30490, {group, 30490}, hex("aabb"), room, start)),
      plain("01005e74e0f5 020000000002 0800 4500001e 00004000 0111 ade3 0a000002 e0f4e0f5 771a 771a 000a "
            "9afd aabb"));
}

TEST_F(Ip, KeepsTheLastDatagramUntilTheReceiverTellsItsMac) {
  EXPECT_EQ(sends({theirs, 40000}, "ff"), plain(our_arp_request));
  EXPECT_EQ(sends({theirs, 40000}, "0102030405"), plain(our_arp_request));
  EXPECT_EQ(stack.dropped(Drop::displaced), 1U);
  // The second packet has id 1.
  EXPECT_EQ(
      answer(their_arp_reply),
      plain(from_us + "0800 45000021 00014000 4011 26c9 0a000002 0a000001 772d 9c40 000d cf5d 0102030405"));
  EXPECT_EQ(answer(their_arp_reply), "");
  EXPECT_NE(sends({theirs, 40000}, "03"), plain(our_arp_request));
}

TEST_F(Ip, AsksAgainForAMacThatItHasNotHeardOfForAMinute) {
  ASSERT_TRUE(takes(udp_to_us).datagram);
  EXPECT_NE(sends({theirs, 40000}, "01", start + 59s), plain(our_arp_request));
  EXPECT_EQ(sends({theirs, 40000}, "01", start + 60s), plain(our_arp_request));
}

TEST_F(Ip, DoesNotKeepAMacThatNobodyToldUs) {
  // From another to another: learnt only where it corrects what we know.
  const std::string between_others =
      to_all + "0806 0001 0800 0604 0001 020000000009 0a000001 000000000000 0a000003";
  EXPECT_EQ(answer(between_others), "");
  EXPECT_EQ(sends({theirs, 1}, "01"), plain(our_arp_request));
  EXPECT_NE(answer(their_arp_reply), "");
  EXPECT_EQ(answer(between_others), "");
  EXPECT_EQ(sends({theirs, 1}, "01").substr(0, 12), "020000000009");
}

TEST_F(Ip, ForgetsTheNeighbourNotHeardOfForLongest) {
  const auto request_from = [&](int host, TimePoint now) {
    std::string frame = plain(arp_request);
    frame[63] = "0123456789abcdef"[host % 16];  // the last digits of the sender's address 10.0.0.1
    frame[62] = "0123456789abcdef"[host / 16];
    EXPECT_NE(answer(frame, now), "") << host;
  };
  ASSERT_EQ(plain(arp_request).substr(56, 8), "0a000001");
  for (int i = 0; i < static_cast<int>(IpStack::max_neighbours); ++i) {
    request_from(0x10 + i, start + i * 1s);
  }
  request_from(0x10, start + 30s);
  request_from(0x30, start + 31s);  // one too many
  const auto asks_for = [&](std::uint8_t host) {
    return sends({IpAddress::v4(10, 0, 0, host), 1}, "01", start + 31s).substr(24, 4) == "0806";
  };
  EXPECT_FALSE(asks_for(0x10));
  EXPECT_TRUE(asks_for(0x11));
  EXPECT_FALSE(asks_for(0x12));
  EXPECT_FALSE(asks_for(0x30));
}

TEST_F(Ip, ReachesOtherNetworksThroughItsGatewayOnly) {
  const Endpoint far{IpAddress::v4(192, 168, 0, 1), 5};
  EXPECT_EQ(sends(far, "01"), "");
  EXPECT_EQ(stack.dropped(Drop::no_route), 1U);
  stack = IpStack{{.mac = {2, 0, 0, 0, 0, 2}, .address = ours, .gateway = theirs}, 1};
  EXPECT_EQ(sends(far, "01"), plain(our_arp_request));
  const std::string sent = answer(their_arp_reply);
  EXPECT_EQ(sent.substr(0, 12), "020000000001");
  EXPECT_EQ(sent.substr(60, 8), "c0a80001");
}

TEST_F(Ip, DoesNotSendWhatFitsNoFrameOrToNobody) {
  ASSERT_TRUE(takes(udp_to_us).datagram);
  const std::vector<std::byte> payload(IpStack::max_payload + 1);
  EXPECT_EQ(stack.send(1, {theirs, 2}, ByteView{payload}.first(IpStack::max_payload), room, start).size(),
            IpStack::max_frame);
  EXPECT_TRUE(stack.send(1, {theirs, 2}, payload, room, start).empty());
  EXPECT_TRUE(stack.send(1, {theirs, 2}, hex("01"), std::span{room}.first(IpStack::headers), start).empty());
  EXPECT_EQ(stack.dropped(Drop::too_large), 2U);
  for (const IpAddress& nobody : {IpAddress{}, ours, IpAddress::v4(10, 0, 0, 255), IpAddress::v4(10, 0, 0, 0),
                                  IpAddress::v4(255, 255, 255, 255), IpAddress::v4(127, 0, 0, 1)}) {
    EXPECT_EQ(sends({nobody, 1}, "01"), "");
  }
  EXPECT_EQ(stack.dropped(Drop::no_route), 6U);
}

TEST_F(Ip, TakesDatagramsToAGroupOnceItHasJoined) {
  is_dropped(udp_to_group, Drop::not_for_us);
  ASSERT_TRUE(stack.join(group, start));
  const Arrival arrival = takes(udp_to_group);
  ASSERT_TRUE(arrival.datagram);
  EXPECT_EQ(arrival.datagram->to, (Endpoint{group, 30490}));
  EXPECT_EQ(to_hex(arrival.datagram->payload), "aabb");
}

TEST_F(Ip, JoinsAsManyGroupsAsItHasRoomFor) {
  EXPECT_FALSE(stack.join(theirs, start));
  for (std::uint8_t i = 0; i < IpStack::max_groups; ++i) {
    EXPECT_TRUE(stack.join(IpAddress::v4(239, 0, 0, i), start));
    EXPECT_TRUE(stack.join(IpAddress::v4(239, 0, 0, i), start));
  }
  EXPECT_FALSE(stack.join(group, start));
}

TEST_F(Ip, ReportsAGroupAtOnceAndOnceMore) {
  ASSERT_TRUE(stack.join(group, start));
  EXPECT_EQ(stack.deadline(), start);
  EXPECT_EQ(next(start), our_report("0000", "18ec"));
  EXPECT_EQ(next(start), "");
  EXPECT_EQ(stack.deadline(), start + 10s);
  EXPECT_EQ(next(start + 10s - 1ns), "");
  EXPECT_EQ(next(start + 10s), our_report("0001", "18eb"));
  EXPECT_FALSE(stack.deadline());
  EXPECT_EQ(next(start + 1h), "");
}

TEST_F(Ip, AnswersQueriesWithinTheTimeThatTheyGive) {
  ASSERT_TRUE(stack.join(group, start));
  EXPECT_NE(next(start), "");
  EXPECT_NE(next(start + 10s), "");
  for (const auto& [query, longest] : {std::pair{general_query, 10s}, {query_of_the_group, 1s}}) {
    EXPECT_EQ(answer(query, start + 20s), "");
    ASSERT_TRUE(stack.deadline());
    EXPECT_GT(*stack.deadline(), start + 20s);
    EXPECT_LE(*stack.deadline(), start + 20s + longest);
    EXPECT_EQ(next(*stack.deadline() - 1ns), "");
    EXPECT_NE(next(*stack.deadline()), "");
    EXPECT_FALSE(stack.deadline());
  }
  EXPECT_EQ(answer(query_of_another_group, start + 40s), "");
  EXPECT_FALSE(stack.deadline());
}

TEST_F(Ip, AnswersAQueryOfIgmp3FromASwitchWithoutAddress) {
  ASSERT_TRUE(stack.join(group, start));
  EXPECT_NE(next(start), "");
  EXPECT_NE(next(start + 10s), "");
  EXPECT_EQ(answer("01005e000001 020000000001 0800 45c00020 00000000 0102 d91b 00000000 e0000001 1164 ee9b "
                   "00000000 00000000",
                   start + 20s),
            "");
  EXPECT_TRUE(stack.deadline());
}

TEST_F(Ip, LeavesTheReportToAnotherMemberThatWasFirst) {
  ASSERT_TRUE(stack.join(group, start));
  EXPECT_NE(next(start), "");
  EXPECT_EQ(answer(general_query), "");
  EXPECT_EQ(answer(their_report), "");
  EXPECT_FALSE(stack.deadline());
}

TEST_F(Ip, DropsWhatIsCutOffAnywhere) {
  ASSERT_TRUE(stack.join(group, start));
  for (const std::string& frame : {arp_request, udp_to_us, udp_to_group, echo_request, general_query}) {
    const auto whole = hex(frame);
    for (std::size_t size = 0; size < whole.size(); ++size) {
      // Of its own length, so that the sanitizers see a read beyond it.
      const std::vector<std::byte> cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
      const Arrival arrival = stack.on_frame(cut, room, start);
      EXPECT_FALSE(arrival.datagram) << frame << " at " << size;
      EXPECT_TRUE(arrival.answer.empty()) << frame << " at " << size;
    }
  }
}

TEST_F(Ip, NoticesEachBrokenBitByAChecksum) {
  const auto whole = hex(udp_to_us);
  for (std::size_t bit = 14 * 8; bit < whole.size() * 8; ++bit) {
    auto broken = whole;
    broken[bit / 8] ^= std::byte{1} << (bit % 8);
    EXPECT_FALSE(stack.on_frame(broken, room, start).datagram) << "bit " << bit;
  }
}

TEST_F(Ip, DropsWhatIsNotForIt) {
  is_dropped("020000000003 020000000001 0800 45000021", Drop::not_for_us);
  // Its address in a broadcast frame, and another address in its own.
  is_dropped(to_all + udp_to_us.substr(to_us.size()), Drop::not_for_us);
  is_dropped(to_us + "0800 45000021 12340000 4011 5495 0a000001 0a000003 9c40 772d 000d cf5c 0102030405",
             Drop::not_for_us);
  is_dropped(to_us + "86dd 60000000", Drop::other_type);
  is_dropped("020000000002 030000000001 0800 45000021", Drop::bad_source);
}

TEST_F(Ip, DropsSendersThatCannotBe) {
  // 10.0.0.255, 224.0.0.1, 127.0.0.1, itself.
  for (const auto& [source, checksum] : {std::pair{"0a0000ff", "5398"},
                                         {"e0000001", "7e95"},
                                         {"7f000001", "df95"},
                                         {"0a000002", "5495"},
                                         {"00000000", "5e97"}}) {
    is_dropped(
        to_us + "0800 45000021 12340000 4011" + checksum + source + "0a000002 9c40 772d 000d 0000 0102030405",
        Drop::bad_source);
  }
  is_dropped(to_us + "0806 0001 0800 0604 0002 020000000001 0a0000ff 020000000002 0a000002", Drop::bad_arp);
  is_dropped(to_us + "0806 0001 0800 0604 0002 020000000001 0b000001 020000000002 0a000002", Drop::bad_arp);
  is_dropped(to_us + "0806 0001 0800 0604 0002 030000000001 0a000001 020000000002 0a000002", Drop::bad_arp);
  is_dropped(to_us + "0806 0006 0800 0604 0002 020000000001 0a000001 020000000002 0a000002", Drop::bad_arp);
}

TEST_F(Ip, DropsFragments) {
  is_dropped(to_us + "0800 45000021 12342000 4011 3496 0a000001 0a000002 9c40 772d 000d cf5d 0102030405",
             Drop::fragment);
  is_dropped(to_us + "0800 45000021 12340001 4011 5495 0a000001 0a000002 9c40 772d 000d cf5d 0102030405",
             Drop::fragment);
}

TEST_F(Ip, DropsLengthsThatCannotBe) {
  is_dropped(to_us + "0800 44000021 12340000 4011 5596 0a000001 0a000002 9c40 772d 000d cf5d 0102030405",
             Drop::bad_ip_header);
  is_dropped(to_us + "0800 65000021 12340000 4011 3496 0a000001 0a000002 9c40 772d 000d cf5d 0102030405",
             Drop::bad_ip_header);
  is_dropped(to_us + "0800 45000022 12340000 4011 5495 0a000001 0a000002 9c40 772d 000d cf5d 0102030405",
             Drop::bad_ip_header);
  is_dropped(to_us + "0800 45000013 12340000 4011 54a4 0a000001 0a000002 9c40 772d 000d cf5d 0102030405",
             Drop::bad_ip_header);
  is_dropped(to_us + "0800 45000021 12340000 4011 5496 0a000001 0a000002 9c40 772d 0007 cf5d 0102030405",
             Drop::bad_udp_length);
  is_dropped(to_us + "0800 45000021 12340000 4011 5496 0a000001 0a000002 9c40 772d 000e cf5d 0102030405",
             Drop::bad_udp_length);
}

TEST_F(Ip, DropsOtherProtocols) {
  is_dropped(to_us + "0800 45000021 12340000 4006 54a1 0a000001 0a000002 9c40 772d 000d cf5d 0102030405",
             Drop::other_protocol);
  // An echo reply, and an echo request with a wrong checksum.
  is_dropped(to_us + "0800 4500001f 00070000 4001 66d5 0a000001 0a000002 0000 3b8a 0011 0002 616263",
             Drop::other_icmp);
  is_dropped(to_us + "0800 4500001f 00070000 4001 66d5 0a000001 0a000002 0800 338b 0011 0002 616263",
             Drop::bad_checksum);
}

TEST_F(Ip, NeverWritesBeyondTheRoomForAnAnswer) {
  ASSERT_TRUE(stack.join(group, start));
  for (const std::string& frame : {arp_request, echo_request}) {
    const std::size_t needed = hex(answer(frame)).size();
    for (std::size_t size = 0; size < needed; ++size) {
      std::vector<std::byte> small(size);
      EXPECT_TRUE(stack.on_frame(hex(frame), small, start).answer.empty());
    }
  }
  std::vector<std::byte> small(45);
  EXPECT_TRUE(stack.on_time(small, start).empty());
  EXPECT_GE(stack.dropped(Drop::too_large), 80U);
}

}  // namespace
}  // namespace trestle::net
