#pragma once
#include <array>
#include <bit>
#include <cstring>

#include "bridge/messages/convert/program/byte_swap.hpp"
#include "bridge/messages/convert/program/output.hpp"
#include "bridge/messages/convert/program/program.hpp"
#include "bridge/messages/convert/program/string_frame.hpp"
#include "someip/wire/bytes.hpp"
#include "someip/wire/header.hpp"
#include "someip/wire/payload_rules.hpp"

/// Small pieces of both wire formats that the two converters share.
namespace trestle::messages {

/// What stands before the body of a CDR sample.
inline constexpr std::size_t encapsulation_bytes = 4;
/// Of plain CDR in the host's byte order.
inline constexpr std::array<std::byte, encapsulation_bytes> encapsulation{
    std::byte{0}, std::byte{std::endian::native == std::endian::little ? 1U : 0U}};

/// Loads a number from four bytes without any alignment.
[[nodiscard]] inline std::uint32_t load_u32(const std::byte* from, std::endian order) noexcept {
  std::uint32_t number = 0;
  std::memcpy(&number, from, sizeof(number));
  return order == std::endian::native ? number : swapped(number);
}

/// Stores a number into four bytes without any alignment.
inline void store_u32(std::byte* to, std::uint32_t number, std::endian order) noexcept {
  number = order == std::endian::native ? number : swapped(number);
  std::memcpy(to, &number, sizeof(number));
}

/// Of the numbers of one operation.  [feat_req_someip_224]
[[nodiscard]] constexpr std::endian number_order(const someip::PayloadRules& rules, const Op& op) noexcept {
  const bool is_big = (rules.byte_order == std::endian::big) != op.other_order;
  return is_big ? std::endian::big : std::endian::little;
}

/// Whether a length field of this width can say `length`; FieldWidth::none only says 0.
[[nodiscard]] constexpr bool fits(someip::FieldWidth width, std::size_t length) noexcept {
  return length <= (std::uint64_t{1} << (8U * bytes(width))) - 1;
}

/// Stores a length that fits() into the bytes of its field; FieldWidth::none stores nothing.
__attribute__((always_inline)) inline void store_length(std::byte* to, someip::FieldWidth width,
                                                        std::size_t length, std::endian order) noexcept {
  switch (width) {
    case someip::FieldWidth::none:
      return;
    case someip::FieldWidth::bits8:
      *to = static_cast<std::byte>(length);
      return;
    case someip::FieldWidth::bits16: {
      const auto number = static_cast<std::uint16_t>(length);
      const std::uint16_t ordered = order == std::endian::native ? number : swapped(number);
      std::memcpy(to, &ordered, sizeof(ordered));
      return;
    }
    case someip::FieldWidth::bits32:
      store_u32(to, static_cast<std::uint32_t>(length), order);
  }
}

/// Loads what store_length() stored; 0 for FieldWidth::none.
[[nodiscard]] __attribute__((always_inline)) inline std::size_t load_length(const std::byte* from,
                                                                            someip::FieldWidth width,
                                                                            std::endian order) noexcept {
  switch (width) {
    case someip::FieldWidth::none:
      return 0;
    case someip::FieldWidth::bits8:
      return std::to_integer<std::size_t>(*from);
    case someip::FieldWidth::bits16: {
      std::uint16_t number = 0;
      std::memcpy(&number, from, sizeof(number));
      return order == std::endian::native ? number : swapped(number);
    }
    case someip::FieldWidth::bits32:
      return load_u32(from, order);
  }
  return 0;
}

/// Loads or stores a number of 1, 2 or 4 bytes, or of 8.
[[nodiscard]] inline std::uint64_t load_number(const std::byte* from, std::size_t width,
                                               std::endian order) noexcept {
  return width == 1   ? someip::load<std::uint8_t>(from, order)
         : width == 2 ? someip::load<std::uint16_t>(from, order)
         : width == 4 ? someip::load<std::uint32_t>(from, order)
                      : someip::load<std::uint64_t>(from, order);
}
inline void store_number(std::byte* to, std::size_t width, std::uint64_t number, std::endian order) noexcept {
  switch (width) {
    case 1:
      return someip::store(to, static_cast<std::uint8_t>(number), order);
    case 2:
      return someip::store(to, static_cast<std::uint16_t>(number), order);
    case 4:
      return someip::store(to, static_cast<std::uint32_t>(number), order);
    default:
      return someip::store(to, number, order);
  }
}

/// Bytes of padding that follow an element which ends at `position` of a payload. The alignment counts from
/// the first byte of the SOME/IP header.  [feat_req_someip_711]
[[nodiscard]] constexpr std::size_t padding(std::size_t position, std::size_t alignment) noexcept {
  return (0 - (position + someip::header_bytes)) & (alignment - 1);
}

/// Whether a tagged member that begins with this operation is a number; else it has a length field.
[[nodiscard]] constexpr bool is_number(const Op& op) noexcept {
  return op.kind == Op::Kind::numbers || op.kind == Op::Kind::bools || op.kind == Op::Kind::bits;
}

/// Whether a number's bits can hold it.
[[nodiscard]] constexpr bool has_room_for(const PackedNumber& one, std::uint64_t number) noexcept {
  const unsigned all = 8U * one.width;
  if (one.bits == 0 || one.bits >= all) {
    return true;
  }
  const std::uint64_t rest = number >> (one.bits - (one.is_signed ? 1U : 0U));
  const std::uint64_t ones = (~std::uint64_t{0} >> (64U - all)) >> (one.bits - 1U);
  return rest == 0 || (one.is_signed && rest == ones);
}

/// The bits of a number in groups of a byte, as its byte order wants them.
/// @param visit  (where the group begins in the number, how many bits it has)
template <typename Visit>
constexpr void for_each_group(const PackedNumber& one, const Visit& visit) {
  const bool is_big = one.order == std::endian::big;
  for (unsigned done = 0; done < one.bits;) {
    const unsigned left = one.bits - done;
    const unsigned part = left % 8U;
    const unsigned count = is_big && part != 0 ? part : std::min(left, 8U);
    visit(is_big ? left - count : done, count);
    done += count;
  }
}

/// Puts a number that there is room for into its bits, which are zero.
inline void put_bits(std::byte* to, const PackedNumber& one, std::uint64_t number) noexcept {
  std::size_t at = one.at;
  for_each_group(one, [&](unsigned from, unsigned count) {
    const auto group = static_cast<unsigned>(number >> from & ((1U << count) - 1U)) << at % 8U;
    to[at / 8] |= static_cast<std::byte>(group);
    if (at % 8U + count > 8U) {
      to[at / 8 + 1] |= static_cast<std::byte>(group >> 8U);
    }
    at += count;
  });
}

/// The number that put_bits() has put there.
[[nodiscard]] inline std::uint64_t bits_of(const std::byte* from, const PackedNumber& one) noexcept {
  std::size_t at = one.at;
  std::uint64_t number = 0;
  for_each_group(one, [&](unsigned to, unsigned count) {
    unsigned group = std::to_integer<unsigned>(from[at / 8]) >> at % 8U;
    if (at % 8U + count > 8U) {
      group |= std::to_integer<unsigned>(from[at / 8 + 1]) << (8U - at % 8U);
    }
    number |= std::uint64_t{group & ((1U << count) - 1U)} << to;
    at += count;
  });
  if (one.is_signed && one.bits != 0 && one.bits < 64 && (number >> (one.bits - 1U) & 1U) != 0) {
    number |= ~std::uint64_t{0} << one.bits;
  }
  return one.is_bool ? number & 1U : number;
}

/// False: some byte is neither 0 nor 1.
[[nodiscard]] inline bool all_bools(ByteView values) noexcept {
  std::byte seen{0};
  for (const std::byte value : values) {
    seen |= value;
  }
  return seen <= std::byte{1};
}

/// Whether `count` elements of `each` bytes are more than `limit`. To divide takes as long as an operation.
[[nodiscard]] constexpr bool exceed(std::uint64_t count, std::uint64_t each, std::uint64_t limit) noexcept {
  std::uint64_t bytes = 0;
  return __builtin_mul_overflow(count, each, &bytes) || bytes > limit;
}

// Writing CDR in the host's byte order.

/// Zeros up to a multiple of `width`, counted from the body's first byte.
inline void align_cdr(Output& out, std::size_t width) {
  const std::size_t size = (0 - (out.position() - encapsulation_bytes)) & (width - 1);
  std::byte* const to = out.room(size);
  for (std::size_t k = 0; k < size; ++k) {
    to[k] = std::byte{0};
  }
}

inline void write_cdr_u32(Output& out, std::uint32_t number) {
  align_cdr(out, 4);
  store_u32(out.room(4), number, std::endian::native);
}

}  // namespace trestle::messages
