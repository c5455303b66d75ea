#include "bridge/describe/read/fidl/cursor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "bridge/documents/section.hpp"

namespace trestle::describe::fidl {
namespace {

constexpr std::size_t longest_name = 1000;

}  // namespace

Token Cursor::take() {
  if (count_.taken == count_.most && !at_end()) {
    findings_.error(here(), fmt::format("there is too much in the FIDL and FDEPL files; expected at most {} "
                                        "words, numbers and signs in all of them",
                                        count_.most));
    count_.too_many = true;
    lost_ = true;
    lexer_.stop();
  }
  count_.taken += at_end() ? 0 : 1;
  const Token token = lexer_.take();
  if (token.kind == Token::Kind::sign) {
    depth_ += token.text == "{" ? 1 : token.text == "}" ? -1 : 0;
  } else if (token.kind == Token::Kind::bad) {
    findings_.error(place(token), std::string{token.text});
  }
  return token;
}

bool Cursor::take_if(std::string_view word) {
  if (!at(word)) {
    return false;
  }
  take();
  return true;
}

bool Cursor::expect(std::string_view word, std::string_view where) {
  if (take_if(word)) {
    return true;
  }
  fail(fmt::format("'{}' {}", word, where));
  return false;
}

Name Cursor::name(std::string_view what, const std::vector<std::string>& keywords) {
  if (!at(Token::Kind::word)) {
    fail(what);
    return {};
  }
  const Token token = take();
  Name name{std::string{token.text.substr(0, longest_name)}, place(token), token.escaped, {}};
  if (!token.escaped && std::ranges::binary_search(keywords, name.text)) {
    findings_.warning(
        name.place,
        fmt::format("'{0}' is a keyword and should be written ^{0}; it is read as {1}", name.text, what));
  }
  return name;
}

Name Cursor::dotted(std::string_view what) {
  if (!at(Token::Kind::word)) {
    fail(what);
    return {};
  }
  const Token first = take();
  Name name{std::string{first.text}, place(first), first.escaped, {}};
  while (at(".") && peek(1).kind == Token::Kind::word) {
    take();
    const Token part = take();
    if (name.text.size() + part.text.size() > longest_name) {
      findings_.error(place(part), "the name is longer than 1000 characters");
      lost_ = true;
      return {};
    }
    name.text += '.';
    name.text += part.text;
  }
  return name;
}

std::string Cursor::text(std::string_view what) {
  if (!at(Token::Kind::string)) {
    fail(what);
    return {};
  }
  return unquoted(take().text);
}

std::optional<std::int64_t> Cursor::whole(std::string_view what) {
  const bool negative = at("-") && peek(1).kind == Token::Kind::number;
  if (negative) {
    take();
  }
  if (at(Token::Kind::number)) {
    if (const auto number = to_whole(peek().text)) {
      take();
      return negative ? static_cast<std::int64_t>(0 - static_cast<std::uint64_t>(*number)) : *number;
    }
  }
  fail(what);
  return std::nullopt;
}

void Cursor::fail(std::string_view expected) {
  if (lost_) {
    return;
  }
  lost_ = true;
  if (peek().kind == Token::Kind::bad) {
    take();
  } else {
    findings_.error(here(), fmt::format("there is {}; expected {}", shown(peek()), expected));
  }
}

std::optional<std::int64_t> to_whole(std::string_view number) {
  int base = 10;
  if (number.size() > 2 && number[0] == '0' && (number[1] == 'x' || number[1] == 'X')) {
    base = 16;
  } else if (number.size() > 2 && number[0] == '0' && (number[1] == 'b' || number[1] == 'B')) {
    base = 2;
  }
  number.remove_prefix(base == 10 ? 0 : 2);
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), value, base);
  if (error != std::errc{} || end != number.data() + number.size()) {
    return std::nullopt;
  }
  return static_cast<std::int64_t>(value);
}

std::string hint(std::string_view word, const std::vector<std::string>& known) {
  const std::string likely = documents::nearest(word, known);
  return likely.empty() ? "" : fmt::format("; did you mean '{}'?", likely);
}

}  // namespace trestle::describe::fidl
