#include "someip/core/tp_reassembler.hpp"

#include <gmock/gmock.h>

#include <map>
#include <string>

#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/someip/tp_slots.hpp"

namespace trestle::someip::tp_reassembler_test {
namespace {
using namespace std::chrono_literals;
using test::covers;
using test::hex;
using test::to_hex;
using test::TpSlots;
using testing::IsEmpty;
using testing::Pair;
using testing::UnorderedElementsAre;

constexpr TimePoint start{1000s};
constexpr Endpoint lidar{IpAddress::v4(127, 0, 0, 1), 30501};
constexpr TpReassemblyLimits limits{.max_message_bytes = 96, .max_per_sender = 2, .max_age = 500ms};

const auto row_a = hex("a0a1a2a3a4a5a6a7a8a9aaabacadaeaf");
const auto row_b = hex("b0b1b2b3b4b5b6b7b8b9babbbcbdbebf");
const auto row_c = hex("c0c1c2c3c4c5c6c7c8c9cacbcccdcecf");
const auto tail = hex("d0d1d2");

/// A segment of event 0x8001 of service 0x1234, interface version 1.
struct Segment {
  std::uint16_t session;
  std::uint32_t offset;
  bool more;
  ByteView slice;
  std::uint16_t event = 0x8001;
  std::uint16_t client = 0;
  std::uint8_t version = 1;
  ReturnCode code = ReturnCode::ok;
};

class TpReassemblerTest : public testing::Test {
 protected:
  /// "" while others are awaited, "!reason" when dropped, else the payload.
  std::string offer(const Segment& segment, Endpoint from = lidar, TimePoint now = start) {
    std::vector<std::byte> payload(4);
    const std::uint32_t word = segment.offset | (segment.more ? 1U : 0U);
    for (std::size_t i = 0; i < 4; ++i) {
      payload[i] = static_cast<std::byte>(word >> (24 - 8 * i));
    }
    payload.insert(payload.end(), segment.slice.begin(), segment.slice.end());
    const Header header{.service = ServiceId{0x1234},
                        .method = MethodId{segment.event},
                        .client = ClientId{segment.client},
                        .session = SessionId{segment.session},
                        .interface_version = segment.version,
                        .type = MessageType::tp_notification,
                        .return_code = segment.code};
    return offer(Message{header, payload}, from, now);
  }
  std::string offer(const Message& message, Endpoint from, TimePoint now) {
    const auto outcome = reassembler.on_segment(from, message, now);
    if (!outcome) {
      return std::string{"!"} + to_string(outcome.error());
    }
    if (!*outcome) {
      return "";
    }
    last = **outcome;
    return to_hex(last.payload);
  }
  /// The reasons that were counted, and how often.
  [[nodiscard]] std::map<std::string, std::uint64_t> drops() const {
    std::map<std::string, std::uint64_t> result;
    for (std::size_t i = 0; i < tp_drop_count; ++i) {
      const TpDrop reason{static_cast<std::uint8_t>(i)};
      if (reassembler.counters()[reason] != 0) {
        result[to_string(reason)] = reassembler.counters()[reason];
      }
    }
    return result;
  }

