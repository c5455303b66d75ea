#include "bridge/describe/read/fidl/lexer.hpp"

#include <algorithm>

#include "bridge/documents/problems.hpp"

namespace trestle::describe::fidl {
namespace {

constexpr bool is_digit(char c) {
  return c >= '0' && c <= '9';
}
constexpr bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}
constexpr bool is_hex_digit(char c) {
  return is_digit(c) || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
}

/// How many characters from `at` on are of a kind.
template <typename Is>
std::size_t run(std::string_view text, std::size_t at, Is is) {
  std::size_t end = at;
  while (end < text.size() && is(text[end])) {
    ++end;
  }
  return end - at;
}

}  // namespace

Lexer::Lexer(std::string_view text) : text_{text} {
  if (text_.starts_with("\xef\xbb\xbf")) {
    text_.remove_prefix(3);
  }
  const bool is_utf16 = text_.starts_with("\xff\xfe") || text_.starts_with("\xfe\xff");
  text_ = is_utf16 ? std::string_view{} : text_;
  for (Token& token : next_) {
    token = cut();
  }
  if (is_utf16) {
    next_.front() = bad("the file is UTF-16, and UTF-8 was expected: save it as that");
  }
}

Token Lexer::take() {
  const Token token = next_[0];
  std::ranges::move(next_.begin() + 1, next_.end(), next_.begin());
  next_.back() = cut();
  return token;
}

void Lexer::stop() {
  text_ = {};
  next_.fill({Token::Kind::end, {}, next_.front().mark, false});
}

void Lexer::skip(std::size_t bytes) {
  for (const char c : text_.substr(0, bytes)) {
    if (c == '\n') {
      ++mark_.line;
      mark_.column = 1;
    } else {
      ++mark_.column;
    }
  }
  text_.remove_prefix(std::min(bytes, text_.size()));
}

Token Lexer::cut(Token::Kind kind, std::size_t bytes) {
  const Token token{kind, text_.substr(0, bytes), mark_, false};
  skip(bytes);
  return token;
}

Token Lexer::bad(std::string_view text) const {
  return {Token::Kind::bad, text, mark_, false};
}

bool Lexer::skip_blanks(Token& into) {
  for (;;) {
    skip(run(text_, 0, [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\f'; }));
    if (text_.starts_with("//")) {
      skip(std::min(text_.find('\n'), text_.size()));
    } else if (text_.starts_with("/*")) {
      const std::size_t end = text_.find("*/", 2);
      if (end == std::string_view::npos) {
        into = bad("the comment that begins here never ends; expected */");
        skip(text_.size());
        return false;
      }
      skip(end + 2);
    } else if (text_.empty()) {
      into = {Token::Kind::end, {}, mark_, false};
      return false;
    } else {
      return true;
    }
  }
}

std::size_t Lexer::number_length() const {
  if (text_.size() > 2 && text_[0] == '0' &&
      (text_[1] == 'x' || text_[1] == 'X' || text_[1] == 'b' || text_[1] == 'B')) {
    return 2 + run(text_, 2, is_hex_digit);
  }
  std::size_t length = run(text_, 0, is_digit);
  if (length + 1 < text_.size() && text_[length] == '.' && is_digit(text_[length + 1])) {
    length += 1 + run(text_, length + 1, is_digit);
    if (length < text_.size() && (text_[length] == 'e' || text_[length] == 'E')) {
      const std::size_t sign =
          length + 1 < text_.size() && (text_[length + 1] == '-' || text_[length + 1] == '+') ? 1 : 0;
      if (const std::size_t digits = run(text_, length + 1 + sign, is_digit); digits > 0) {
        length += 1 + sign + digits;
      }
    }
    if (length < text_.size() && (text_[length] == 'd' || text_[length] == 'f') &&
        (length + 1 == text_.size() || !(is_letter(text_[length + 1]) || is_digit(text_[length + 1])))) {
      ++length;
    }
  }
  return length;
}

Token Lexer::cut() {
  Token token;
  if (!skip_blanks(token)) {
    return token;
  }
  if (text_.starts_with("<**")) {
    const std::size_t end = text_.find("**>", 3);
    if (end == std::string_view::npos) {
      token = bad("the annotations that begin here never end; expected **>");
      skip(text_.size());
      return token;
    }
    token = cut(Token::Kind::annotation, end + 3);
    token.text = token.text.substr(3, token.text.size() - 6);
    return token;
  }
  const char first = text_.front();
  if (first == '"' || first == '\'') {
    std::size_t end = 1;
    while (end < text_.size() && text_[end] != first) {
      end += text_[end] == '\\' ? 2 : 1;
    }
    if (end >= text_.size()) {
      token = bad("the text that begins here never ends; expected another quote");
      skip(text_.size());
      return token;
    }
    return cut(Token::Kind::string, end + 1);
  }
  const std::size_t escape = first == '^' ? 1 : 0;
  if (escape < text_.size() && is_letter(text_[escape])) {
    const documents::Mark mark = mark_;
    skip(escape);
    token = cut(Token::Kind::word, run(text_, 0, [](char c) { return is_letter(c) || is_digit(c); }));
    token.mark = mark;
    token.escaped = escape != 0;
    return token;
  }
  if (is_digit(first)) {
    return cut(Token::Kind::number, number_length());
  }
  for (const std::string_view sign : {"->", "=>", "==", "!=", "<=", ">=", "&&", "||"}) {
    if (text_.starts_with(sign)) {
      return cut(Token::Kind::sign, sign.size());
    }
  }
  if (static_cast<unsigned char>(first) < 0x20 || static_cast<unsigned char>(first) >= 0x7f) {
    token = bad("there is a character that has no meaning outside of comments and texts");
    skip(run(text_, 0, [](char c) {
      return (static_cast<unsigned char>(c) < 0x20 && c != '\n') || static_cast<unsigned char>(c) >= 0x7f;
    }));
    return token;
  }
  return cut(Token::Kind::sign, 1);
}

std::string unquoted(std::string_view token) {
  std::string text;
  token = token.substr(1, token.size() - 2);
  for (std::size_t at = 0; at < token.size(); ++at) {
    if (token[at] != '\\' || at + 1 == token.size()) {
      text += token[at];
      continue;
    }
    switch (token[++at]) {
      case 'n':
        text += '\n';
        break;
      case 't':
        text += '\t';
        break;
      case 'r':
        text += '\r';
        break;
      case 'b':
        text += '\b';
        break;
      case 'f':
        text += '\f';
        break;
      default:
        text += token[at];
    }
  }
  return text;
}

std::string shown(const Token& token) {
  switch (token.kind) {
    case Token::Kind::end:
      return "the end of the file";
    case Token::Kind::annotation:
      return "an annotation <** … **>";
    case Token::Kind::bad:
      return std::string{token.text};
    case Token::Kind::word:
    case Token::Kind::number:
    case Token::Kind::string:
    case Token::Kind::sign:
      break;
  }
  return documents::quote(token.text);
}

}  // namespace trestle::describe::fidl
