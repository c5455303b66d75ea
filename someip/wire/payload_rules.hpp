#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>

namespace trestle::someip {

/// Bytes of a length or type field; `none` leaves the field out.
enum class FieldWidth : std::uint8_t { none = 0, bits8 = 1, bits16 = 2, bits32 = 4 };

/// How many bytes such a field takes.
[[nodiscard]] constexpr std::size_t bytes(FieldWidth width) noexcept {
  return static_cast<std::size_t>(width);
}

/// How the characters of strings are written.  [feat_req_someip_234]
enum class StringEncoding : std::uint8_t { utf8, utf16le, utf16be };

/// How the payloads of one service are laid out. The default suits the specification and what a CommonAPI
/// SOME/IP application expects when its deployment file says nothing: big endian, 32 bit length fields before
/// arrays, strings and unions, none before structs and fixed-size arrays, strings in UTF-8 with BOM and
/// terminator, no alignment. Of little endian payloads the two think differently: see commonapi_rules.
struct PayloadRules {
  /// Of all numbers, enumerations and bit fields, except where writers and readers are told otherwise of a
  /// single parameter. Tags are always big endian, UTF-16 is as `string_encoding` says.
  std::endian byte_order = std::endian::big;
  /// Length fields, and the type fields of unions, are big endian whatever the payload is
  /// [feat_req_someip_675]; else they follow `byte_order`.
  bool length_fields_always_big = true;
  FieldWidth array_length = FieldWidth::bits32;      ///< dynamic arrays; counts bytes, not elements
  FieldWidth fixed_array_length = FieldWidth::none;  ///< arrays whose size the type fixes
  FieldWidth string_length = FieldWidth::bits32;     ///< counts BOM, characters and terminator in bytes
  FieldWidth struct_length = FieldWidth::none;
  FieldWidth union_length = FieldWidth::bits32;  ///< counts the data and its padding, not the type field
  FieldWidth union_type = FieldWidth::bits32;
  bool union_length_first = true;  ///< length, type, data; else type, length, data
  bool union_null = false;         ///< type 0 is an empty union, else an error  [feat_req_someip_273]
  /// Before tagged members that are no numbers (tag.hpp), in place of the widths above; this length also
  /// counts the type field of a union.
  FieldWidth tagged_length = FieldWidth::bits32;
  /// Writers choose the smallest length field that does, and the tag announces it; else `tagged_length`.
  /// Readers understand both.
  bool smallest_tagged_length = false;
  /// Elements that an array has beyond those that the interface knows are skipped by the array's length
  /// field [feat_req_someipcompat_1199]; else they are an error.
  bool cut_longer_arrays = true;
  StringEncoding string_encoding = StringEncoding::utf8;
  bool string_bom = true;
  bool string_terminator = true;
  /// An element of variable length (string, array or union with a length field) is followed by zeros up to a
  /// multiple of this many bytes from the start of the message, header included; 0 and 1 are none. Its own
  /// length field does not count them, that of what holds it does. Readers do without them at the end of what
  /// holds the element. Tags and alignment exclude each other.  [feat_req_someip_711] [feat_req_someip_239]
  std::uint8_t alignment = 1;
  friend constexpr bool operator==(const PayloadRules&, const PayloadRules&) = default;
};

/// CommonAPI's: its length and type fields follow the byte order that the deployment file sets.
inline constexpr PayloadRules commonapi_rules{.length_fields_always_big = false};

}  // namespace trestle::someip
