// What the log says of a message that cannot be converted: the bytes, and what its sender may mean by them.
#include "bridge/carry/runtime/conversion_words.hpp"

#include <gmock/gmock.h>

#include "test/bridge/messages/convert/support.hpp"
#include "test/bytes.hpp"

namespace trestle::test::conversion_words_test {
namespace {

using messages::ConversionError;
using messages::ConversionFault;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

std::string said(ConversionFault fault, const std::vector<std::byte>& payload,
                 const someip::PayloadRules& rules = {}) {
  return carry::in_words(ConversionError{fault, 0, "name", {}}, payload, rules);
}

TEST(ConversionWords, ShowTheBytes) {
  EXPECT_EQ(carry::in_words(ConversionError{ConversionFault::truncated, 2, "a", "4 bytes wanted, 3 left"},
                            hex("0001 00000009")),
            "truncated at byte 2 in a: 4 bytes wanted, 3 left (of 6 bytes; there stands 00 00 00 09)");
  EXPECT_EQ(carry::in_words(ConversionError{ConversionFault::truncated, 6, "a", {}}, hex("0001 00000009")),
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

// From real fields, so that the guess goes by the error that they give.
std::string said_of(std::string_view msg, const std::vector<std::byte>& payload,
                    const someip::PayloadRules& rules = {}) {
  messages::ConversionScratch scratch;
  const auto converted = plan_of(tree_of(msg), rules).someip_to_cdr(payload, scratch);
  return converted ? "good" : carry::in_words(converted.error(), payload, rules);
}

TEST(ConversionWords, SayThatAWstringIsUtf16WhereUtf8Comes) {
  for (const char* const utf8 : {"00000009 efbbbf 68656c6c6f 00", "00000006 68656c6c6f 00"}) {
    for (const auto encoding : {someip::StringEncoding::utf8, someip::StringEncoding::utf16le}) {
      someip::PayloadRules rules;
      rules.string_encoding = encoding;
      EXPECT_THAT(
          said_of("wstring text", hex(utf8), rules),
          AllOf(HasSubstr("bad_string at byte 0 in text: BOM "), HasSubstr("looks like UTF-8, but the field "
                                                                           "is a wstring, which is UTF-16")));
    }
  }
  EXPECT_EQ(said_of("wstring text", hex("0000000e feff 00680065006c006c006f 0000")), "good");
  EXPECT_THAT(said_of("wstring text", hex("0000000e fffe 680065006c006c006f00 0000")), HasSubstr("utf16le"));
}

TEST(ConversionWords, SayWhatATextLacks) {
  EXPECT_THAT(said_of("string text", hex("00000006 68656c6c6f 00")),
              AllOf(HasSubstr("BOM ef bb bf and terminator 00 wanted"), HasSubstr("string_bom: false")));
  EXPECT_THAT(said_of("string text", hex("00000008 efbbbf 68656c6c6f")),
              HasSubstr("string_terminator: false"));
}

}  // namespace
}  // namespace trestle::test::conversion_words_test
