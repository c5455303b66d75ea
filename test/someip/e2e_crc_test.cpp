#include <numeric>
#include <vector>

#include "someip/core/e2e/crc.hpp"
#include "test/bytes.hpp"
#include "test/covers.hpp"

namespace trestle::someip::e2e::e2e_crc_test {
namespace {

using test::hex;

/// The check value of every CRC catalogue: the sum of "123456789".
const std::vector<std::byte> digits = hex("313233343536373839");

TEST(E2eCrc, HasTheCatalogueCheckValues) {
  EXPECT_EQ(crc8(digits), 0x4b);
  EXPECT_EQ(crc8_h2f(digits), 0xdf);
  EXPECT_EQ(crc16(digits), 0x29b1);
  EXPECT_EQ(crc32(digits), 0xcbf43926);
  EXPECT_EQ(crc32_p4(digits), 0x1697d06a);
  EXPECT_EQ(crc64(digits), 0x995dc9bbdf1939fa);
}

/// The example tables of AUTOSAR's "Specification of CRC Routines".
struct AutosarRow {
  const char* bytes;
  std::uint8_t crc8;
  std::uint8_t crc8_h2f;
  std::uint16_t crc16;
  std::uint32_t crc32;
  std::uint32_t crc32_p4;
  std::uint64_t crc64;
};
constexpr AutosarRow autosar_rows[] = {
    {"00000000", 0x59, 0x12, 0x84c0, 0x2144df1c, 0x6fb32240, 0xf4a586351e1b9f4b},
    {"f20183", 0x37, 0xc2, 0xd374, 0x24ab9d77, 0x4f721a25, 0x319c27668164f1c6},
    {"0faa0055", 0x79, 0xc6, 0x2023, 0xb6c9b287, 0x20662df8, 0x54c5d0f7667c1575},
    {"00ff5511", 0xb8, 0x77, 0xb8f9, 0x32a06212, 0x9bd7996e, 0xa63822be7e0704e6},
    {"332255aabbccddeeff", 0xcb, 0x11, 0xf53f, 0xb0ae863d, 0xa65a343d, 0x701eceb219a8e5d5},
    {"926b55", 0x8c, 0x33, 0x0745, 0x9cdea29b, 0xee688a78, 0x5faa96a9b59f3e4e},
    {"ffffffff", 0x74, 0x6c, 0x1d0f, 0xffffffff, 0xffffffff, 0xffffffff00000000},
};

TEST(E2eCrc, AgreesWithTheTablesOfAutosar) {
  for (const AutosarRow& row : autosar_rows) {
    SCOPED_TRACE(row.bytes);
    const auto bytes = hex(row.bytes);
    EXPECT_EQ(crc8(bytes), row.crc8);
    EXPECT_EQ(crc8_h2f(bytes), row.crc8_h2f);
    EXPECT_EQ(crc16(bytes), row.crc16);
    EXPECT_EQ(crc32(bytes), row.crc32);
    EXPECT_EQ(crc32_p4(bytes), row.crc32_p4);
    EXPECT_EQ(crc64(bytes), row.crc64);
  }
}

/// Bit by bit, straight from the definition of a reflected CRC.
template <typename T>
T slow_crc(ByteView bytes, T reflected_polynomial) {
  T sum = static_cast<T>(~T{0});
  for (const std::byte byte : bytes) {
    sum ^= std::to_integer<T>(byte);
    for (int bit = 0; bit < 8; ++bit) {
      sum = (sum & 1U) != 0 ? (sum >> 1U) ^ reflected_polynomial : sum >> 1U;
    }
  }
  return static_cast<T>(~sum);
}

std::vector<std::byte> pattern(std::size_t size) {
  std::vector<std::byte> bytes(size);
  unsigned state = 1;
  for (std::byte& byte : bytes) {
    state = state * 1664525U + 1013904223U;
    byte = static_cast<std::byte>(state >> 24U);
  }
  return bytes;
}

TEST(E2eCrc, IsTheSameBitByBitForEveryLengthAndAlignment) {
  const auto bytes = pattern(64);
  for (std::size_t begin = 0; begin < 9; ++begin) {
    for (std::size_t size = 0; begin + size <= bytes.size(); ++size) {
      const ByteView part = ByteView{bytes}.subspan(begin, size);
      ASSERT_EQ(crc32(part), slow_crc<std::uint32_t>(part, 0xedb88320)) << begin << ' ' << size;
      ASSERT_EQ(crc32_p4(part), slow_crc<std::uint32_t>(part, 0xc8df352f)) << begin << ' ' << size;
      ASSERT_EQ(crc64(part), slow_crc<std::uint64_t>(part, 0xc96c5795d7870f42)) << begin << ' ' << size;
    }
  }
}

TEST(E2eCrc, GoesOnWhereThePieceBeforeEnded) {
  const auto bytes = pattern(40);
  for (std::size_t cut = 0; cut <= bytes.size(); ++cut) {
    const ByteView a = ByteView{bytes}.first(cut);
    const ByteView b = ByteView{bytes}.subspan(cut);
    ASSERT_EQ(crc8(b, crc8(a)), crc8(bytes)) << cut;
    ASSERT_EQ(crc8_h2f(b, crc8_h2f(a)), crc8_h2f(bytes)) << cut;
    ASSERT_EQ(crc16(b, crc16(a)), crc16(bytes)) << cut;
    ASSERT_EQ(crc32(b, crc32(a)), crc32(bytes)) << cut;
    ASSERT_EQ(crc32_p4(b, crc32_p4(a)), crc32_p4(bytes)) << cut;
    ASSERT_EQ(crc64(b, crc64(a)), crc64(bytes)) << cut;
  }
}

TEST(E2eCrc, OfNothingIsTheSumBefore) {
  EXPECT_EQ(crc8({}), 0);
  EXPECT_EQ(crc16({}), 0xffff);
  EXPECT_EQ(crc32_p4({}, 0x12345678), 0x12345678U);
  EXPECT_EQ(crc64({}, 0x123456789abcdef0), 0x123456789abcdef0U);
}

}  // namespace
}  // namespace trestle::someip::e2e::e2e_crc_test
