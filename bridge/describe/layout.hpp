#pragma once
#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bridge/describe/model.hpp"

namespace trestle::describe {

/// Some bytes of a payload and what they are.
struct ByteRange {
  /// From the start of the payload, or of the element or member above with a smaller `depth`; nothing: parts
  /// of variable size stand before it.
  std::optional<std::size_t> offset{};
  std::string offset_text{};           ///< "12", "8 + name": 8 bytes and those of `name`
  std::optional<std::size_t> bytes{};  ///< nothing: as many as there are
  std::string size_text{};             ///< "4", "3 bits", "variable"
  int depth = 0;                       ///< elements of arrays and members of choices: one more
  std::string path{};                  ///< "points[1].x"; without bytes "points[].x"
  std::string type{};                  ///< "float64", "Side", "length"
  std::string rule{};                  ///< "big endian", "UTF-8 with BOM and terminator"
  std::string value{};                 ///< "1.5", "LEFT (0)", "\"abc\""; empty without bytes
};

/// Where bytes do not fit their description.
struct LayoutError {
  std::size_t offset = 0;
  std::string path{};
  std::string text{};  ///< "4 bytes are needed, 2 are left"
};

struct Layout {
  std::vector<ByteRange> ranges{};  ///< in the order of the wire
  /// With bytes: where they do not fit. Without: where the table was cut, for which limit.
  std::vector<LayoutError> errors{};
};

/// More ranges than these are not made; the rest is one range.
inline constexpr std::size_t max_ranges = 20'000;
/// Uses of types that are looked at, those without bytes among them. Structures in each other can have more
/// members than there are atoms, and none of them a byte.
inline constexpr std::size_t max_layout_uses = 200'000;
/// Bytes of all paths, which hold the names of all that a member is in.
inline constexpr std::size_t max_layout_path_bytes = std::size_t{16} << 20U;

/// The payload of a method's answer: an error of the method is its first value.
[[nodiscard]] Payload response_of(const Model& model, const Method& method);

/// Whether there is a length field or selector in it that has a byte order: one of at least two bytes.
[[nodiscard]] bool has_length_fields(const Model& model, const Payload& payload);

/// Whether there is a tagged member in it with a length field, which is not a number.
[[nodiscard]] bool has_tagged_lengths(const Model& model, const Payload& payload);

/// The widths of the length fields that tagged members have by the rules of their own types. Those without a
/// length field there are left out. What is carried has `Payload::tagged_length` before all of them.
[[nodiscard]] std::set<someip::FieldWidth> tagged_widths(const Model& model, const Payload& payload);

/// Why nobody here can send or read such a payload, for its CRC; empty: it has none.
[[nodiscard]] std::string crc_fault(const Payload& payload);

/// Whether a structure, or one that it extends, is polymorphic: there is no form for it on the wire.
[[nodiscard]] bool is_polymorphic(const Model& model, const Type& type);

/// How a payload is laid out: as a table of what may be there. Ends at the limits above; an error tells
/// which.
[[nodiscard]] Layout layout(const Model& model, const Payload& payload);

/// What the bytes of a payload are. After an error the rest of the bytes is one range.
[[nodiscard]] Layout layout(const Model& model, const Payload& payload, ByteView bytes);

}  // namespace trestle::describe
