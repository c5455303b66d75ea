#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "bridge/documents/problem.hpp"

namespace trestle::describe::fidl {

/// A piece of a FIDL or FDEPL file. `text` points into the file's text.
struct Token {
  enum class Kind : std::uint8_t {
    end,         ///< of the file
    word,        ///< a keyword or a name, without the ^ that may stand before it
    number,      ///< without a sign: 12, 0x1f, 0b101, 1.5, 1.5e-3f
    string,      ///< with its quotes
    annotation,  ///< what stands between <** and **>
    sign,        ///< "->", "=>", "==", "!=", "<=", ">=", "&&", "||", or any other single character
    bad,         ///< `text` says what is wrong
  };
  Kind kind = Kind::end;
  std::string_view text{};
  documents::Mark mark{1, 1};  ///< column in bytes
  bool escaped = false;        ///< of a word: written with ^

  [[nodiscard]] bool is(std::string_view word) const noexcept {
    return (kind == Kind::sign || (kind == Kind::word && !escaped)) && text == word;
  }
};

/// Cuts the text of a file into tokens, without comments.
class Lexer {
 public:
  /// @param text  must live as long as the tokens.
  explicit Lexer(std::string_view text);

  [[nodiscard]] const Token& peek(std::size_t ahead = 0) const noexcept { return next_.at(ahead); }
  Token take();
  /// From here on there is only the end.
  void stop();

 private:
  [[nodiscard]] Token cut();
  /// True when a token begins here; false: `into` is the end, or what is wrong.
  bool skip_blanks(Token& into);
  void skip(std::size_t bytes);
  [[nodiscard]] Token cut(Token::Kind kind, std::size_t bytes);
  [[nodiscard]] Token bad(std::string_view text) const;
  [[nodiscard]] std::size_t number_length() const;

  std::string_view text_;
  documents::Mark mark_{1, 1};
  std::array<Token, 3> next_{};
};

/// The characters of a string token.
[[nodiscard]] std::string unquoted(std::string_view token);

/// How a token is named in a message: "'struct'", "the end of the file".
[[nodiscard]] std::string shown(const Token& token);

}  // namespace trestle::describe::fidl
