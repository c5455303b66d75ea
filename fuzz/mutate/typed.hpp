#pragma once
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "fuzz/mutate/mutate.hpp"
#include "fuzz/mutate/random.hpp"

namespace trestle::fuzz {

/// What a value in a payload is, and how it stands there. Lengths of fields are in bytes: 1, 2 or 4; 0: there
/// is none.
struct Shape {
  /// What it is made of.
  enum class Kind : std::uint8_t {
    number,     ///< also a boolean or an enumeration
    text,       ///< a string
    list,       ///< an array, a map or a byte buffer: of parts[0]
    structure,  ///< parts, one after another; those with a tag may come in any order
    choice,     ///< a union: one of the parts
  };
  /// Of the characters of a text.
  enum class Encoding : std::uint8_t { utf8, utf16le, utf16be };

  Kind kind = Kind::structure;
  std::endian order = std::endian::big;         ///< of a number
  std::endian length_order = std::endian::big;  ///< of the length field, and of the selector
  std::uint8_t bytes = 1;                       ///< of a number: 1, 2, 4, 8
  std::uint8_t bits = 0;                        ///< of a number in a packed row of bits; 0: whole bytes
  bool is_float = false;                        ///< a number of 4 or 8 bytes
  std::vector<std::uint64_t> known{};           ///< the values that a number may have; empty: all
  std::uint8_t length = 0;                      ///< the field in front that counts the bytes behind it
  std::uint8_t selector = 4;                    ///< of a choice: the field that says which
  bool length_first = true;                     ///< of a choice: in front of the selector
  bool length_counts_selector = false;          ///< of a choice: as that of a tagged member does
  std::vector<std::uint32_t> selectors{};       ///< of a choice: that of each part
  /// Of a text, with BOM and terminator; of a choice without length field, of its data: filled up with zeros.
  /// 0: as many as there are.
  std::uint32_t fixed_bytes = 0;
  Encoding encoding = Encoding::utf8;
  bool bom = false;
  bool terminator = false;
  std::uint32_t fewest = 0;                                        ///< elements of a list
  std::uint32_t most = std::numeric_limits<std::uint32_t>::max();  ///< elements of a list, bytes of a text
  /// Behind a list, text or choice with a length field: zeros up to a multiple of so many bytes from the
  /// first byte of the header.
  std::uint8_t alignment = 1;
  std::optional<std::uint16_t> tag{};  ///< of a member of a structure: wire type and data id
  bool optional = false;               ///< it may be missing; only with a tag
  std::vector<Shape> parts{};          ///< of a list one, of a choice at least one
};

/// A payload with values of this shape: most of them right, some at an edge, a few beyond.
/// @param max_bytes  it is cut behind so many.
[[nodiscard]] Bytes make_payload(const Shape& shape, std::size_t max_bytes, Random& random);

/// Changes one thing in a payload: a value, a length, a selector, how many elements there are, whether a
/// member is there, the BOM or terminator of a text. A payload that is not of the shape becomes a new one.
/// @param max_bytes  it is cut behind so many.
void mutate_payload(Bytes& payload, const Shape& shape, std::size_t max_bytes, Random& random);

/// Payloads in each of which one thing is wrong, each that can be once: lengths that are too large, too
/// small, 0 or without bound; selectors and tags that are not known; texts without BOM, terminator or both.
/// @param max_bytes  they are cut behind so many.
/// @return at most 100.
[[nodiscard]] std::vector<Bytes> make_spoilt_payloads(const Shape& shape, std::size_t max_bytes,
                                                      Random& random);

/// Whether the bytes are those of a payload of this shape, but for values.
[[nodiscard]] bool has_shape(std::span<const std::byte> payload, const Shape& shape);

}  // namespace trestle::fuzz
