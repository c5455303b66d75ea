#include "someip/core/e2e/crc.hpp"

#include <array>
#include <concepts>
#include <limits>

#include "someip/wire/bytes.hpp"

namespace trestle::someip::e2e {
namespace {

// Bytes a step of the reflected CRCs. Each needs 4 KB of tables, so code optimized for size takes one.
#ifdef __OPTIMIZE_SIZE__
constexpr std::size_t slices = 1;
#else
constexpr std::size_t slices = 8;
#endif

template <std::unsigned_integral T>
using Table = std::array<T, 256>;

/// For CRCs that shift to the left: the register after each possible byte.
template <std::unsigned_integral T>
constexpr Table<T> forward_table(T polynomial) {
  constexpr unsigned width = std::numeric_limits<T>::digits;
  constexpr T top = T{1} << (width - 1U);
  Table<T> table{};
  for (unsigned byte = 0; byte < table.size(); ++byte) {
    T sum = static_cast<T>(byte << (width - 8U));
    for (int bit = 0; bit < 8; ++bit) {
      const bool carry = (sum & top) != 0;
      sum = static_cast<T>(sum << 1U);
      sum = carry ? static_cast<T>(sum ^ polynomial) : sum;
    }
    table[byte] = sum;
  }
  return table;
}

/// For reflected CRCs: [n][byte] is the register after `byte` and n zero bytes behind it, so that eight bytes
/// can be looked up independently of each other.
template <std::unsigned_integral T>
constexpr std::array<Table<T>, slices> reflected_tables(T polynomial) {
  T reflected = 0;
  for (unsigned bit = 0; bit < unsigned{std::numeric_limits<T>::digits}; ++bit) {
    reflected = static_cast<T>((reflected << 1U) | ((polynomial >> bit) & 1U));
  }
  std::array<Table<T>, slices> tables{};
  for (unsigned byte = 0; byte < 256; ++byte) {
    T sum = static_cast<T>(byte);
    for (int bit = 0; bit < 8; ++bit) {
      sum = (sum & 1U) != 0 ? static_cast<T>((sum >> 1U) ^ reflected) : static_cast<T>(sum >> 1U);
    }
    tables[0][byte] = sum;
  }
  for (std::size_t n = 1; n < slices; ++n) {
    for (std::size_t byte = 0; byte < 256; ++byte) {
      const T before = tables[n - 1][byte];
      tables[n][byte] = static_cast<T>((before >> 8U) ^ tables[0][before & 0xffU]);
    }
  }
  return tables;
}

constexpr Table<std::uint8_t> j1850_table = forward_table<std::uint8_t>(0x1d);
constexpr Table<std::uint8_t> h2f_table = forward_table<std::uint8_t>(0x2f);
constexpr Table<std::uint16_t> ccitt_table = forward_table<std::uint16_t>(0x1021);
constexpr auto ethernet_tables = reflected_tables<std::uint32_t>(0x04c11db7);
constexpr auto p4_tables = reflected_tables<std::uint32_t>(0xf4acfb13);
constexpr auto ecma_tables = reflected_tables<std::uint64_t>(0x42f0e1eba9ea3693);

std::uint8_t crc8_over(const Table<std::uint8_t>& table, ByteView bytes, std::uint8_t sum) {
  for (const std::byte byte : bytes) {
    sum = table[sum ^ std::to_integer<std::uint8_t>(byte)];
  }
  return sum;
}

/// The contribution of byte `n` of the number (0: the lowest) when `followed_by` bytes come after it.
template <std::unsigned_integral T, std::unsigned_integral Number>
T slice(const std::array<Table<T>, slices>& tables, Number number, unsigned n, unsigned followed_by) {
  return tables[followed_by][(number >> (8U * n)) & 0xffU];
}

template <std::unsigned_integral T>
T reflected_crc(const std::array<Table<T>, slices>& tables, ByteView bytes, T sum) {
  if constexpr (slices == 8) {
    for (; bytes.size() >= slices; bytes = bytes.subspan(slices)) {
      const std::uint64_t eight = load<std::uint64_t>(bytes.data(), std::endian::little) ^ sum;
      sum = static_cast<T>(slice(tables, eight, 0, 7) ^ slice(tables, eight, 1, 6) ^
                           slice(tables, eight, 2, 5) ^ slice(tables, eight, 3, 4) ^
                           slice(tables, eight, 4, 3) ^ slice(tables, eight, 5, 2) ^
                           slice(tables, eight, 6, 1) ^ slice(tables, eight, 7, 0));
    }
  }
  for (const std::byte byte : bytes) {
    sum = static_cast<T>((sum >> 8U) ^ tables[0][(sum ^ std::to_integer<T>(byte)) & 0xffU]);
  }
  return sum;
}

}  // namespace

// The XORs at both ends turn a result back into the register to continue; 0 becomes the initial value.
std::uint8_t crc8(ByteView bytes, std::uint8_t previous) noexcept {
  return crc8_over(j1850_table, bytes, previous ^ 0xffU) ^ 0xffU;
}

std::uint8_t crc8_h2f(ByteView bytes, std::uint8_t previous) noexcept {
  return crc8_over(h2f_table, bytes, previous ^ 0xffU) ^ 0xffU;
}

std::uint16_t crc16(ByteView bytes, std::uint16_t previous) noexcept {
  std::uint16_t sum = previous;
  for (const std::byte byte : bytes) {
    const unsigned index = (sum >> 8U) ^ std::to_integer<unsigned>(byte);
    sum = static_cast<std::uint16_t>((static_cast<unsigned>(sum) << 8U) ^ ccitt_table[index]);
  }
  return sum;
}

std::uint32_t crc32(ByteView bytes, std::uint32_t previous) noexcept {
  return ~reflected_crc(ethernet_tables, bytes, ~previous);
}

std::uint32_t crc32_p4(ByteView bytes, std::uint32_t previous) noexcept {
  return ~reflected_crc(p4_tables, bytes, ~previous);
}

std::uint64_t crc64(ByteView bytes, std::uint64_t previous) noexcept {
  return ~reflected_crc(ecma_tables, bytes, ~previous);
}

}  // namespace trestle::someip::e2e
