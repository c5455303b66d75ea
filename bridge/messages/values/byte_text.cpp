#include "bridge/messages/values/byte_text.hpp"

#include <algorithm>

namespace trestle::messages {
namespace {

constexpr std::string_view hex_alphabet = "0123456789abcdef";
constexpr std::string_view base64_alphabet =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

std::optional<unsigned> hex_digit(char c) {
  const char lower = c >= 'A' && c <= 'F' ? static_cast<char>(c - 'A' + 'a') : c;
  const auto at = hex_alphabet.find(lower);
  return at == std::string_view::npos ? std::nullopt : std::optional{static_cast<unsigned>(at)};
}

}  // namespace

void append_hex(std::string& out, ByteView bytes) {
  for (const std::byte byte : bytes) {
    out += hex_alphabet[std::to_integer<unsigned>(byte) >> 4U];
    out += hex_alphabet[std::to_integer<unsigned>(byte) & 15U];
  }
}

std::optional<std::vector<std::byte>> from_hex(std::string_view digits) {
  if (digits.size() % 2 != 0) {
    return std::nullopt;
  }
  std::vector<std::byte> bytes(digits.size() / 2);
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    const auto high = hex_digit(digits[2 * at]);
    const auto low = hex_digit(digits[2 * at + 1]);
    if (!high || !low) {
      return std::nullopt;
    }
    bytes[at] = static_cast<std::byte>(*high * 16 + *low);
  }
  return bytes;
}

void append_base64(std::string& out, ByteView bytes) {
  while (!bytes.empty()) {
    const std::size_t size = std::min<std::size_t>(3, bytes.size());
    unsigned bits = 0;
    for (std::size_t at = 0; at < 3; ++at) {
      bits = bits << 8U | (at < size ? std::to_integer<unsigned>(bytes[at]) : 0U);
    }
    for (std::size_t at = 0; at < 4; ++at) {
      out += at <= size ? base64_alphabet[bits >> (6 * (3 - at)) & 63U] : '=';
    }
    bytes = bytes.subspan(size);
  }
}

std::optional<std::vector<std::byte>> from_base64(std::string_view text) {
  std::vector<std::byte> bytes;
  unsigned bits = 0;
  std::size_t digits = 0;
  std::size_t padding = 0;
  for (const char c : text) {
    if (c == ' ' || c == '\n' || c == '\r' || c == '\t') {
      continue;
    }
    if (c == '=') {
      ++padding;
      continue;
    }
    const auto at = base64_alphabet.find(c);
    if (at == std::string_view::npos || padding > 0) {
      return std::nullopt;
    }
    bits = bits << 6U | static_cast<unsigned>(at);
    if (++digits % 4 != 1) {
      // The 2nd, 3rd and 4th digit each complete a byte, and leave 4, 2 and 0 bits.
      const unsigned left = 2 * (3 - (digits - 1) % 4);
      bytes.push_back(static_cast<std::byte>(bits >> left & 0xffU));
      bits &= (1U << left) - 1;
    }
  }
  const std::size_t last = digits % 4;
  // Remaining bits must be zero, because they would be lost.
  if (last == 1 || bits != 0 || (padding != 0 && (last + padding) != 4)) {
    return std::nullopt;
  }
  return bytes;
}

}  // namespace trestle::messages
