#pragma once
#include <array>
#include <bit>
#include <cstdint>
#include <optional>

#include "someip/core/e2e/config.hpp"
#include "someip/wire/types.hpp"

/// What Protector and Checker share: a profile with its parameters, brought into one form. Not for users.
namespace trestle::someip::e2e {

/// Where something of `size` stands in the Data, both in bits; size 0: it does not exist in this profile.
struct HeaderField {
  std::uint32_t at = 0;
  std::uint32_t size = 0;
  [[nodiscard]] constexpr std::uint32_t end() const noexcept { return at + size; }
};

/// A profile as data. Nothing below this asks which profile it is.
struct Layout {
  /// The polynomials of the profiles.
  enum class Crc : std::uint8_t { j1850, h2f, ccitt, p4, ecma };
  /// Data ID bytes that are in the CRC but not in the message.
  enum class ImplicitId : std::uint8_t {
    none,
    before_both,         ///< in front of the Data: low byte, high byte
    before_alternating,  ///< one of them, by the counter's parity
    before_low,
    before_low_and_zero,
    behind_by_counter,  ///< behind the Data: data_id_list[counter]
    behind_little,      ///< low byte, high byte
    behind_big,
  };

  Crc crc_kind = Crc::p4;
  ImplicitId implicit_id = ImplicitId::none;
  std::endian crc_order = std::endian::big;
  HeaderField crc;
  HeaderField counter;
  HeaderField length;          ///< of the Data, in bytes
  HeaderField data_id;         ///< of all 32 bits
  HeaderField data_id_nibble;  ///< of bits 8 to 11
  HeaderField source;          ///< message type, message result and source id
  std::uint32_t id = 0;
  std::array<std::uint8_t, 16> id_list{};
  std::uint32_t min_bytes = 0;  ///< of the Data; never less than the fields need
  std::uint32_t max_bytes = 0;
  std::uint32_t counter_max = 0;
  std::uint32_t first_counter = 0;      ///< of the first message
  std::uint32_t max_delta_counter = 0;  ///< unless `early`
  std::optional<EarlySequence> early;

  /// The first byte of the Data that protect() writes to.
  [[nodiscard]] std::uint32_t header_at() const noexcept;
  /// How many bytes from there on are the E2E header; nothing if something else lies between its fields.
  [[nodiscard]] std::optional<std::uint32_t> header_bytes() const noexcept;
  [[nodiscard]] constexpr std::uint32_t next(std::uint32_t value) const noexcept {
    return value == counter_max ? 0 : value + 1;
  }
  /// How often next() leads from one to the other.
  [[nodiscard]] constexpr std::uint32_t steps(std::uint32_t from, std::uint32_t to) const noexcept {
    return to >= from ? to - from : counter_max - from + to + 1;
  }
};

/// Judges and translates a configuration.
[[nodiscard]] tl::expected<Layout, ConfigError> make_layout(const Config& config) noexcept;

/// The CRC over `front`, `data` without its CRC field, and the implicit Data ID. The fields' positions in
/// `layout` count from the beginning of `front`.
[[nodiscard]] std::uint64_t checksum(const Layout& layout, ByteView front, ByteView data,
                                     std::uint32_t counter) noexcept;

/// Reads and writes a field of `data`, which begins `front_bytes` behind the beginning of the Data. Fields of
/// 4 bits are the nibble that begins at that bit, counting a byte's bits from the low end, as AUTOSAR does.
[[nodiscard]] std::uint64_t read_field(HeaderField field, ByteView data, std::size_t front_bytes,
                                       std::endian order = std::endian::big) noexcept;
/// Writes as many of the lower bits of `value` as the field has.
void write_field(HeaderField field, ByteSpan data, std::size_t front_bytes, std::uint64_t value,
                 std::endian order = std::endian::big) noexcept;

}  // namespace trestle::someip::e2e
