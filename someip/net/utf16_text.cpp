#include "someip/net/utf16_text.hpp"

#include <array>

#include "someip/wire/utf.hpp"

namespace trestle::someip {

std::string to_utf8(std::u16string_view text) {
  std::string result;
  result.reserve(text.size());
  for (ByteView rest = std::as_bytes(std::span{text}); !rest.empty();) {
    const auto character = first_utf16(rest, std::endian::native);
    if (!character) {
      result += '\xff';
      break;
    }
    std::array<char, 4> bytes{};
    put_utf8(character->code, std::as_writable_bytes(std::span{bytes}).data());
    result.append(bytes.data(), utf8_bytes(character->code));
    rest = rest.subspan(character->bytes);
  }
  return result;
}

std::u16string to_utf16(std::string_view text) {
  std::u16string result;
  result.reserve(text.size());
  ByteView rest = std::as_bytes(std::span{text});
  while (const auto character = first_utf8(rest)) {
    std::array<char16_t, 2> units{};
    put_utf16(character->code, std::as_writable_bytes(std::span{units}).data(), std::endian::native);
    result.append(units.data(), utf16_bytes(character->code) / sizeof(char16_t));
    rest = rest.subspan(character->bytes);
  }
  return result;
}

}  // namespace trestle::someip
