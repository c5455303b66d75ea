// Errors say what was wanted where the converter stopped.
#include <gmock/gmock.h>

#include "test/bridge/messages/convert/support.hpp"

namespace trestle::test::expectation_test {
namespace {

using messages::ConversionScratch;
using someip::FieldWidth;
using someip::PayloadRules;
using testing::EndsWith;

std::string from_someip(std::string_view msg, std::string_view payload, const PayloadRules& rules = {}) {
  ConversionScratch scratch;
  const auto bytes = hex(payload);
  const auto result = plan_of(tree_of(msg), rules).someip_to_cdr(bytes, scratch);
  return result ? "good" : to_string(result.error());
}
std::string from_cdr(std::string_view msg, std::string_view sample, const PayloadRules& rules = {}) {
  ConversionScratch scratch;
  const auto bytes = hex(sample);
  const auto result = plan_of(tree_of(msg), rules).cdr_to_someip(bytes, scratch);
  return result ? "good" : to_string(result.error());
}

TEST(Expectation, OfWhatIsTruncated) {
  EXPECT_EQ(from_someip("uint32 a\nuint32 b", "00000001 0002"),
            "truncated at byte 4 in b: 4 bytes wanted, 2 left");
  EXPECT_EQ(from_someip("bool a\nbool b", "01"), "truncated at byte 1 in b: 1 byte wanted, 0 left");
  EXPECT_EQ(from_someip("string a", "0000"),
            "truncated at byte 0 in a: a length field of 4 bytes wanted, 2 left");
  EXPECT_EQ(from_someip("string a", "00000100 efbbbf"),
            "truncated at byte 0 in a: 256 bytes wanted, as the length says, 3 left");
  EXPECT_EQ(from_someip("uint16[] a", "00000004 0001"),
            "truncated at byte 0 in a: 4 bytes wanted, as the length says, 2 left");
  EXPECT_EQ(from_someip("uint8 a", "", {.struct_length = FieldWidth::bits16}),
            "truncated at byte 0: a length field of 2 bytes wanted, 0 left");
  EXPECT_EQ(from_cdr("uint32 a", "00010000 0102"), "truncated at byte 4 in a: 4 bytes wanted, 2 left");
  EXPECT_EQ(from_cdr("string a", "00010000 05000000 61"),
            "truncated at byte 4 in a: a count of 4 bytes, and as many as it says, wanted, 5 left");
  EXPECT_EQ(from_cdr("uint8 a", "0001"), "truncated at byte 0: 4 bytes of encapsulation wanted");
}

TEST(Expectation, OfValuesAndTheirFrame) {
  EXPECT_EQ(from_cdr("bool a", "00010000 07"), "bad_bool at byte 4 in a: 0 or 1 wanted");
  EXPECT_EQ(from_cdr("uint8 a", "00030000 07"),
            "bad_encapsulation at byte 0: plain CDR wanted, which begins with 00 00 or 00 01");
  EXPECT_EQ(from_cdr("uint8 a", "00010000 07 00000000000000"),
            "trailing_bytes at byte 5: the end wanted, 7 bytes left");
  EXPECT_EQ(from_cdr("uint8[<=2] a", "00010000 03000000 010203"),
            "bound_exceeded at byte 4 in a: at most 2 wanted");
  EXPECT_EQ(from_cdr("string a", "00010000 02000000 6162"),
            "bad_string at byte 4 in a: characters other than zero, and one zero behind them, wanted");
  EXPECT_THAT(from_cdr("uint16[] a", "00010000 80000000" + std::string(512, '0'),
                       {.array_length = FieldWidth::bits8}),
              EndsWith("at most 255 bytes wanted, as the length field has 8 bits"));
}

TEST(Expectation, OfTextsAndLengths) {
  EXPECT_EQ(from_someip("string a", "00000002 6100"),
            "bad_string at byte 0 in a: BOM ef bb bf and terminator 00 wanted");
  EXPECT_EQ(from_someip("wstring a", "00000002 6100"),
            "bad_string at byte 0 in a: BOM fe ff and terminator 00 00 wanted");
  EXPECT_EQ(from_someip("uint32[] a", "00000003 010203"),
            "bad_length at byte 0 in a: a length that is a multiple of 4 wanted");
  EXPECT_THAT(from_someip("string a", "00000006 feff d800 0000",
                          {.string_encoding = someip::StringEncoding::utf16be}),
              EndsWith(": UTF-16 wanted"));
}

}  // namespace
}  // namespace trestle::test::expectation_test
