#include "someip/wire/utf.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <utility>

#include "test/bytes.hpp"
#include "test/covers.hpp"

namespace trestle::someip::utf_test {
namespace {
using test::covers;
using test::hex;
using test::to_hex;

std::string utf8_of(char32_t code) {
  std::array<std::byte, 4> room{};
  put_utf8(code, room.data());
  return to_hex(ByteView{room}.first(utf8_bytes(code)));
}

std::string utf16_of(char32_t code, std::endian order) {
  std::array<std::byte, 4> room{};
  put_utf16(code, room.data(), order);
  return to_hex(ByteView{room}.first(utf16_bytes(code)));
}

TEST(Utf, WritesTheFirstAndLastCharacterOfEachLength) {
  covers({"feat_req_someip_234"});
  EXPECT_EQ(utf8_of(0x00), "00");
  EXPECT_EQ(utf8_of(0x7f), "7f");
  EXPECT_EQ(utf8_of(0x80), "c280");
  EXPECT_EQ(utf8_of(0x7ff), "dfbf");
  EXPECT_EQ(utf8_of(0x800), "e0a080");
  EXPECT_EQ(utf8_of(0xffff), "efbfbf");
  EXPECT_EQ(utf8_of(0x10000), "f0908080");
  EXPECT_EQ(utf8_of(0x10ffff), "f48fbfbf");
  EXPECT_EQ(utf16_of(0x0041, std::endian::big), "0041");
  EXPECT_EQ(utf16_of(0xffff, std::endian::big), "ffff");
  EXPECT_EQ(utf16_of(0x10000, std::endian::big), "d800dc00");
  EXPECT_EQ(utf16_of(0x10ffff, std::endian::big), "dbffdfff");
  EXPECT_EQ(utf16_of(0x20ac, std::endian::little), "ac20");
  EXPECT_EQ(utf16_of(0x1f600, std::endian::little), "3dd800de");
}

TEST(Utf, ReadsTheCharactersThatItWrites) {
  for (char32_t code = 0; code < 0x110000; code += code < 0x10800 ? 1 : 97) {
    if (code == 0xd800) {
      code = 0xe000;  // no characters in between
    }
    std::array<std::byte, 5> room{};
    put_utf8(code, room.data());
    const auto from_utf8 = first_utf8(room);
    ASSERT_TRUE(from_utf8) << std::uint32_t{code};
    ASSERT_EQ(from_utf8->code, code);
    ASSERT_EQ(from_utf8->bytes, utf8_bytes(code)) << std::uint32_t{code};
    put_utf16(code, room.data(), std::endian::little);
    const auto from_utf16 = first_utf16(room, std::endian::little);
    ASSERT_TRUE(from_utf16) << std::uint32_t{code};
    ASSERT_EQ(from_utf16->code, code);
    ASSERT_EQ(from_utf16->bytes, utf16_bytes(code)) << std::uint32_t{code};
  }
}

// Table 3-7 of the Unicode standard: the second byte that may follow a first one, and how many bytes there
// are.
struct WellFormed {
  int lead_from, lead_to, second_from, second_to;
  std::size_t bytes;
};
constexpr std::array well_formed{
    WellFormed{0xc2, 0xdf, 0x80, 0xbf, 2}, WellFormed{0xe0, 0xe0, 0xa0, 0xbf, 3},
    WellFormed{0xe1, 0xec, 0x80, 0xbf, 3}, WellFormed{0xed, 0xed, 0x80, 0x9f, 3},
    WellFormed{0xee, 0xef, 0x80, 0xbf, 3}, WellFormed{0xf0, 0xf0, 0x90, 0xbf, 4},
    WellFormed{0xf1, 0xf3, 0x80, 0xbf, 4}, WellFormed{0xf4, 0xf4, 0x80, 0x8f, 4},
};

std::size_t bytes_of(int lead, int second) {
  for (const WellFormed& row : well_formed) {
    if (lead >= row.lead_from && lead <= row.lead_to && second >= row.second_from &&
        second <= row.second_to) {
      return row.bytes;
    }
  }
  return lead < 0x80 ? 1 : 0;
}

TEST(Utf, TakesExactlyTheWellFormedBytesOfTheUnicodeStandard) {
  for (int lead = 0; lead < 256; ++lead) {
    for (int second = 0; second < 256; ++second) {
      for (const int rest : {0x80, 0xbf}) {
        const std::array text{static_cast<std::byte>(lead), static_cast<std::byte>(second),
                              static_cast<std::byte>(rest), static_cast<std::byte>(rest)};
        const std::size_t bytes = bytes_of(lead, second);
        const auto character = first_utf8(text);
        ASSERT_EQ(character ? character->bytes : 0, bytes) << lead << ' ' << second;
        if (bytes > 1) {
          EXPECT_FALSE(first_utf8(ByteView{text}.first(bytes - 1))) << lead;
          for (const int bad : {0x00, 0x7f, 0xc0, 0xff}) {  // not the last byte of a character
            auto damaged = text;
            damaged[bytes - 1] = static_cast<std::byte>(bad);
            EXPECT_FALSE(first_utf8(damaged)) << lead;
          }
        }
      }
    }
  }
  EXPECT_FALSE(first_utf8({}));
  EXPECT_TRUE(is_utf8({}));
  EXPECT_TRUE(is_utf8(hex("61 c3a4 e282ac f09f9880")));
  EXPECT_FALSE(is_utf8(hex("61 c3a4 e282ac f09f98")));
}

TEST(Utf, TakesSurrogatesInPairsOnly) {
  for (const auto& [text, code] : {
           std::pair{"d7ff", 0xd7ff},
           std::pair{"e000", 0xe000},
           std::pair{"d800dc00", 0x10000},
           std::pair{"dbffdfff", 0x10ffff},
           std::pair{"d83dde00", 0x1f600},
           std::pair{"d800", -1},      // ends in the middle
           std::pair{"d800dc", -1},    //
           std::pair{"d800dbff", -1},  // two high ones
           std::pair{"d800e000", -1},  // a high one and another character
           std::pair{"dc00dc00", -1},  // a low one first
           std::pair{"dfff", -1},
           std::pair{"41", -1},
           std::pair{"", -1},
       }) {
    const auto bytes = hex(text);
    const auto character = first_utf16(bytes, std::endian::big);
    EXPECT_EQ(character ? static_cast<int>(character->code) : -1, code) << text;
  }
}

}  // namespace
}  // namespace trestle::someip::utf_test
