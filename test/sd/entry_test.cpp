#include "sd/wire/entry.hpp"

#include <gtest/gtest.h>

#include <array>

#include "test/bytes.hpp"
#include "test/covers.hpp"

namespace trestle::sd::entry_test {
namespace {
using test::covers;
using test::hex;
using test::to_hex;

Entry entry_from(std::string_view digits) {
  const auto bytes = hex(digits);
  return decode_entry(ByteView{bytes}.first<entry_bytes>());
}

std::string bytes_of(const Entry& entry) {
  std::array<std::byte, entry_bytes> room{};
  encode(entry, room);
  return to_hex(room);
}

TEST(Entry, DecodesEveryFieldOfAServiceEntry) {
  covers({"feat_req_someipsd_47", "feat_req_someipsd_208", "feat_req_someipsd_253", "feat_req_someipsd_336",
          "feat_req_someip_543", "feat_req_someipsd_46"});
  const Entry entry = entry_from("01 07 09 2f 1234 5678 03 00000a 89abcdef");
  EXPECT_EQ(entry.type, EntryType::offer_service);
  EXPECT_EQ(entry.first_run, (OptionRun{7, 2}));
  EXPECT_EQ(entry.second_run, (OptionRun{9, 15}));
  EXPECT_EQ(entry.option_count(), 17U);
  EXPECT_EQ(entry.service, ServiceId{0x1234});
  EXPECT_EQ(entry.instance, InstanceId{0x5678});
  EXPECT_EQ(entry.major, 3);
  EXPECT_EQ(entry.ttl_s, 10U);
  EXPECT_EQ(entry.minor(), 0x89abcdefU);
}

TEST(Entry, DecodesEveryFieldOfAnEventgroupEntry) {
  covers({"feat_req_someipsd_109", "feat_req_someipsd_209", "feat_req_someipsd_322", "feat_req_someip_546",
          "feat_req_someipsd_46", "feat_req_someipsd_237"});
  const Entry entry = entry_from("06 00 00 10 1234 5678 03 ffffff 00 85 4465");
  EXPECT_EQ(entry.type, EntryType::subscribe_eventgroup);
  EXPECT_EQ(entry.first_run, (OptionRun{0, 1}));
  EXPECT_EQ(entry.ttl_s, infinite_ttl_s);
  EXPECT_TRUE(entry.initial_data_requested());
  EXPECT_EQ(entry.counter(), 5);
  EXPECT_EQ(entry.eventgroup(), EventgroupId{0x4465});
  EXPECT_EQ(entry.tail, Entry::eventgroup_tail(EventgroupId{0x4465}, 5, true));
  EXPECT_FALSE(entry_from("06 00 00 10 1234 5678 03 ffffff ff 75 4465").initial_data_requested());
}

TEST(Entry, IsTurnedIntoItsOppositeByATtlOfZero) {
  covers(
      {"feat_req_someipsd_262", "feat_req_someipsd_333", "feat_req_someipsd_619", "feat_req_someipsd_808"});
  EXPECT_EQ(entry_from("00000000 12345678 ff000003 ffffffff").kind(), EntryKind::find_service);
  EXPECT_EQ(entry_from("01000000 12345678 01000003 00000000").kind(), EntryKind::offer_service);
  EXPECT_EQ(entry_from("01000000 12345678 01000000 00000000").kind(), EntryKind::stop_offer_service);
  EXPECT_EQ(entry_from("06000000 12345678 01000003 00000001").kind(), EntryKind::subscribe_eventgroup);
  EXPECT_EQ(entry_from("06000000 12345678 01000000 00000001").kind(), EntryKind::stop_subscribe_eventgroup);
  EXPECT_EQ(entry_from("07000000 12345678 01000003 00000001").kind(), EntryKind::subscribe_eventgroup_ack);
  EXPECT_EQ(entry_from("07000000 12345678 01000000 00000001").kind(), EntryKind::subscribe_eventgroup_nack);
  EXPECT_EQ(entry_from("3f000000 12345678 01000003 00000001").kind(), EntryKind::unknown);
}

TEST(Entry, ComesOutAsItWentIn) {
  for (const char* bytes : {"0107092f123456780300000a89abcdef", "060000101234567803ffffff00854465",
                            "3fffffffffffffffffffffffffffffff", "00000000000000000000000000000000"}) {
    EXPECT_EQ(bytes_of(entry_from(bytes)), bytes);
  }
}

TEST(EntryKind, HasANameThatIsItsOwn) {
  EXPECT_STREQ(to_string(EntryKind::find_service), "find_service");
  EXPECT_STREQ(to_string(EntryKind::offer_service), "offer_service");
  EXPECT_STREQ(to_string(EntryKind::stop_offer_service), "stop_offer_service");
  EXPECT_STREQ(to_string(EntryKind::subscribe_eventgroup), "subscribe_eventgroup");
  EXPECT_STREQ(to_string(EntryKind::stop_subscribe_eventgroup), "stop_subscribe_eventgroup");
  EXPECT_STREQ(to_string(EntryKind::subscribe_eventgroup_ack), "subscribe_eventgroup_ack");
  EXPECT_STREQ(to_string(EntryKind::subscribe_eventgroup_nack), "subscribe_eventgroup_nack");
  EXPECT_STREQ(to_string(EntryKind::unknown), "unknown");
}

}  // namespace
}  // namespace trestle::sd::entry_test
