#include "bridge/messages/types/number_text.hpp"

#include <algorithm>

namespace trestle::messages {

std::optional<Whole> read_signed(std::string_view text) {
  Whole whole;
  whole.negative = text.starts_with('-');
  if (whole.negative || text.starts_with('+')) {
    text.remove_prefix(1);
  }
  int base = 10;
  if (text.size() > 2 && text[0] == '0') {
    const char mark = text[1];
    base = mark == 'x' || mark == 'X'   ? 16
           : mark == 'o' || mark == 'O' ? 8
           : mark == 'b' || mark == 'B' ? 2
                                        : 10;
    text.remove_prefix(base == 10 ? 0 : 2);
  }
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, whole.magnitude, base);
  whole.too_large = error == std::errc::result_out_of_range;
  return stop == end && (error == std::errc{} || whole.too_large) ? std::optional{whole} : std::nullopt;
}

std::optional<double> read_special(std::string_view text) {
  const bool negative = text.starts_with('-');
  if (negative || text.starts_with('+')) {
    text.remove_prefix(1);
  }
  if (text.starts_with('.')) {
    text.remove_prefix(1);
  }
  std::string word{text.substr(0, 10)};
  std::ranges::transform(word, word.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  if (word == "nan") {
    return std::numeric_limits<double>::quiet_NaN();
  }
  if (word == "inf" || word == "infinity") {
    const double infinity = std::numeric_limits<double>::infinity();
    return negative ? -infinity : infinity;
  }
  return std::nullopt;
}

}  // namespace trestle::messages
