#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

/// Characters of names and blanks, in ASCII, whatever the locale is.
namespace trestle::messages {

[[nodiscard]] constexpr bool is_letter(char c) noexcept {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}
[[nodiscard]] constexpr bool is_digit(char c) noexcept {
  return c >= '0' && c <= '9';
}
/// A letter, a digit or '_'.
[[nodiscard]] constexpr bool is_in_word(char c) noexcept {
  return is_letter(c) || is_digit(c) || c == '_';
}
/// A letter with such characters behind it.
[[nodiscard]] constexpr bool is_identifier(std::string_view text) noexcept {
  return !text.empty() && is_letter(text.front()) && std::ranges::all_of(text, is_in_word);
}

/// Appends a character of Unicode in UTF-8.
inline void append_utf8(std::string& text, std::uint32_t character) {
  const auto put = [&text](std::uint32_t byte) { text += static_cast<char>(byte); };
  const auto put_low_bits = [&](std::uint32_t shift) { put(0x80U | ((character >> shift) & 0x3fU)); };
  if (character < 0x80) {
    put(character);
  } else if (character < 0x800) {
    put(0xc0U | (character >> 6U));
    put_low_bits(0);
  } else if (character < 0x10000) {
    put(0xe0U | (character >> 12U));
    put_low_bits(6);
    put_low_bits(0);
  } else {
    put(0xf0U | (character >> 18U));
    put_low_bits(12);
    put_low_bits(6);
    put_low_bits(0);
  }
}
/// Without the blanks at both ends.
[[nodiscard]] constexpr std::string_view trimmed(std::string_view text,
                                                 std::string_view blank = " \t") noexcept {
  const std::size_t first = text.find_first_not_of(blank);
  return first == std::string_view::npos ? std::string_view{}
                                         : text.substr(first, text.find_last_not_of(blank) - first + 1);
}

}  // namespace trestle::messages
