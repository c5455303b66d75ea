// What the log says of a message that cannot be converted: the bytes, and what its sender may mean by them.
#include "bridge/runtime/conversion_words.hpp"

#include <gmock/gmock.h>

#include "test/bytes.hpp"

namespace trestle::test::conversion_words_test {
namespace {

using bridge::ConversionError;
using bridge::ConversionFault;
using testing::HasSubstr;
using testing::Not;

std::string said(ConversionFault fault, const std::vector<std::byte>& payload,
                 const someip::PayloadRules& rules = {}) {
  return bridge::in_words(ConversionError{fault, 0, "name"}, payload, rules);
}

TEST(ConversionWords, ShowTheBytes) {
  EXPECT_EQ(bridge::in_words(ConversionError{ConversionFault::truncated, 2, "a"}, hex("0001 00000009")),
            "truncated at byte 2 in a (of 6 bytes; there stands 00 00 00 09)");
  EXPECT_EQ(bridge::in_words(ConversionError{ConversionFault::truncated, 6, "a"}, hex("0001 00000009")),
            "truncated at byte 6 in a (of 6 bytes)");
}

TEST(ConversionWords, GuessTheByteOrderOfALength) {
  EXPECT_THAT(said(ConversionFault::truncated, hex("05000000 efbbbf 6100")),
              HasSubstr("0x05000000 as a length is 5 in little endian, which would fit: write `wire: "
                        "{byte_order: little, length_order: as_payload}`"));
  EXPECT_THAT(said(ConversionFault::truncated, hex("00000009 efbbbf 6100")), Not(HasSubstr("wire")));
}

TEST(ConversionWords, GuessTheEncodingOfAText) {
  EXPECT_THAT(said(ConversionFault::bad_string, hex("00000006 68656c6c6f 00")),
              HasSubstr("`wire: {string_bom: false}`"));
  someip::PayloadRules wide;
  wide.string_encoding = someip::StringEncoding::utf16le;
  EXPECT_THAT(said(ConversionFault::bad_string, hex("00000006 68656c6c6f 00"), wide),
              HasSubstr("looks like UTF-8: write `wire: {string_encoding: utf8}`"));
  EXPECT_THAT(said(ConversionFault::bad_string, hex("0000000c fffe 6800650066006600 0000")),
              HasSubstr("utf16le"));
  EXPECT_THAT(said(ConversionFault::bad_string, hex("0000000c feff 0068006500660066 0000")),
              HasSubstr("utf16be"));
  EXPECT_THAT(said(ConversionFault::bad_string, hex("00000003 01 02 03")), Not(HasSubstr("wire")));
}

}  // namespace
}  // namespace trestle::test::conversion_words_test
