#pragma once
#include <optional>
#include <string>
#include <vector>

#include "bridge/describe/read/fidl/lexer.hpp"
#include "bridge/describe/read/problems.hpp"

namespace trestle::describe::fidl {

/// A name, and where it stands.
struct Name {
  std::string text{};
  Place place{};
  bool escaped = false;
  /// An annotation of Trestle's tells the name that FIDL could not have.
  std::optional<std::string> renamed_from{};
  /// The name that a model has.
  [[nodiscard]] const std::string& in_model() const noexcept { return renamed_from ? *renamed_from : text; }
  [[nodiscard]] bool empty() const noexcept { return text.empty(); }
};

/// How many tokens all files together have, and may have: each of them may become a member of something.
struct TokenCount {
  std::size_t most = 0;
  std::size_t taken = 0;
  bool too_many = false;
};

/// Walks through the tokens of a file for a parser. After something was not as expected, all that follows is
/// not there, until the parser has found a place to go on.
class Cursor {
 public:
  Cursor(std::string_view text, std::uint32_t file, TokenCount& count, Problems& findings)
      : lexer_{text}, file_{file}, count_{count}, findings_{findings} {}

  [[nodiscard]] const Token& peek(std::size_t ahead = 0) const noexcept { return lexer_.peek(ahead); }
  [[nodiscard]] bool at(std::string_view word) const noexcept { return !lost_ && peek().is(word); }
  [[nodiscard]] bool at(Token::Kind kind) const noexcept { return !lost_ && peek().kind == kind; }
  [[nodiscard]] bool at_end() const noexcept { return peek().kind == Token::Kind::end; }
  [[nodiscard]] bool lost() const noexcept { return lost_; }
  [[nodiscard]] Place place(const Token& token) const noexcept { return {file_, token.mark}; }
  [[nodiscard]] Place here() const noexcept { return place(peek()); }
  /// Open braces.
  [[nodiscard]] int depth() const noexcept { return depth_; }
  /// Something begins that stands within no braces: some have not been closed.
  void reset_depth() noexcept { depth_ = 0; }

  Token take();
  /// Takes the word or sign if it is next.
  bool take_if(std::string_view word);
  /// The word or sign has to be next.
  /// @param where  completes "expected '{' …": "after the name of a struct"
  bool expect(std::string_view word, std::string_view where);
  /// A name, which may also be a keyword that should have been escaped.
  /// @param what  completes "expected …": "the name of a method"
  /// @param keywords  that need an escape, sorted; a warning tells of it
  Name name(std::string_view what, const std::vector<std::string>& keywords);
  /// Names with dots between them.
  Name dotted(std::string_view what);
  /// The text of a string.
  std::string text(std::string_view what);
  /// A whole number, which may be negative.
  std::optional<std::int64_t> whole(std::string_view what);
  /// Something else was expected than what is next.
  void fail(std::string_view expected);
  /// Goes on at a word or sign that `is_start` knows, with as many open braces as `depth` says, or at the
  /// brace that closes them, or at the end.
  template <typename Is>
  void recover(int depth, Is is_start) {
    lost_ = false;
    for (; !at_end() && !findings_.full(); take()) {
      if (depth_ < depth || (depth_ == depth && (peek().is("}") || is_start(peek())))) {
        return;
      }
    }
  }
  Problems& findings() noexcept { return findings_; }

 private:
  Lexer lexer_;
  std::uint32_t file_;
  TokenCount& count_;
  Problems& findings_;
  int depth_ = 0;
  bool lost_ = false;
};

/// A whole number as files write it: 12, 0x1f, 0b101. Of numbers beyond 63 bits the same 64 bits.
[[nodiscard]] std::optional<std::int64_t> to_whole(std::string_view number);

/// Why a name is not known: "; did you mean 'x'?", or nothing.
[[nodiscard]] std::string hint(std::string_view word, const std::vector<std::string>& known);

}  // namespace trestle::describe::fidl
