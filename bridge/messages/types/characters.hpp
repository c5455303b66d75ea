#pragma once
#include <algorithm>
#include <string_view>

/// Characters of names, in ASCII, whatever the locale is.
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

}  // namespace trestle::messages
