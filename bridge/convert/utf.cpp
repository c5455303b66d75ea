#include "bridge/convert/utf.hpp"

#include <array>
#include <cassert>

#include "someip/wire/bytes.hpp"

namespace trestle::bridge {
namespace {

constexpr char32_t first_high_surrogate = 0xd800;
constexpr char32_t first_low_surrogate = 0xdc00;
constexpr char32_t after_surrogates = 0xe000;
constexpr char32_t first_of_pairs = 0x10000;
constexpr char32_t last_character = 0x10ffff;

/// The character at the front of `utf8`, which it shortens by it; nothing when it is malformed.
std::optional<char32_t> next_of_utf8(ByteView& utf8) noexcept {
  const auto lead = std::to_integer<std::uint32_t>(utf8[0]);
  const std::size_t size = lead < 0x80   ? 1
                           : lead < 0xc0 ? 0
                           : lead < 0xe0 ? 2
                           : lead < 0xf0 ? 3
                           : lead < 0xf8 ? 4
                                         : 0;
  if (size == 0 || size > utf8.size()) {
    return std::nullopt;
  }
  char32_t character = size == 1 ? lead : lead & (0x7fU >> size);
  for (std::size_t i = 1; i < size; ++i) {
    const auto next = std::to_integer<std::uint32_t>(utf8[i]);
    if ((next & 0xc0U) != 0x80) {
      return std::nullopt;
    }
    character = (character << 6U) | (next & 0x3fU);
  }
  constexpr std::array<char32_t, 5> shortest{0, 0, 0x80, 0x800, first_of_pairs};  // by size
  if (character < shortest[size] || character > last_character ||
      (character >= first_high_surrogate && character < after_surrogates)) {
    return std::nullopt;
  }
  utf8 = utf8.subspan(size);
  return character;
}

std::size_t put_utf8(std::byte* to, char32_t character) noexcept {
  if (character < 0x80) {
    to[0] = static_cast<std::byte>(character);
    return 1;
  }
  const std::size_t size = character < 0x800 ? 2 : character < first_of_pairs ? 3 : 4;
  for (std::size_t i = size - 1; i > 0; --i) {
    to[i] = static_cast<std::byte>(0x80U | (character & 0x3fU));
    character >>= 6U;
  }
  to[0] = static_cast<std::byte>((0xf00U >> size) | character);
  return size;
}

}  // namespace

std::optional<std::size_t> utf8_to_utf16(ByteView utf8, std::byte* to, std::endian order) noexcept {
  std::size_t written = 0;
  const auto put = [&](char32_t unit) {
    someip::store(to + written, static_cast<std::uint16_t>(unit), order);
    written += 2;
  };
  while (!utf8.empty()) {
    const auto character = next_of_utf8(utf8);
    if (!character) {
      return std::nullopt;
    }
    if (*character < first_of_pairs) {
      put(*character);
    } else {
      put(first_high_surrogate + ((*character - first_of_pairs) >> 10U));
      put(first_low_surrogate + (*character & 0x3ffU));
    }
  }
  return written;
}

std::optional<std::size_t> utf16_to_utf8(ByteView utf16, std::byte* to, std::endian order) noexcept {
  assert(utf16.size() % 2 == 0);
  std::size_t written = 0;
  for (std::size_t at = 0; at < utf16.size(); at += 2) {
    char32_t character = someip::load<std::uint16_t>(utf16.data() + at, order);
    if (character >= first_high_surrogate && character < after_surrogates) {
      at += 2;
      if (character >= first_low_surrogate || at == utf16.size()) {
        return std::nullopt;
      }
      const char32_t low = someip::load<std::uint16_t>(utf16.data() + at, order);
      if (low < first_low_surrogate || low >= after_surrogates) {
        return std::nullopt;
      }
      character = first_of_pairs + ((character - first_high_surrogate) << 10U) + (low - first_low_surrogate);
    }
    written += put_utf8(to + written, character);
  }
  return written;
}

}  // namespace trestle::bridge
