#pragma once
#include <charconv>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

/// Numbers as text, in the ways of YAML, JSON and .msg files.
namespace trestle::messages {

/// The shortest digits that read back as the same number, always with a point: "1.0", "1.0e+20". Not for
/// infinities and NaN.
template <std::floating_point T>
[[nodiscard]] std::string shortest(T number) {
  char room[40];
  const auto [end, error] = std::to_chars(room, room + sizeof(room), number);
  std::string text{room, end};
  if (text.find('.') == std::string::npos) {
    // YAML 1.1 takes "1e+20" for a string.
    text.insert(std::min(text.find('e'), text.size()), ".0");
  }
  return text;
}

/// Sign and magnitude of a whole number: decimal, or after "0x", "0o", "0b" in the base that it says.
struct Whole {
  bool negative = false;
  bool too_large = false;  ///< the magnitude has more than 64 bits, and is not told
  std::uint64_t magnitude = 0;
};
/// Nothing unless all of `text` is one such number.
[[nodiscard]] std::optional<Whole> read_signed(std::string_view text);

/// A whole number, or nothing when it is none or T cannot hold it.
template <std::integral T>
[[nodiscard]] std::optional<T> read_integer(std::string_view text) {
  const auto whole = read_signed(text);
  const auto most = static_cast<std::uint64_t>(std::numeric_limits<T>::max());
  const std::uint64_t least = std::is_signed_v<T> ? most + 1 : 0;
  if (!whole || whole->too_large || whole->magnitude > (whole->negative ? least : most)) {
    return std::nullopt;
  }
  return static_cast<T>(whole->negative ? std::uint64_t{0} - whole->magnitude : whole->magnitude);
}

/// "nan", "inf", "-Infinity" in all their spellings, with YAML's point or without.
[[nodiscard]] std::optional<double> read_special(std::string_view text);

/// A number in decimal notation, or one of read_special(); nothing when it is none, or one that is too large
/// or too small for T.
template <std::floating_point T>
[[nodiscard]] std::optional<T> read_float(std::string_view text) {
  if (const auto special = read_special(text)) {
    return static_cast<T>(*special);
  }
  if (text.starts_with('+')) {
    text.remove_prefix(1);
  }
  const std::string_view digits = text.substr(text.starts_with('-') ? 1 : 0);
  if (digits.empty() || (digits[0] != '.' && (digits[0] < '0' || digits[0] > '9'))) {
    return std::nullopt;
  }
  T number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc{} && end == text.data() + text.size() ? std::optional{number} : std::nullopt;
}

}  // namespace trestle::messages
