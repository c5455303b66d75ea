// Strings in payloads.
#include <array>
#include <string>

#include "someip/wire/payload_reader.hpp"
#include "someip/wire/payload_writer.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"
#include "test/someip/written.hpp"

namespace trestle::someip::payload_string_test {
namespace {
using test::covers;
using test::hex;
using test::written;

/// What reading a string gives; "!error" if it fails.
std::string read_string(std::string_view bytes, const PayloadRules& rules = {}) {
  const auto payload = hex(bytes);
  std::array<char, 64> room{};
  PayloadReader in{payload, rules};
  const std::string result{in.string(room)};
  return in.error() ? std::string{"!"} + to_string(*in.error()) : result;
}

TEST(PayloadWriter, WritesStringsInEveryEncoding) {
  covers({"feat_req_someip_234", "feat_req_someip_687", "feat_req_someip_639", "feat_req_someip_640",
          "feat_req_someip_662", "feat_req_someip_800", "feat_req_someip_562", "feat_req_someip_582",
          "feat_req_someip_581", "feat_req_someip_237", "feat_req_someip_238"});
  // a, a umlaut (2 bytes in UTF-8), Euro sign (3), grinning face (4; a pair of surrogates in UTF-16)
  const auto write = [](PayloadWriter& out) { out.string("a\u00e4\u20ac\U0001f600"); };
  EXPECT_EQ(written({}, write),
            "0000000e"
            "efbbbf"
            "61"
            "c3a4"
            "e282ac"
            "f09f9880"
            "00");
  EXPECT_EQ(written({.string_encoding = StringEncoding::utf16be}, write),
            "0000000e"
            "feff"
            "0061"
            "00e4"
            "20ac"
            "d83dde00"
            "0000");
  EXPECT_EQ(written({.string_length = FieldWidth::bits8, .string_encoding = StringEncoding::utf16le}, write),
            "0e"
            "fffe"
            "6100"
            "e400"
            "ac20"
            "3dd800de"
            "0000");
  EXPECT_EQ(
      written({.string_length = FieldWidth::bits16, .string_bom = false, .string_terminator = false}, write),
      "000a"
      "61"
      "c3a4"
      "e282ac"
      "f09f9880");
}

TEST(PayloadReader, ReadsStringsInEveryEncoding) {
  covers({"feat_req_someip_234", "feat_req_someip_666"});
  const std::string text = "a\u00e4\u20ac\U0001f600";
  EXPECT_EQ(read_string("0000000e efbbbf 61 c3a4 e282ac f09f9880 00"), text);
  EXPECT_EQ(
      read_string("0000000e feff 0061 00e4 20ac d83dde00 0000", {.string_encoding = StringEncoding::utf16be}),
      text);
  EXPECT_EQ(read_string("0e fffe 6100 e400 ac20 3dd800de 0000",
                        {.string_length = FieldWidth::bits8, .string_encoding = StringEncoding::utf16le}),
            text);
  EXPECT_EQ(
      read_string("000a 61 c3a4 e282ac f09f9880",
                  {.string_length = FieldWidth::bits16, .string_bom = false, .string_terminator = false}),
      text);
}

TEST(PayloadReader, AcceptsZerosBehindTheTerminator) {
  covers({"feat_req_someip_239"});
  EXPECT_EQ(read_string("00000008 efbbbf 6869 000000"), "hi");
}

TEST(PayloadReader, TakesZerosForCharactersWhereNoneTerminates) {
  const auto text = hex("0003 610062");
  PayloadReader in{text,
                   {.string_length = FieldWidth::bits16, .string_bom = false, .string_terminator = false}};
  std::array<char, 8> room{};
  EXPECT_EQ(in.string(room), (std::string_view{"a\0b", 3}));
  EXPECT_FALSE(in.error());
}

TEST(PayloadReader, IgnoresAnOddLastByteOfUtf16) {
  covers({"feat_req_someip_641", "feat_req_someip_642"});
  const PayloadRules rules{.string_encoding = StringEncoding::utf16be};
  EXPECT_EQ(read_string("00000007 feff 0061 0000 55", rules), "a");
  EXPECT_EQ(read_string("00000007 feff 0061 0061 00", rules), "!bad_string_encoding");
}

TEST(PayloadReader, RefusesDamagedStrings) {
  covers({"feat_req_someip_666", "feat_req_someip_687"});
  EXPECT_EQ(read_string("00000003 6869 00"), "!bad_string_encoding") << "no BOM";
  EXPECT_EQ(read_string("00000004 feff 6100"), "!bad_string_encoding") << "another encoding's BOM";
  EXPECT_EQ(read_string("00000005 efbbbf 6869"), "!bad_string_encoding") << "no terminator";
  EXPECT_EQ(read_string("00000000"), "!bad_string_encoding") << "neither";
  EXPECT_EQ(read_string("00000007 efbbbf 680069 00"), "!bad_string_encoding") << "goes on behind the zero";
  EXPECT_EQ(read_string("00000005 efbbbf c3 00"), "!bad_string_encoding") << "half a character";
  EXPECT_EQ(read_string("00000006 efbbbf c0af 00"), "!bad_string_encoding") << "overlong";
  EXPECT_EQ(read_string("00000007 efbbbf eda080 00"), "!bad_string_encoding") << "surrogate";
  EXPECT_EQ(read_string("00000008 efbbbf f4908080 00"), "!bad_string_encoding") << "beyond U+10FFFF";
  EXPECT_EQ(read_string("00000009 efbbbf 6869 00"), "!truncated") << "length beyond the data";
  EXPECT_EQ(read_string("ffffffff efbbbf 6869 00"), "!truncated");
  const PayloadRules utf16{.string_encoding = StringEncoding::utf16be};
  EXPECT_EQ(read_string("00000006 feff d83d 0000", utf16), "!bad_string_encoding") << "lone high surrogate";
  EXPECT_EQ(read_string("00000006 feff de00 0000", utf16), "!bad_string_encoding") << "lone low surrogate";
  EXPECT_EQ(read_string("0000", {.string_length = FieldWidth::none}), "!bad_length");
}

TEST(PayloadReader, SaysWhenTheRoomForAStringIsTooSmall) {
  const auto payload = hex("00000008 feff 0061 0062 0000");
  std::array<char, 1> room{};
  PayloadReader in{payload, {.string_encoding = StringEncoding::utf16be}};
  EXPECT_EQ(in.string(room), "");
  EXPECT_EQ(in.error(), WireError::no_room);
}

TEST(PayloadWriter, RefusesTextThatItsReaderWouldNotRead) {
  EXPECT_EQ(written({}, [](auto& out) { out.string("\xff"); }), "!bad_string_encoding");
  EXPECT_EQ(written({}, [](auto& out) { out.string({"a\0b", 3}); }), "!bad_string_encoding");
  EXPECT_EQ(written({.string_terminator = false},
                    [](auto& out) {
                      out.string({"a\0b", 3});
                    }),
            "00000006efbbbf610062");
  EXPECT_EQ(
      written({.string_length = FieldWidth::bits8}, [](auto& out) { out.string(std::string(252, 'a')); }),
      "!bad_length");
}

TEST(PayloadWriter, FillsFixedStringsWithZeros) {
  covers({"feat_req_someip_233", "feat_req_someip_662"});
  EXPECT_EQ(written({}, [](auto& out) { out.fixed_string("abc", 8); }), "efbbbf6162630000");
  EXPECT_EQ(written({}, [](auto& out) { out.fixed_string("abc", 7); }), "efbbbf61626300");
  EXPECT_EQ(written({}, [](auto& out) { out.fixed_string("abc", 6); }), "!bad_length");
  const auto payload = hex("efbbbf6162630000 77");
  PayloadReader in{payload};
  EXPECT_EQ(in.fixed_string(8, {}), "abc");
  EXPECT_EQ(in.u8(), 0x77);
  EXPECT_FALSE(in.error());
}

}  // namespace
}  // namespace trestle::someip::payload_string_test
