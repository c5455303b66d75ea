#include "bridge/documents/hex_line.hpp"

#include <optional>

namespace trestle::documents {
namespace {

std::optional<unsigned> digit_value(char digit) noexcept {
  if (digit >= '0' && digit <= '9') {
    return static_cast<unsigned>(digit - '0');
  }
  if (digit >= 'a' && digit <= 'f') {
    return static_cast<unsigned>(digit - 'a' + 10);
  }
  if (digit >= 'A' && digit <= 'F') {
    return static_cast<unsigned>(digit - 'A' + 10);
  }
  return std::nullopt;
}

bool is_separator(char character) noexcept {
  return std::string_view{" \t\r:-,"}.find(character) != std::string_view::npos;
}

}  // namespace

tl::expected<std::vector<std::byte>, std::size_t> parse_hex_line(std::string_view line) {
  std::vector<std::byte> bytes;
  for (std::size_t at = 0; at < line.size();) {
    if (is_separator(line[at])) {
      ++at;
      continue;
    }
    const std::string_view next = line.substr(at, 2);
    if (next == "0x" || next == "0X") {
      at += 2;
    }
    const auto high = at < line.size() ? digit_value(line[at]) : std::nullopt;
    if (!high) {
      return tl::unexpected{at};
    }
    const auto low = at + 1 < line.size() ? digit_value(line[at + 1]) : std::nullopt;
    if (!low) {
      return tl::unexpected{at + 1};
    }
    bytes.push_back(static_cast<std::byte>(*high * 16 + *low));
    at += 2;
  }
  return bytes;
}

}  // namespace trestle::documents
