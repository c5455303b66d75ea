#pragma once
#include <array>

#include "someip/wire/payload_rules.hpp"
#include "someip/wire/types.hpp"

namespace fuzz {

using trestle::ByteView;

/// What the fuzzer gives, byte for byte; 0xff once that is used up.
class Input {
 public:
  explicit Input(ByteView bytes) : bytes_{bytes} {}
  unsigned next() {
    if (bytes_.empty()) {
      return 0xff;
    }
    const auto byte = std::to_integer<unsigned>(bytes_[0]);
    bytes_ = bytes_.subspan(1);
    return byte;
  }
  [[nodiscard]] ByteView rest() const { return bytes_; }

 private:
  ByteView bytes_;
};

/// Rules of any kind, out of 4 bytes.
inline trestle::someip::PayloadRules payload_rules(Input& in) {
  using trestle::someip::FieldWidth;
  using trestle::someip::StringEncoding;
  constexpr std::array widths{FieldWidth::none, FieldWidth::bits8, FieldWidth::bits16, FieldWidth::bits32};
  const unsigned a = in.next();
  const unsigned b = in.next();
  const unsigned c = in.next();
  const unsigned d = in.next();
  return {.byte_order = (a & 1U) != 0 ? std::endian::little : std::endian::big,
          .length_fields_always_big = (a & 2U) != 0,
          .array_length = widths[1 + (a >> 2U) % 3],
          .fixed_array_length = widths[(a >> 4U) % 4],
          .string_length = widths[1 + (b & 3U) % 3],
          .struct_length = widths[(b >> 2U) % 4],
          .union_length = widths[(b >> 4U) % 4],
          .union_type = widths[1 + (c & 3U) % 3],
          .union_length_first = (c & 4U) != 0,
          .union_null = (d / 6 & 1U) != 0,
          .tagged_length = widths[(d / 12) % 4],
          .smallest_tagged_length = (d / 48 & 1U) != 0,
          .cut_longer_arrays = (d / 96 & 1U) == 0,
          .string_encoding = StringEncoding{static_cast<std::uint8_t>((c >> 3U) % 3)},
          .string_bom = (c & 0x20U) != 0,
          .string_terminator = (c & 0x40U) != 0,
          .alignment = static_cast<std::uint8_t>(d % 8 == 7 ? 0U : 1U << (d % 8))};
}

}  // namespace fuzz
