#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace trestle::messages {

/// A piece of an `.idl` file. `text` points into the file's text.
struct IdlToken {
  enum class Kind : std::uint8_t {
    end,     ///< of the file
    word,    ///< a keyword or a name
    number,  ///< without a sign
    string,  ///< with its quotes, and its L if it has one
    sign,    ///< "::", or any other single character
    bad,     ///< `text` says what is wrong
  };
  Kind kind = Kind::end;
  std::string_view text;
  int line = 1;
  int column = 1;  ///< in bytes, from 1
};

/// A comment, "// text" or "/* text */", with its signs. `text` points into the file's text.
struct IdlComment {
  std::string_view text;
  int first_line = 1;
  int last_line = 1;
  int column = 1;  ///< of its first sign
};

/// Cuts the text of an `.idl` file into tokens, without comments and `#include` lines.
class IdlLexer {
 public:
  /// @param text  must live as long as the tokens.
  explicit IdlLexer(std::string_view text) : text_{text} {}

  [[nodiscard]] IdlToken next();

  /// What stood between the last token and the one before it.
  [[nodiscard]] const std::vector<IdlComment>& comments() const noexcept { return comments_; }

 private:
  /// True when a token begins here; false: `into` is the end, or what is wrong.
  bool skip_blanks(IdlToken& into);
  bool skip_include(IdlToken& into);
  void skip(std::size_t bytes);
  void skip_comment(std::size_t bytes);
  [[nodiscard]] IdlToken take(IdlToken::Kind kind, std::size_t bytes);
  [[nodiscard]] IdlToken bad(std::string_view text) const;

  std::string_view text_;
  std::vector<IdlComment> comments_{};
  int line_ = 1;
  int column_ = 1;
};

/// The characters of a string token, in UTF-8.
/// @param wide  decodes \u, too, which only wide strings have.
[[nodiscard]] std::string unescaped_idl_string(std::string_view token, bool wide);

}  // namespace trestle::messages
