#pragma once
#include <cstdint>
#include <utility>
#include <vector>

#include "bridge/messages/map/field_mapping.hpp"
#include "bridge/messages/types/message_definition.hpp"

namespace trestle::messages {

/// What was lost on the way, in messages that were carried nevertheless.
struct MapCounters {
  std::uint64_t saturated = 0;  ///< numbers that the other type cannot hold: they became its largest or least
  std::uint64_t rounded = 0;    ///< numbers that are not whole, and became the nearest one that is
  std::uint64_t not_a_number = 0;  ///< NaN, which became 0
};

/// What becomes of a number, a boolean among them. Numbers are given as the bits that they have on the wire.
struct NumberMap {
  /// "1: 22" of a table.
  struct Entry {
    std::int64_t from = 0;  ///< those of an uint64 are the same 64 bits
    std::uint64_t to = 0;
  };

  Primitive from = Primitive::uint8;
  Primitive to = Primitive::uint8;
  double scale = 1;
  double offset = 0;
  bool backwards = false;  ///< (number - offset) / scale, else scale * number + offset
  bool has_table = false;
  std::vector<Entry> table{};  ///< sorted by `from`
  Otherwise otherwise = Otherwise::error;
  std::uint64_t otherwise_bits = 0;

  /// Whether all numbers stay as they are.
  [[nodiscard]] bool is_same() const noexcept;
  /// @param bits  of the number that is given, and then of the one that it becomes.
  /// @return false: it is not in the table.
  [[nodiscard]] bool convert(std::uint64_t& bits, MapCounters& counters) const noexcept;
  /// The number whose value is `number`.
  [[nodiscard]] static std::uint64_t nearest(double number, Primitive to, MapCounters& counters) noexcept;
  /// The value of a whole number, as in a table.
  [[nodiscard]] static std::int64_t whole(std::uint64_t bits, Primitive from) noexcept;
  /// The value of any number.
  [[nodiscard]] static double value(std::uint64_t bits, Primitive from) noexcept;
};

[[nodiscard]] constexpr bool is_real(Primitive type) noexcept {
  return type == Primitive::float32 || type == Primitive::float64;
}
/// Whether there are negative ones.
[[nodiscard]] constexpr bool is_signed_whole(Primitive type) noexcept {
  return type == Primitive::int8 || type == Primitive::int16 || type == Primitive::int32 ||
         type == Primitive::int64;
}
/// Whether two primitives are the same on both wires: byte, char and uint8 are.
[[nodiscard]] constexpr bool are_same(Primitive one, Primitive other) noexcept {
  const auto plain = [](Primitive type) {
    return type == Primitive::byte || type == Primitive::character ? Primitive::uint8 : type;
  };
  return plain(one) == plain(other);
}

}  // namespace trestle::messages
