#include "someip/wire/utf.hpp"

#include "someip/wire/bytes.hpp"

namespace trestle::someip {
namespace {

constexpr char32_t first_surrogate = 0xd800;
constexpr char32_t first_low_surrogate = 0xdc00;
constexpr char32_t after_surrogates = 0xe000;
constexpr char32_t after_last_code = 0x110000;
constexpr char32_t first_supplementary = 0x10000;

constexpr bool is_surrogate(char32_t code) noexcept {
  return code >= first_surrogate && code < after_surrogates;
}

constexpr std::byte low_bits(char32_t code, unsigned shift, unsigned mask, unsigned mark) noexcept {
  return static_cast<std::byte>(((code >> shift) & mask) | mark);
}

}  // namespace

std::optional<Character> first_utf8(ByteView text) noexcept {
  if (text.empty()) {
    return std::nullopt;
  }
  const auto lead = std::to_integer<char32_t>(text[0]);
  if (lead < 0x80) {
    return Character{lead, 1};
  }
  const std::size_t size = lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : 2;
  if (lead < 0xc2 || lead > 0xf4 || text.size() < size) {
    return std::nullopt;
  }
  char32_t code = lead & (0x7fU >> size);
  for (const std::byte next : text.subspan(1, size - 1)) {
    if ((next & std::byte{0xc0}) != std::byte{0x80}) {
      return std::nullopt;
    }
    code = (code << 6U) | std::to_integer<char32_t>(next & std::byte{0x3f});
  }
  if (utf8_bytes(code) != size || is_surrogate(code) || code >= after_last_code) {
    return std::nullopt;
  }
  return Character{code, size};
}

std::optional<Character> first_utf16(ByteView text, std::endian order) noexcept {
  if (text.size() < 2) {
    return std::nullopt;
  }
  const char32_t high = load<std::uint16_t>(text.data(), order);
  if (!is_surrogate(high)) {
    return Character{high, 2};
  }
  if (high >= first_low_surrogate || text.size() < 4) {
    return std::nullopt;
  }
  const char32_t low = load<std::uint16_t>(text.data() + 2, order);
  if (low < first_low_surrogate || low >= after_surrogates) {
    return std::nullopt;
  }
  return Character{first_supplementary + ((high - first_surrogate) << 10U) + (low - first_low_surrogate), 4};
}

bool is_utf8(ByteView text) noexcept {
  while (!text.empty()) {
    const auto character = first_utf8(text);
    if (!character) {
      return false;
    }
    text = text.subspan(character->bytes);
  }
  return true;
}

void put_utf8(char32_t code, std::byte* to) noexcept {
  switch (utf8_bytes(code)) {
    case 1:
      to[0] = low_bits(code, 0, 0x7f, 0);
      return;
    case 2:
      to[0] = low_bits(code, 6, 0x1f, 0xc0);
      to[1] = low_bits(code, 0, 0x3f, 0x80);
      return;
    case 3:
      to[0] = low_bits(code, 12, 0x0f, 0xe0);
      to[1] = low_bits(code, 6, 0x3f, 0x80);
      to[2] = low_bits(code, 0, 0x3f, 0x80);
      return;
    default:
      to[0] = low_bits(code, 18, 0x07, 0xf0);
      to[1] = low_bits(code, 12, 0x3f, 0x80);
      to[2] = low_bits(code, 6, 0x3f, 0x80);
      to[3] = low_bits(code, 0, 0x3f, 0x80);
  }
}

void put_utf16(char32_t code, std::byte* to, std::endian order) noexcept {
  if (code < first_supplementary) {
    store(to, static_cast<std::uint16_t>(code), order);
    return;
  }
  const char32_t rest = code - first_supplementary;
  store(to, static_cast<std::uint16_t>(first_surrogate + (rest >> 10U)), order);
  store(to + 2, static_cast<std::uint16_t>(first_low_surrogate + (rest & 0x3ffU)), order);
}

}  // namespace trestle::someip
