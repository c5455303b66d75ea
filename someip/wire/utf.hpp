#pragma once
#include <bit>
#include <optional>
#include <string_view>

#include "someip/wire/types.hpp"

namespace trestle::someip {

/// At the start of each text on the wire.  [feat_req_someip_662]
inline constexpr char32_t byte_order_mark = 0xfeff;

/// The well-formed character at the front of a text, and how many bytes it takes there.
struct Character {
  char32_t code;
  std::size_t bytes;
};

/// @return nothing when `text` is empty or does not begin with a well-formed character: overlong forms,
///         surrogates in UTF-8, lone surrogates in UTF-16 and what lies beyond U+10FFFF are none.
[[nodiscard]] std::optional<Character> first_utf8(ByteView text) noexcept;
[[nodiscard]] std::optional<Character> first_utf16(ByteView text, std::endian order) noexcept;

/// Whether all of `text` is well-formed characters; an empty one is.
[[nodiscard]] bool is_utf8(ByteView text) noexcept;

[[nodiscard]] constexpr std::size_t utf8_bytes(char32_t code) noexcept {
  return code < 0x80 ? 1 : code < 0x800 ? 2 : code < 0x10000 ? 3 : 4;
}
[[nodiscard]] constexpr std::size_t utf16_bytes(char32_t code) noexcept {
  return code < 0x10000 ? 2 : 4;
}

/// Writes a character to the front of `to`, which has room for it.
void put_utf8(char32_t code, std::byte* to) noexcept;
void put_utf16(char32_t code, std::byte* to, std::endian order) noexcept;

}  // namespace trestle::someip
