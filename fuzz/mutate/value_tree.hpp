#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "fuzz/mutate/typed.hpp"

namespace trestle::fuzz {

/// What is wrong with one value on purpose.
enum class Flaw : std::uint8_t {
  none,
  length,         ///< the length field has the number of `wrong`
  no_bom,         ///< a text begins without it, though it should have one
  no_terminator,  ///< a text ends without it
  bare,           ///< it has neither
  selector,       ///< the selector is that of `wrong`
  tag,            ///< likewise
};

/// A value of a payload, taken apart. It refers to its shape.
struct ValueTree {
  const Shape* shape = nullptr;
  std::uint64_t number = 0;        ///< of a number; of a choice: which part
  Bytes text{};                    ///< of a text; of a choice whose selector is not known: its data
  std::vector<ValueTree> parts{};  ///< elements; members that are there; the one part of a choice
  Flaw flaw = Flaw::none;
  std::uint32_t wrong = 0;
};

/// The values of a payload; nothing: it is not of the shape.
[[nodiscard]] std::optional<ValueTree> read_values(std::span<const std::byte> payload, const Shape& shape);

/// The payload with these values.
[[nodiscard]] Bytes write_values(const ValueTree& values);

}  // namespace trestle::fuzz
