#include "bridge/messages/types/idl_lexer.hpp"

#include <algorithm>
#include <charconv>

#include "bridge/messages/types/characters.hpp"

namespace trestle::messages {
namespace {

/// The number of characters at the front that are of this kind.
template <typename Kind>
std::size_t run(std::string_view text, Kind kind) {
  return static_cast<std::size_t>(std::ranges::find_if_not(text, kind) - text.begin());
}

/// The size of the number at the front: "0x1f", "1.5", ".5e-3".
std::size_t number_size(std::string_view text) {
  std::size_t size = run(text, [](char c) { return is_in_word(c) || c == '.'; });
  const bool exponent = size > 0 && size < text.size() && (text[size - 1] == 'e' || text[size - 1] == 'E') &&
                        (text[size] == '-' || text[size] == '+');
  if (exponent && !text.starts_with("0x") && !text.starts_with("0X")) {
    size += 1 + run(text.substr(size + 1), is_digit);
  }
  return size;
}

/// The size up to the closing quote; 0 if there is none.
std::size_t string_size(std::string_view text) {
  for (std::size_t at = text.find('"') + 1; at < text.size(); ++at) {
    if (text[at] == '"') {
      return at + 1;
    }
    at += text[at] == '\\' ? 1U : 0U;
  }
  return 0;
}

/// Appends the character of an escape sequence; returns the length of the sequence after the backslash.
std::size_t unescape(std::string_view text, bool wide, std::string& into) {
  constexpr std::string_view names = "ntvbrfa";
  constexpr std::string_view characters = "\n\t\v\b\r\f\a";
  if (const auto named = names.find(text[0]); named != std::string_view::npos) {
    into += characters[named];
    return 1;
  }
  const bool hexadecimal = text[0] == 'x' || (wide && text[0] == 'u');
  const std::string_view digits = hexadecimal ? text.substr(1, text[0] == 'x' ? 2 : 4) : text.substr(0, 3);
  std::uint32_t character = 0;
  const auto [end, error] =
      std::from_chars(digits.data(), digits.data() + digits.size(), character, hexadecimal ? 16 : 8);
  if (error != std::errc{}) {
    into += text[0];  // a quote, a backslash, a question mark
    return 1;
  }
  const bool surrogate = character >= 0xd800 && character < 0xe000;
  append_utf8(into, surrogate ? 0xfffd : character);
  return (hexadecimal ? 1U : 0U) + static_cast<std::size_t>(end - digits.data());
}

}  // namespace

IdlToken IdlLexer::next() {
  IdlToken token;
  comments_.clear();
  if (!skip_blanks(token)) {
    return token;
  }
  const char first = text_.front();
  if (first == '"' || text_.starts_with("L\"")) {
    const std::size_t size = string_size(text_);
    return size == 0 ? bad("the string has no closing quote") : take(IdlToken::Kind::string, size);
  }
  if (is_letter(first) || first == '_') {
    return take(IdlToken::Kind::word, run(text_, is_in_word));
  }
  if (is_digit(first) || (first == '.' && text_.size() > 1 && is_digit(text_[1]))) {
    return take(IdlToken::Kind::number, number_size(text_));
  }
  return take(IdlToken::Kind::sign, text_.starts_with("::") ? 2 : 1);
}

bool IdlLexer::skip_blanks(IdlToken& into) {
  for (;;) {
    skip(run(text_, [](char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }));
    if (text_.starts_with("//")) {
      skip_comment(std::min(text_.find('\n'), text_.size()));
    } else if (text_.starts_with("/*")) {
      const std::size_t end = text_.find("*/", 2);
      if (end == std::string_view::npos) {
        into = bad("the comment has no end");
        return false;
      }
      skip_comment(end + 2);
    } else if (text_.starts_with("#")) {
      if (!skip_include(into)) {
        return false;
      }
    } else {
      break;
    }
  }
  into = {IdlToken::Kind::end, {}, line_, column_};
  return !text_.empty();
}

/// Types are found by their names, so the line is not needed.
bool IdlLexer::skip_include(IdlToken& into) {
  const std::string_view line = text_.substr(0, text_.find('\n'));
  constexpr std::string_view keyword = "#include";
  const std::size_t open = std::min(line.find_first_not_of(" \t", keyword.size()), line.size());
  const char quote = open < line.size() ? line[open] : '\0';
  const std::size_t close = line.find(quote == '<' ? '>' : '"', open + 1);
  if (!line.starts_with(keyword) || (quote != '<' && quote != '"') || close == std::string_view::npos) {
    into = bad("the only preprocessor directive in ROS is #include \"file\"");
    return false;
  }
  skip(close + 1);
  return true;
}

void IdlLexer::skip(std::size_t bytes) {
  for (const char c : text_.substr(0, bytes)) {
    column_ = c == '\n' ? 1 : column_ + 1;
    line_ += c == '\n' ? 1 : 0;
  }
  text_.remove_prefix(bytes);
}

void IdlLexer::skip_comment(std::size_t bytes) {
  IdlComment comment{.text = text_.substr(0, bytes), .first_line = line_, .column = column_};
  skip(bytes);
  comment.last_line = line_;
  comments_.push_back(comment);
}

IdlToken IdlLexer::take(IdlToken::Kind kind, std::size_t bytes) {
  const IdlToken token{kind, text_.substr(0, bytes), line_, column_};
  skip(bytes);
  return token;
}

IdlToken IdlLexer::bad(std::string_view text) const {
  return {IdlToken::Kind::bad, text, line_, column_};
}

std::string unescaped_idl_string(std::string_view token, bool wide) {
  token.remove_prefix(token.find('"') + 1);
  token.remove_suffix(1);
  std::string text;
  while (!token.empty()) {
    std::size_t used = 1;
    if (token[0] == '\\' && token.size() > 1) {
      used += unescape(token.substr(1), wide, text);
    } else {
      text += token[0];
    }
    token.remove_prefix(used);
  }
  return text;
}

}  // namespace trestle::messages
