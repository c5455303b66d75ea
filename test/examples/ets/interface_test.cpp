// The methods of the Enhanced Testability Service, as bytes. `trestle conform` has a case for each over the
// network; here they run on each target, also on the big-endian one.
#include "examples/ets/interface.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <string>
#include <vector>

#include "test/bytes.hpp"

namespace ets {
namespace {

using trestle::test::hex;
using trestle::test::to_hex;

/// The answer to a request in hexadecimal, or the error.
std::string answer_to(unsigned method, const std::string& payload, std::size_t room_bytes = 256,
                      std::size_t text_bytes = 256) {
  std::vector<std::byte> room(room_bytes);
  std::vector<char> text(text_bytes);
  const auto request = hex(payload);
  const auto answer =
      echo(MethodId{static_cast<std::uint16_t>(method)}, request, {.answer = room, .text = text});
  return answer ? to_hex(*answer) : "error " + std::to_string(static_cast<int>(answer.error()));
}
const std::string not_ok = "error 1";
const std::string unknown = "error 3";
const std::string malformed = "error 9";

TEST(TestabilityEcho, GivesNumbersBack) {
  EXPECT_EQ(answer_to(0x08, "2a"), "2a");
  EXPECT_EQ(answer_to(0x0e, "d6"), "d6");
  EXPECT_EQ(answer_to(0x12, "400921fb54442d18"), "400921fb54442d18");
  EXPECT_EQ(answer_to(0x08, "2aff"), "2a");  // what a newer client may have added
  EXPECT_EQ(answer_to(0x08, ""), malformed);
  EXPECT_EQ(answer_to(0x12, "400921fb54442d"), malformed);
}

TEST(TestabilityEcho, CalculatesWithNumbers) {
  EXPECT_EQ(answer_to(0x1f, "ff ffff"), "000100fe");
  EXPECT_EQ(answer_to(0x41, "01 0003 00000007"), "80c000e0000000");
  // bool, uint8, uint16, uint32, int8, int16, int32, float32, float64, and back.
  EXPECT_EQ(answer_to(0x23, "ff 02 0003 00000004 fb fffa fffffff9 40200000 4004000000000000"),
            "400400000000000040200000fffffff9fffafb0000000400030201");
}

TEST(TestabilityEcho, GivesArraysBack) {
  EXPECT_EQ(answer_to(0x09, "00000003 010203"), "00000003010203");
  EXPECT_EQ(answer_to(0x09, "00000009 010203"), malformed);
  EXPECT_EQ(answer_to(0x35, "0000000c 00000002 0102 00000002 0304"), "0000000c000000020102000000020304");
  EXPECT_EQ(answer_to(0x36, "0908070605"), "0908070605");
  EXPECT_EQ(answer_to(0x36, "09080706"), malformed);
  EXPECT_EQ(answer_to(0x3e, "03 070809"), "03070809");
  EXPECT_EQ(answer_to(0x3f, "0003 070809"), "0003070809");
}

TEST(TestabilityEcho, WantsThreeToFiveElements) {
  EXPECT_EQ(answer_to(0x37, "00000002 0102"), malformed);
  EXPECT_EQ(answer_to(0x37, "00000003 010203"), "00000003010203");
  EXPECT_EQ(answer_to(0x37, "00000005 0102030405"), "000000050102030405");
  EXPECT_EQ(answer_to(0x37, "00000006 010203040506"), malformed);
}

TEST(TestabilityEcho, GivesUnionsBack) {
  EXPECT_EQ(answer_to(0x19, "00000001 00000001 55"), "000000010000000155");
  EXPECT_EQ(answer_to(0x19, "00000002 00000002 5566"), "00000002000000025566");
  EXPECT_EQ(answer_to(0x19, "00000004 00000003 55667788"), "000000040000000355667788");
  EXPECT_EQ(answer_to(0x19, "00000001 00000004 55"), malformed);
  EXPECT_EQ(answer_to(0x19, "00000000 00000001 55"), malformed);
}

TEST(TestabilityEcho, GivesTextBack) {
  EXPECT_EQ(answer_to(0x15, "00000006 efbbbf 6869 00"), "00000006efbbbf686900");
  EXPECT_EQ(answer_to(0x15, "00000005 efbbbf 6869"), malformed);
  EXPECT_EQ(answer_to(0x16, "00000008 feff 00680069 0000"), "00000008feff006800690000");
  EXPECT_EQ(answer_to(0x16, "00000008 fffe 68006900 0000"), malformed);
  const std::string zeros(2 * 58, '0');
  EXPECT_EQ(answer_to(0x13, "efbbbf 686900" + zeros), "efbbbf686900" + zeros);
  EXPECT_EQ(answer_to(0x14, "feff 0068 0000" + zeros), "feff00680000" + zeros);
  EXPECT_EQ(answer_to(0x14, "feff 0068 0000" + zeros.substr(2)), malformed);
}

TEST(TestabilityEcho, SaysSoWhenItLacksMemory) {
  EXPECT_EQ(answer_to(0x09, "00000003 010203", 6), not_ok);
  EXPECT_EQ(answer_to(0x09, "00000003 010203", 7), "00000003010203");
  EXPECT_EQ(answer_to(0x16, "00000008 feff 00680069 0000", 64, 1), not_ok);
}

TEST(TestabilityEcho, KnowsEachListedMethodAndNoOther) {
  const std::string enough(2 * 64, '0');
  for (unsigned id = 0; id < 0x100; ++id) {
    const MethodId method{static_cast<std::uint16_t>(id)};
    const bool listed = std::ranges::find(echoes, method) != echoes.end() ||
                        std::ranges::find(protected_echoes, method) != protected_echoes.end();
    EXPECT_EQ(answer_to(id, enough) != unknown, listed) << std::hex << id;
  }
}

TEST(TestabilityEcho, HasAProtectionForEachProfile) {
  std::vector<std::size_t> kinds;
  for (const MethodId method : protected_echoes) {
    kinds.push_back(protection_of(method).index());
    EXPECT_EQ(answer_to(value(method), "12345678"), "12345678");
    EXPECT_EQ(answer_to(value(method), "123456"), malformed);
  }
  std::ranges::sort(kinds);
  EXPECT_EQ(std::ranges::adjacent_find(kinds), kinds.end());
  EXPECT_EQ(kinds.size(), std::variant_size_v<e2e::Config>);
}

}  // namespace
}  // namespace ets
