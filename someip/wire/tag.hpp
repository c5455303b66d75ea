#pragma once
#include <cstdint>
#include <optional>

#include "someip/wire/payload_rules.hpp"

/// Tags: what stands before each member of a struct or message whose members may be left out, come in any
/// order, or be unknown to the receiver ("TLV"). The Open SOME/IP Specification has none; this is the form of
/// AUTOSAR's "structured datatypes and arguments with identifier and optional members".
namespace trestle::someip {

/// Names a member within its struct or message: 0 to 0xfff, unique there.
enum class DataId : std::uint16_t {};
inline constexpr std::uint16_t max_data_id = 0x0fff;

/// Says how a receiver that does not know the member finds its end.
enum class WireType : std::uint8_t {
  bits8 = 0,   ///< boolean, 8 bit integer or enumeration
  bits16 = 1,  ///< number of 16 bits
  bits32 = 2,  ///< number of 32 bits
  bits64 = 3,  ///< number of 64 bits
  /// String, array, struct or union behind a length field whose width is configured: `tagged_length`.
  configured_length = 4,
  length8 = 5,  ///< the same behind a length field of 8 bits, whatever is configured
  length16 = 6,
  length32 = 7,
};

/// The bytes of a tag, always big endian.
inline constexpr std::size_t tag_bytes = 2;

/// The tag in front of a member of a struct with data ids (TLV).
struct Tag {
  WireType type{};
  DataId id{};
  friend constexpr bool operator==(const Tag&, const Tag&) = default;
};

/// The 16 bits of a tag: a reserved one, 3 of wire type, 12 of data id.
[[nodiscard]] constexpr std::uint16_t to_number(Tag tag) noexcept {
  return static_cast<std::uint16_t>((static_cast<unsigned>(tag.type) << 12U) |
                                    (static_cast<unsigned>(tag.id) & max_data_id));
}
/// The reserved bit is ignored.
[[nodiscard]] constexpr Tag to_tag(std::uint16_t number) noexcept {
  return {WireType{static_cast<std::uint8_t>((number >> 12U) & 7U)},
          DataId{static_cast<std::uint16_t>(number & max_data_id)}};
}

/// The wire type of a number of 1, 2, 4 or 8 bytes.
[[nodiscard]] constexpr WireType number_type(std::size_t bytes) noexcept {
  return bytes == 1   ? WireType::bits8
         : bytes == 2 ? WireType::bits16
         : bytes == 4 ? WireType::bits32
                      : WireType::bits64;
}
/// How many bytes a member of a number's type has; nothing for a type with a length field.
[[nodiscard]] constexpr std::optional<std::size_t> number_bytes(WireType type) noexcept {
  return type <= WireType::bits64 ? std::optional{std::size_t{1} << static_cast<unsigned>(type)}
                                  : std::nullopt;
}

/// The wire type that announces a length field of this width.
[[nodiscard]] constexpr WireType length_type(FieldWidth width) noexcept {
  return width == FieldWidth::bits8    ? WireType::length8
         : width == FieldWidth::bits16 ? WireType::length16
                                       : WireType::length32;
}
/// The width of the length field behind a tag of a type that has one.
[[nodiscard]] constexpr FieldWidth length_width(WireType type, const PayloadRules& rules) noexcept {
  return type == WireType::length8    ? FieldWidth::bits8
         : type == WireType::length16 ? FieldWidth::bits16
         : type == WireType::length32 ? FieldWidth::bits32
                                      : rules.tagged_length;
}

/// The smallest field that can say `length`.
[[nodiscard]] constexpr FieldWidth smallest_width(std::size_t length) noexcept {
  return length <= 0xff ? FieldWidth::bits8 : length <= 0xffff ? FieldWidth::bits16 : FieldWidth::bits32;
}

}  // namespace trestle::someip
