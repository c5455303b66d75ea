#include "bridge/documents/utf8.hpp"

#include <array>
#include <span>
#include <string_view>
#include <utility>

#include "someip/wire/utf.hpp"

namespace trestle::documents {
namespace {

/// 0x80 to 0x9f in Windows-1252. It leaves five of them open: they are what ISO 8859-1 has there.
constexpr std::array<char32_t, 32> windows_1252{
    0x20ac, 0x0081, 0x201a, 0x0192, 0x201e, 0x2026, 0x2020, 0x2021, 0x02c6, 0x2030, 0x0160,
    0x2039, 0x0152, 0x008d, 0x017d, 0x008f, 0x0090, 0x2018, 0x2019, 0x201c, 0x201d, 0x2022,
    0x2013, 0x2014, 0x02dc, 0x2122, 0x0161, 0x203a, 0x0153, 0x009d, 0x017e, 0x0178};

/// Of a byte that is no ASCII.
char32_t in_windows_1252(std::byte byte) {
  const auto code = std::to_integer<char32_t>(byte);
  return code < 0xa0 ? windows_1252.at(code - 0x80) : code;
}

void append(std::string& to, char32_t code) {
  std::array<std::byte, 4> bytes{};
  someip::put_utf8(code, bytes.data());
  for (const std::byte byte : std::span{bytes}.first(someip::utf8_bytes(code))) {
    to += std::to_integer<char>(byte);
  }
}

Mark mark_at(std::string_view text, std::size_t at) {
  constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";
  Mark mark{.line = 1, .column = 1};
  for (std::size_t i = text.starts_with(byte_order_mark) ? byte_order_mark.size() : 0; i < at; ++i) {
    mark = text[i] == '\n' ? Mark{mark.line + 1, 1} : Mark{mark.line, mark.column + 1};
  }
  return mark;
}

}  // namespace

std::optional<Mark> make_utf8(std::string& text) {
  const ByteView bytes = std::as_bytes(std::span{text});
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff") || someip::is_utf8(bytes)) {
    return std::nullopt;
  }
  std::string result;
  result.reserve(text.size() + text.size() / 16);
  std::optional<Mark> first;
  for (ByteView rest = bytes; !rest.empty();) {
    const std::size_t at = bytes.size() - rest.size();
    const auto character = someip::first_utf8(rest);
    if (character) {
      result.append(text, at, character->bytes);
    } else {
      first = first ? first : mark_at(text, at);
      append(result, in_windows_1252(rest.front()));
    }
    rest = rest.subspan(character ? character->bytes : 1);
  }
  text = std::move(result);
  return first;
}

std::optional<Problem> make_utf8(std::string& text, const std::string& file) {
  const auto mark = make_utf8(text);
  if (!mark) {
    return std::nullopt;
  }
  return Problem{.severity = Problem::Severity::warning,
                 .file = file,
                 .mark = *mark,
                 .text = "here the file is not UTF-8: such bytes are taken as Windows-1252 (ISO 8859-1)"};
}

}  // namespace trestle::documents
