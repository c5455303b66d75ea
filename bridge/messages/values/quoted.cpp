#include "bridge/messages/values/quoted.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <span>

#include "bridge/documents/problems.hpp"
#include "someip/wire/utf.hpp"

namespace trestle::messages {
namespace {

void append_escape(std::string& out, char32_t code) {
  switch (code) {
    case '"':
      out += "\\\"";
      return;
    case '\\':
      out += "\\\\";
      return;
    case '\n':
      out += "\\n";
      return;
    case '\r':
      out += "\\r";
      return;
    case '\t':
      out += "\\t";
      return;
    default:
      fmt::format_to(std::back_inserter(out), "\\u{:04x}", static_cast<std::uint32_t>(code));
  }
}

constexpr std::string_view replacement = "\xef\xbf\xbd";  // U+FFFD

bool is_word_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '/' ||
         c == '-' || c == '.';
}

}  // namespace

void append_quoted(std::string& out, std::string_view text) {
  out += '"';
  for (ByteView rest = std::as_bytes(std::span{text}); !rest.empty();) {
    const auto character = someip::first_utf8(rest);
    const std::size_t bytes = character ? character->bytes : 1;
    if (!character) {
      out += replacement;
    } else if (documents::is_control(character->code) || character->code == '"' || character->code == '\\') {
      append_escape(out, character->code);
    } else {
      out += text.substr(text.size() - rest.size(), bytes);
    }
    rest = rest.subspan(bytes);
  }
  out += '"';
}

bool is_plain_key(std::string_view name) {
  return !name.empty() && name.front() != '-' && std::ranges::all_of(name, is_word_character);
}

bool is_plain_yaml(std::string_view text) {
  constexpr std::array<std::string_view, 9> other_meaning{"true", "false", "null", "yes", "no",
                                                          "on",   "off",   "y",    "n"};
  if (text.empty() || text.size() > 60 || !std::ranges::all_of(text, is_word_character)) {
    return false;
  }
  const char first = text.front();
  if (!is_word_character(first) || (first >= '0' && first <= '9') || first == '-' || first == '.') {
    return false;  // could be a number, a date or a list
  }
  std::string lower{text};
  std::ranges::transform(lower, lower.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return std::ranges::find(other_meaning, lower) == other_meaning.end();
}

std::string excerpt(std::string_view text) {
  constexpr std::size_t shown_max = 60;
  std::string quoted;
  append_quoted(quoted, text.substr(0, shown_max));
  quoted.front() = quoted.back() = '\'';
  return text.size() > shown_max ? quoted + "..." : quoted;
}

}  // namespace trestle::messages