  TpSlots memory{3, limits.max_message_bytes};
  TpReassembler reassembler{memory.slots(), limits};
  Reassembled last{};
};

TEST(TpDrop, HasTheNameOfTheEnumerator) {
  EXPECT_STREQ(to_string(TpDrop::malformed), "malformed");
  EXPECT_STREQ(to_string(TpDrop::unaligned), "unaligned");
  EXPECT_STREQ(to_string(TpDrop::session_zero), "session_zero");
  EXPECT_STREQ(to_string(TpDrop::too_large), "too_large");
  EXPECT_STREQ(to_string(TpDrop::too_many_from_sender), "too_many_from_sender");
  EXPECT_STREQ(to_string(TpDrop::no_slot), "no_slot");
  EXPECT_STREQ(to_string(TpDrop::inconsistent_end), "inconsistent_end");
  EXPECT_STREQ(to_string(TpDrop::overlap), "overlap");
  EXPECT_STREQ(to_string(TpDrop::stale), "stale");
  EXPECT_STREQ(to_string(TpDrop::replaced), "replaced");
  EXPECT_STREQ(to_string(TpDrop::aged_out), "aged_out");
  EXPECT_STREQ(to_string(TpDrop::gave_way), "gave_way");
  EXPECT_STREQ(to_string(TpDrop::no_memory), "no_memory");
}

TEST_F(TpReassemblerTest, JoinsSegmentsInAscendingOrder) {
  covers({"feat_req_someiptp_789", "feat_req_someiptp_785", "feat_req_someiptp_783"});
  EXPECT_EQ(offer({7, 0, true, row_a}), "");
  EXPECT_EQ(offer({7, 16, true, row_b}), "");
  EXPECT_EQ(offer({7, 32, false, tail}), to_hex(row_a) + to_hex(row_b) + "d0d1d2");
  EXPECT_EQ(last.header.type, MessageType::notification);
  EXPECT_EQ(last.header.service, ServiceId{0x1234});
  EXPECT_EQ(last.header.method, MethodId{0x8001});
  EXPECT_EQ(last.header.session, SessionId{7});
  EXPECT_EQ(last.from, lidar);
  EXPECT_EQ(reassembler.counters().segments, 3U);
  EXPECT_EQ(reassembler.counters().messages, 1U);
  EXPECT_THAT(drops(), IsEmpty());
}

TEST_F(TpReassemblerTest, JoinsSegmentsInDescendingOrder) {
  covers({"feat_req_someiptp_820"});
  EXPECT_EQ(offer({7, 48, false, tail}), "");
  EXPECT_EQ(offer({7, 32, true, row_c}), "");
  EXPECT_EQ(offer({7, 16, true, row_b}), "");
  EXPECT_EQ(offer({7, 0, true, row_a}), to_hex(row_a) + to_hex(row_b) + to_hex(row_c) + "d0d1d2");
}

TEST_F(TpReassemblerTest, JoinsSegmentsThreePlacesOutOfOrder) {
  covers({"feat_req_someiptp_790"});
  EXPECT_EQ(offer({7, 16, true, row_b}), "");
  EXPECT_EQ(offer({7, 32, true, row_c}), "");
  EXPECT_EQ(offer({7, 48, false, tail}), "");
  EXPECT_EQ(offer({7, 0, true, row_a}), to_hex(row_a) + to_hex(row_b) + to_hex(row_c) + "d0d1d2");
}

TEST_F(TpReassemblerTest, TakesASingleSegmentAsAMessage) {
  EXPECT_EQ(offer({7, 0, false, tail}), "d0d1d2");
  EXPECT_EQ(offer({8, 0, false, {}}), "");
  EXPECT_EQ(reassembler.counters().messages, 2U);
  EXPECT_EQ(last.header.session, SessionId{8});
}

TEST_F(TpReassemblerTest, TakesAnEmptyLastSegment) {
  EXPECT_EQ(offer({7, 16, false, {}}), "");
  EXPECT_EQ(offer({7, 0, true, row_a}), to_hex(row_a));
}

TEST_F(TpReassemblerTest, ReportsTheReturnCodeOfTheSegmentThatCameLast) {
  covers({"feat_req_someiptp_784"});
  offer({.session = 7, .offset = 16, .more = false, .slice = tail, .code = ReturnCode::not_ok});
  offer({.session = 7, .offset = 0, .more = true, .slice = row_a, .code = ReturnCode::not_ready});
  EXPECT_EQ(last.header.return_code, ReturnCode::not_ready);
}

TEST_F(TpReassemblerTest, KeepsTheBytesReceivedFirstWhereSegmentsOverlap) {
  covers({"feat_req_someiptp_797", "feat_req_someiptp_810"});
  auto two_rows = row_c;
  two_rows.insert(two_rows.end(), row_c.begin(), row_c.end());
  EXPECT_EQ(offer({7, 0, true, row_a}), "");
  EXPECT_EQ(offer({7, 0, true, two_rows}), "");
  EXPECT_EQ(offer({7, 32, false, tail}), to_hex(row_a) + to_hex(row_c) + "d0d1d2");
  EXPECT_THAT(drops(), UnorderedElementsAre(Pair("overlap", 1)));
}

TEST_F(TpReassemblerTest, FillsSeveralGapsFromOneOverlappingSegment) {
  auto four_rows = row_c;
  for (int i = 0; i < 3; ++i) {
    four_rows.insert(four_rows.end(), row_c.begin(), row_c.end());
  }
  EXPECT_EQ(offer({7, 16, true, row_a}), "");
  EXPECT_EQ(offer({7, 48, true, row_b}), "");
  EXPECT_EQ(offer({7, 64, false, tail}), "");
  EXPECT_EQ(offer({7, 0, true, four_rows}),
            to_hex(row_c) + to_hex(row_a) + to_hex(row_c) + to_hex(row_b) + "d0d1d2");
}

TEST_F(TpReassemblerTest, DropsDuplicatesAlsoOfACompletedMessage) {
  covers({"feat_req_someiptp_797"});
  EXPECT_EQ(offer({7, 0, true, row_a}), "");
  EXPECT_EQ(offer({7, 0, true, row_b}), "!overlap");
  EXPECT_EQ(offer({7, 16, false, tail}), to_hex(row_a) + "d0d1d2");
  EXPECT_EQ(offer({7, 16, false, tail}), "!stale");
  EXPECT_EQ(offer({7, 0, true, row_a}), "!stale");
  EXPECT_EQ(reassembler.size(), 0U);
  EXPECT_EQ(reassembler.counters().messages, 1U);
}

TEST_F(TpReassemblerTest, BeginsAnewWithAnotherSession) {
  covers({"feat_req_someiptp_793", "feat_req_someiptp_795"});
  EXPECT_EQ(offer({7, 0, true, row_a}), "");
  EXPECT_EQ(offer({8, 0, true, row_b}), "");
  EXPECT_EQ(offer({8, 16, false, tail}), to_hex(row_b) + "d0d1d2");
  EXPECT_THAT(drops(), UnorderedElementsAre(Pair("replaced", 1)));
}

TEST_F(TpReassemblerTest, IsNotThrownBackByAStragglerOfThePreviousSession) {
  covers({"feat_req_someiptp_802", "feat_req_someiptp_783"});
  EXPECT_EQ(offer({7, 0, true, row_a}), "");
  EXPECT_EQ(offer({8, 0, true, row_b}), "");
  EXPECT_EQ(offer({7, 16, false, tail}), "!stale");
  EXPECT_EQ(offer({8, 16, false, tail}), to_hex(row_b) + "d0d1d2");
}

TEST_F(TpReassemblerTest, ForgetsSessionsSoThatARestartedSenderIsHeard) {
  EXPECT_EQ(offer({1, 0, false, tail}), "d0d1d2");
  EXPECT_EQ(offer({1, 0, false, tail}, lidar, start + 499ms), "!stale");
  EXPECT_EQ(offer({1, 0, false, tail}, lidar, start + 500ms), "d0d1d2");
}

TEST_F(TpReassemblerTest, KeepsMessagesApartThatDifferInAnythingButTheSession) {
  covers(
      {"feat_req_someiptp_781", "feat_req_someiptp_787", "feat_req_someiptp_794", "feat_req_someiptp_803"});
  TpSlots room{7, limits.max_message_bytes};
  reassembler = TpReassembler{room.slots(), {.max_message_bytes = 96, .max_per_sender = 9, .max_age = 1s}};
  const Endpoint other_port{lidar.address, 30502};
  const Endpoint other_address{IpAddress::v4(127, 0, 0, 2), 30501};
  const Segment plain{7, 0, true, row_a};
  const Segment other_event{.session = 7, .offset = 0, .more = true, .slice = row_a, .event = 0x8002};
  const Segment other_client{.session = 7, .offset = 0, .more = true, .slice = row_a, .client = 1};
  const Segment other_version{.session = 7, .offset = 0, .more = true, .slice = row_a, .version = 2};
  EXPECT_EQ(offer(plain), "");
  EXPECT_EQ(offer(plain, other_port), "");
  EXPECT_EQ(offer(plain, other_address), "");
  EXPECT_EQ(offer(other_event), "");
  EXPECT_EQ(offer(other_client), "");
  EXPECT_EQ(offer(other_version), "");
  Header response{.service = ServiceId{0x1234},
                  .method = MethodId{0x8001},
                  .session = SessionId{7},
                  .interface_version = 1,
                  .type = MessageType::tp_response};
  const auto first_row = hex("00000001 a0a1a2a3a4a5a6a7a8a9aaabacadaeaf");
  EXPECT_EQ(offer(Message{response, first_row}, lidar, start), "");
  EXPECT_EQ(reassembler.size(), 7U);
  EXPECT_THAT(drops(), IsEmpty());
  EXPECT_EQ(offer({7, 16, false, tail}, other_port), to_hex(row_a) + "d0d1d2");
  EXPECT_EQ(last.from, other_port);
  EXPECT_EQ(reassembler.size(), 6U);
}

TEST_F(TpReassemblerTest, SkipsTheRestOfAMessageThatIsTooLarge) {
  covers({"feat_req_someiptp_782", "feat_req_someiptp_783"});
  EXPECT_EQ(offer({7, 0, true, row_a}), "");
  EXPECT_EQ(offer({7, 96, true, row_b}), "!too_large");
  EXPECT_EQ(offer({7, 16, true, row_b}), "!stale");
  EXPECT_EQ(offer({7, 0xfffffff0, false, row_b}), "!stale");
  EXPECT_EQ(reassembler.size(), 0U);
  EXPECT_EQ(offer({8, 80, false, row_c}), "") << "exactly as large as allowed";
  EXPECT_EQ(offer({9, 96, false, hex("00")}), "!too_large");
  EXPECT_THAT(drops(), UnorderedElementsAre(Pair("too_large", 2), Pair("stale", 2), Pair("replaced", 1)));
}

TEST_F(TpReassemblerTest, TakesNoSlotForAMessageThatIsTooLargeFromTheStart) {
  EXPECT_EQ(offer({7, 0xfffffff0, true, row_a}), "!too_large");
  EXPECT_EQ(reassembler.size(), 0U);
}

TEST_F(TpReassemblerTest, JoinsAsManySegmentsOutOfOrderAsThereAre) {
  covers({"feat_req_someiptp_790", "feat_req_someiptp_820"});
  constexpr std::size_t bytes = 1U << 20U;
  constexpr std::size_t slice = 1392;
  TpSlots room{1, bytes};
  reassembler = TpReassembler{room.slots(), {.max_message_bytes = bytes, .max_per_sender = 1, .max_age = 1s}};
  std::vector<std::byte> sent(bytes);
  for (std::size_t i = 0; i < bytes; ++i) {
    sent[i] = static_cast<std::byte>(i * 7 + i / 251);
  }
  const auto offer_slice = [&](std::size_t offset) {
    const std::size_t size = std::min(slice, bytes - offset);
    return offer(
        {7, static_cast<std::uint32_t>(offset), offset + size < bytes, ByteView{sent}.subspan(offset, size)});
  };
  // All the odd ones, which leaves 377 gaps, then the even ones from behind.
  for (std::size_t offset = slice; offset < bytes; offset += 2 * slice) {
    ASSERT_EQ(offer_slice(offset), "");
  }
  std::size_t offset = (bytes - 1) / slice / 2 * 2 * slice;
  for (; offset > 0; offset -= 2 * slice) {
    ASSERT_EQ(offer_slice(offset), "");
  }
  EXPECT_FALSE(offer_slice(0).empty());
  EXPECT_TRUE(std::ranges::equal(last.payload, sent));
  EXPECT_THAT(drops(), IsEmpty());
}

TEST_F(TpReassemblerTest, GivesUpAMessageThatContradictsItsEnd) {
  covers({"feat_req_someiptp_792", "feat_req_someiptp_783"});
  EXPECT_EQ(offer({1, 32, false, tail}), "");
  EXPECT_EQ(offer({1, 16, false, tail}), "!inconsistent_end") << "an earlier end";
  EXPECT_EQ(offer({2, 16, false, tail}), "");
  EXPECT_EQ(offer({2, 32, false, tail}), "!inconsistent_end") << "a later end";
  EXPECT_EQ(offer({3, 16, false, tail}), "");
  EXPECT_EQ(offer({3, 16, true, row_b}), "!inconsistent_end") << "more bytes behind the end";
  EXPECT_EQ(offer({4, 32, true, row_c}), "");
  EXPECT_EQ(offer({4, 16, false, tail}), "!inconsistent_end") << "an end before received bytes";
  EXPECT_EQ(reassembler.size(), 0U);
  EXPECT_EQ(reassembler.counters().messages, 0U);
}

TEST_F(TpReassemblerTest, GivesUpAMessageWithAnUnalignedSegment) {
  covers({"feat_req_someiptp_792", "feat_req_someiptp_772"});
  EXPECT_EQ(offer({7, 0, true, row_a}), "");
  EXPECT_EQ(offer({7, 16, true, tail}), "!unaligned");
  EXPECT_EQ(offer({7, 16, false, tail}), "!stale");
  EXPECT_EQ(offer({8, 0, true, tail}), "!unaligned");
  EXPECT_EQ(reassembler.size(), 0U);
}

TEST_F(TpReassemblerTest, DropsWhatIsNoSegment) {
  const Header segment{.session = SessionId{7}, .type = MessageType::tp_notification};
  const Header plain{.session = SessionId{7}, .type = MessageType::notification};
  const auto payload = hex("00000000 aa");
  EXPECT_EQ(offer(Message{plain, payload}, lidar, start), "!malformed");
  EXPECT_EQ(offer(Message{segment, {}}, lidar, start), "!malformed");
  EXPECT_EQ(offer(Message{segment, ByteView{payload}.first(3)}, lidar, start), "!malformed");
  EXPECT_EQ(offer({7, 0, true, {}}), "!malformed") << "not the last, yet empty";
  EXPECT_EQ(reassembler.size(), 0U);
  EXPECT_EQ(offer(Message{segment, ByteView{payload}.first(4)}, lidar, start), "")
      << "a whole, empty message";
  EXPECT_EQ(reassembler.counters().messages, 1U);
}

TEST_F(TpReassemblerTest, RefusesSessionZero) {
  covers({"feat_req_someiptp_762"});
  EXPECT_EQ(offer({0, 0, true, row_a}), "!session_zero");
  EXPECT_EQ(reassembler.size(), 0U);
}

TEST_F(TpReassemblerTest, LetsOneSenderTakeOnlyItsShare) {
  const Endpoint same_host{lidar.address, 1};
  EXPECT_EQ(offer({.session = 7, .offset = 0, .more = true, .slice = row_a, .event = 0x8001}), "");
  EXPECT_EQ(offer({.session = 7, .offset = 0, .more = true, .slice = row_a, .event = 0x8002}), "");
  EXPECT_EQ(offer({.session = 7, .offset = 0, .more = true, .slice = row_a, .event = 0x8003}),
            "!too_many_from_sender");
  EXPECT_EQ(offer({7, 0, true, row_a}, same_host), "!too_many_from_sender");
  EXPECT_EQ(offer({8, 0, true, row_b}), "") << "takes the place of session 7";
  EXPECT_EQ(offer({8, 16, false, tail}), to_hex(row_b) + "d0d1d2");
  EXPECT_EQ(offer({7, 0, true, row_a}, same_host), "") << "there is room again";
}

TEST_F(TpReassemblerTest, DoesNotExceedTheShareByReusingFinishedSlots) {
  for (const std::uint16_t event : std::initializer_list<std::uint16_t>{0x8001, 0x8002, 0x8003}) {
    EXPECT_EQ(offer({.session = 7, .offset = 0, .more = false, .slice = tail, .event = event}), "d0d1d2");
  }
  EXPECT_EQ(offer({.session = 8, .offset = 0, .more = true, .slice = row_a, .event = 0x8001}), "");
  EXPECT_EQ(offer({.session = 8, .offset = 0, .more = true, .slice = row_a, .event = 0x8002}), "");
  EXPECT_EQ(offer({.session = 8, .offset = 0, .more = true, .slice = row_a, .event = 0x8003}),
            "!too_many_from_sender");
}

TEST_F(TpReassemblerTest, RefusesTheNewestWhenAllSlotsAreTaken) {
  const auto host = [](std::uint8_t last_byte) {
    return Endpoint{IpAddress::v4(10, 0, 0, last_byte), 30501};
  };
  EXPECT_EQ(offer({7, 0, true, row_a}, host(1)), "");
  EXPECT_EQ(offer({7, 0, true, row_a}, host(2)), "");
  EXPECT_EQ(offer({7, 0, true, row_a}, host(3)), "");
  EXPECT_EQ(offer({7, 0, true, row_a}, host(4)), "!no_slot");
  EXPECT_EQ(offer({7, 16, false, tail}, host(1)), to_hex(row_a) + "d0d1d2");
  EXPECT_EQ(offer({7, 0, true, row_a}, host(4)), "");
}

Endpoint host(std::size_t number) {
  return {IpAddress::v4(10, 0, static_cast<std::uint8_t>(number >> 8U), static_cast<std::uint8_t>(number)),
          30501};
}

// 16 bytes in 600 us are 27 kB a second: slow, but not as good as stopped, which is 1/64 of 1 MB a second.
TEST_F(TpReassemblerTest, LetsTheSlowestGiveWayToAMessageThatBegins) {
  EXPECT_EQ(offer({7, 0, true, row_a}, host(1)), "");
  EXPECT_EQ(offer({7, 0, true, row_a}, host(2)), "");
  EXPECT_EQ(offer({7, 0, true, row_a}, host(3)), "");
  EXPECT_EQ(offer({7, 16, true, row_b}, host(1), start + 500us), "");
  EXPECT_EQ(offer({7, 16, true, row_b}, host(3), start + 500us), "");
  EXPECT_EQ(offer({7, 0, true, row_a}, host(4), start + 500us), "");
  EXPECT_THAT(drops(), UnorderedElementsAre(Pair("gave_way", 1)));
  // The rest of what gave way drives out nobody.
  EXPECT_EQ(offer({7, 16, false, tail}, host(2), start + 600us), "!no_slot");
  EXPECT_EQ(offer({7, 16, false, tail}, host(4), start + 600us), to_hex(row_a) + "d0d1d2");
  EXPECT_EQ(offer({7, 32, false, tail}, host(1), start + 600us), to_hex(row_a) + to_hex(row_b) + "d0d1d2");
  EXPECT_EQ(offer({7, 32, false, tail}, host(3), start + 600us), to_hex(row_a) + to_hex(row_b) + "d0d1d2");
}

TEST_F(TpReassemblerTest, LetsNoMessageGiveWayThatComesFast) {
  TpSlots room{1, limits.max_message_bytes};
  reassembler = TpReassembler{
      room.slots(),
      {.max_message_bytes = 96, .max_per_sender = 1, .max_age = 1s, .protected_bytes_per_s = 16'000}};
  EXPECT_EQ(offer({7, 0, true, row_a}, host(1)), "");
  EXPECT_EQ(offer({7, 0, true, row_a}, host(2), start + 990us), "!no_slot") << "more than 16 kB a second";
  EXPECT_EQ(offer({7, 0, true, row_a}, host(2), start + 1010us), "") << "less";
  EXPECT_EQ(offer({7, 16, true, row_b}, host(2), start + 1500us), "");
  EXPECT_EQ(offer({7, 0, true, row_a}, host(3), start + 2900us), "!no_slot");
  EXPECT_EQ(offer({7, 32, false, tail}, host(2), start + 3s), "!stale") << "aged out";
}

TEST_F(TpReassemblerTest, LetsTheSlowestOfASenderThatHasItsShareGiveWay) {
  const Segment other{.session = 7, .offset = 0, .more = true, .slice = row_a, .event = 0x8002};
  const Segment third{.session = 7, .offset = 0, .more = true, .slice = row_a, .event = 0x8003};
  EXPECT_EQ(offer({7, 0, true, row_a}, host(9)), "") << "slower than all, but somebody else's";
  EXPECT_EQ(offer({7, 0, true, row_a}, lidar, start + 100us), "");
  EXPECT_EQ(offer(other, lidar, start + 200us), "");
  EXPECT_EQ(offer({7, 16, true, row_b}, lidar, start + 200us), "");
  EXPECT_EQ(offer(third, lidar, start + 900us), "");
  EXPECT_THAT(drops(), UnorderedElementsAre(Pair("gave_way", 1)));
  EXPECT_EQ(offer({.session = 7, .offset = 16, .more = false, .slice = tail, .event = 0x8002}, lidar,
                  start + 900us),
            "!too_many_from_sender");
  EXPECT_EQ(offer({7, 32, false, tail}, lidar, start + 900us), to_hex(row_a) + to_hex(row_b) + "d0d1d2");
  EXPECT_EQ(offer({7, 16, false, tail}, host(9), start + 900us), to_hex(row_a) + "d0d1d2");
}

TEST_F(TpReassemblerTest, GivesThePlaceOfWhatHasStoppedAlsoToASegmentInTheMiddle) {
  for (std::size_t i = 1; i <= 3; ++i) {
    EXPECT_EQ(offer({7, 0, true, row_a}, host(i)), "");
  }
  // 16 bytes are a 64th of 1 MB a second after 1.024 ms.
  EXPECT_EQ(offer({7, 16, true, row_b}, host(4), start + 1000us), "!no_slot");
  EXPECT_EQ(offer({7, 16, true, row_b}, host(4), start + 1100us), "");
  EXPECT_EQ(offer({7, 0, true, row_a}, host(4), start + 1100us), "");
  EXPECT_EQ(offer({7, 32, false, tail}, host(4), start + 1100us), to_hex(row_a) + to_hex(row_b) + "d0d1d2");
}

// 20,000 half messages a second, each in another's name: neither what is under way is lost, nor does a new
// one find no place.
TEST_F(TpReassemblerTest, BringsHonestMessagesThroughAFloodOfHalfOnes) {
  constexpr std::size_t slice = 1392;
  constexpr std::size_t bytes = 100 * slice;
  TpSlots room{32, bytes};
  reassembler = TpReassembler{room.slots(), {.max_message_bytes = bytes, .max_per_sender = 4, .max_age = 5s}};
  const std::vector<std::byte> sent(bytes);
  TimePoint now = start;
  std::size_t attacker = 1;
  const auto flood = [&] {  // for as long as a segment of the honest ones takes, at 3.5 MB a second
    for (int i = 0; i < 8; ++i) {
      now += 50us;
      ASSERT_EQ(offer({7, 0, true, ByteView{sent}.first(slice)}, host(attacker++), now), "");
    }
  };
  flood();
  for (std::uint16_t session = 1; session <= 20; ++session) {
    for (std::size_t offset = 0; offset < bytes; offset += slice) {
      const bool more = offset + slice < bytes;
      const auto outcome =
          offer({session, static_cast<std::uint32_t>(offset), more, ByteView{sent}.subspan(offset, slice)},
                lidar, now);
      ASSERT_EQ(outcome.empty(), more) << "session " << session << ", offset " << offset << ": " << outcome;
      flood();
    }
  }
  EXPECT_EQ(reassembler.counters().messages, 20U);
}

TEST_F(TpReassemblerTest, TellsOfEachSlotOnceThatItsMemoryIsNotNeededAnyMore) {
  EXPECT_EQ(reassembler.forget(start), std::nullopt) << "none was written";
  EXPECT_EQ(reassembler.forget_deadline(), std::nullopt);
  EXPECT_EQ(offer({7, 0, false, tail}), "d0d1d2");
  EXPECT_EQ(
      offer({.session = 7, .offset = 0, .more = true, .slice = row_a, .event = 0x8002}, lidar, start + 100ms),
      "");
  EXPECT_TRUE(reassembler.used(0));
  EXPECT_TRUE(reassembler.used(1));
  EXPECT_FALSE(reassembler.used(2));
  EXPECT_EQ(reassembler.forget_deadline(), start + 500ms);
  EXPECT_EQ(reassembler.forget(start + 500ms - 1ns), std::nullopt);
  EXPECT_EQ(reassembler.forget(start + 500ms), std::optional<std::size_t>{0});
  EXPECT_EQ(reassembler.forget(start + 500ms), std::nullopt);
  EXPECT_FALSE(reassembler.used(0));
  reassembler.on_time(start + 600ms);
  EXPECT_EQ(reassembler.forget_deadline(), start + 1100ms) << "a lost message is remembered, too";
  EXPECT_EQ(reassembler.forget(start + 1100ms), std::optional<std::size_t>{1});
  EXPECT_EQ(reassembler.forget_deadline(), std::nullopt);
}

TEST_F(TpReassemblerTest, GoesOnWithOtherSlots) {
  const auto all = memory.slots();
  reassembler = TpReassembler{all.first(0), limits};
  EXPECT_EQ(offer({7, 0, true, row_a}), "!no_slot");
  reassembler.use(all.first(1));
  EXPECT_EQ(offer({7, 0, true, row_a}), "");
  reassembler.use(all.first(2));
  EXPECT_EQ(offer({7, 0, true, row_c}, host(1)), "");
  EXPECT_EQ(offer({7, 16, false, tail}), to_hex(row_a) + "d0d1d2");
  EXPECT_EQ(offer({7, 16, false, tail}, host(1)), to_hex(row_c) + "d0d1d2");
  reassembler.use(all.first(1));
  EXPECT_EQ(offer({7, 16, false, tail}), "!stale");
}

TEST_F(TpReassemblerTest, GivesUpAMessageThatIsTooOld) {
  EXPECT_EQ(reassembler.deadline(), std::nullopt);
  EXPECT_EQ(offer({7, 0, true, row_a}), "");
  EXPECT_EQ(
      offer({.session = 7, .offset = 0, .more = true, .slice = row_a, .event = 0x8002}, lidar, start + 100ms),
      "");
  EXPECT_EQ(reassembler.deadline(), start + 500ms);
  // More segments do not make it younger: a slow sender holds a slot for max_age at the most.
  EXPECT_EQ(offer({7, 16, true, row_b}, lidar, start + 400ms), "");
  reassembler.on_time(start + 500ms - 1ns);
  EXPECT_EQ(reassembler.size(), 2U);
  reassembler.on_time(start + 500ms);
  EXPECT_EQ(reassembler.size(), 1U);
  EXPECT_EQ(reassembler.deadline(), start + 600ms);
  EXPECT_EQ(offer({7, 32, false, tail}, lidar, start + 501ms), "!stale");
  reassembler.on_time(start + 600ms);
  EXPECT_EQ(reassembler.deadline(), std::nullopt);
  EXPECT_THAT(drops(), UnorderedElementsAre(Pair("aged_out", 2), Pair("stale", 1)));
}

TEST_F(TpReassemblerTest, DoesNotCompleteAMessageThatIsTooOldEvenIfTheTimerIsLate) {
  EXPECT_EQ(offer({7, 0, true, row_a}), "");
  EXPECT_EQ(offer({7, 16, false, tail}, lidar, start + 500ms), "!stale");
  EXPECT_THAT(drops(), UnorderedElementsAre(Pair("aged_out", 1), Pair("stale", 1)));
}

}  // namespace
}  // namespace trestle::someip::tp_reassembler_test
