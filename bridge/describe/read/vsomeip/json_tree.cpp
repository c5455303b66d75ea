#include "bridge/describe/read/vsomeip/json_tree.hpp"

#include <algorithm>
#include <utility>

#include "bridge/messages/types/characters.hpp"

namespace trestle::describe {
namespace {

using documents::Mark;

bool is_hex(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
}

class JsonParser {
 public:
  JsonParser(std::string_view text, documents::Problems& problems) : text_{text}, problems_{problems} {
    if (text_.substr(0, 3) == "\xef\xbb\xbf") {
      at_ = 3;
      line_begin_ = 3;
    }
  }

  std::optional<JsonNode> parse() {
    JsonNode root;
    skip_space();
    if (!value(root, 0)) {
      return std::nullopt;
    }
    skip_space();
    if (!at_end()) {
      fail("the end of the file");
      return std::nullopt;
    }
    return root;
  }

 private:
  [[nodiscard]] bool at_end() const { return at_ >= text_.size(); }
  [[nodiscard]] char now() const { return at_end() ? '\0' : text_[at_]; }
  [[nodiscard]] Mark mark() const { return {line_, static_cast<int>(at_ - line_begin_) + 1}; }

  bool fail(const std::string& expected) {
    problems_.error(mark(), "expected " + expected + ", not " +
                                (at_end() ? "the end of the file" : documents::quote(text_.substr(at_, 12))));
    return false;
  }

  void step() {
    if (text_[at_++] == '\n') {
      ++line_;
      line_begin_ = at_;
    }
  }
  void skip_line() {
    while (!at_end() && now() != '\n') {
      step();
    }
  }

  /// White space and comments.
  void skip_space() {
    while (!at_end()) {
      const char c = now();
      if (c == ' ' || c == '\t' || c == '\r' || c == '\n') {
        step();
      } else if (text_.substr(at_, 2) == "//" || c == '#') {
        tell_of_comment();
        skip_line();
      } else if (text_.substr(at_, 2) == "/*") {
        tell_of_comment();
        const std::size_t end = std::min(text_.find("*/", at_ + 2), text_.size());
        while (at_ < std::min(end + 2, text_.size())) {
          step();
        }
      } else {
        return;
      }
    }
  }
  void tell_of_comment() {
    if (!std::exchange(told_of_comment_, true)) {
      problems_.warning(mark(), "a comment, which JSON does not have; vsomeip refuses such a file");
    }
  }

  bool value(JsonNode& node, int depth) {
    node.mark = mark();
    if (++values_ > max_json_values) {
      return fail("at most " + std::to_string(max_json_values) + " values");
    }
    const char c = now();
    if (c == '{' || c == '[') {
      if (depth >= max_json_depth) {
        return fail("at most " + std::to_string(max_json_depth) + " values nested in each other");
      }
      return c == '{' ? object(node, depth) : array(node, depth);
    }
    if (c == '"') {
      node.kind = JsonNode::Kind::string;
      return string(node.text);
    }
    return word(node);
  }

  /// true, false, null, or a number.
  bool word(JsonNode& node) {
    std::size_t end = at_;
    const auto is_part = [](char c) {
      return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '+' ||
             c == '-' || c == '.';
    };
    while (end < text_.size() && is_part(text_[end])) {
      ++end;
    }
    const std::string_view word = text_.substr(at_, end - at_);
    const bool is_number = !word.empty() && ((word[0] >= '0' && word[0] <= '9') || word[0] == '-');
    if (word == "true" || word == "false") {
      node.kind = JsonNode::Kind::boolean;
    } else if (is_number) {
      node.kind = JsonNode::Kind::number;
    } else if (word != "null") {
      return fail("a value");
    }
    node.text = word;
    at_ = end;
    return true;
  }

  bool string(std::string& to) {
    ++at_;
    while (true) {
      const std::size_t plain = std::min(text_.find_first_of("\"\\\n", at_), text_.size());
      to += text_.substr(at_, plain - at_);
      at_ = plain;
      if (at_end() || now() == '\n') {
        return fail("a closing \"");
      }
      if (now() == '"') {
        ++at_;
        return true;
      }
      if (!escape(to)) {
        return false;
      }
    }
  }

  bool escape(std::string& to) {
    static constexpr std::string_view from{"\"\\/bfnrt"};
    static constexpr std::string_view meaning{"\"\\/\b\f\n\r\t"};
    const char c = at_ + 1 < text_.size() ? text_[at_ + 1] : '\0';
    if (const std::size_t which = from.find(c); c != '\0' && which != std::string_view::npos) {
      to += meaning[which];
      at_ += 2;
      return true;
    }
    std::uint32_t code = 0;
    if (c != 'u' || !code_unit(code)) {
      return fail("one of \\\" \\\\ \\/ \\b \\f \\n \\r \\t \\uXXXX");
    }
    std::uint32_t low = 0;
    if (code >= 0xd800 && code < 0xdc00 && text_.substr(at_, 2) == "\\u" && code_unit(low)) {
      code = low >= 0xdc00 && low < 0xe000 ? 0x10000U + ((code - 0xd800U) << 10U) + (low - 0xdc00U) : 0xfffdU;
    }
    messages::append_utf8(to, code >= 0xd800 && code < 0xe000 ? 0xfffdU : code);
    return true;
  }

  bool code_unit(std::uint32_t& code) {
    const std::string_view digits = text_.substr(std::min(at_ + 2, text_.size()), 4);
    if (digits.size() < 4 || !std::ranges::all_of(digits, is_hex)) {
      return false;
    }
    code = static_cast<std::uint32_t>(std::stoul(std::string{digits}, nullptr, 16));
    at_ += 6;
    return true;
  }

  /// After an element: true where another one comes; `closed` after the closing bracket.
  bool next(char close, bool& closed) {
    skip_space();
    closed = false;
    if (now() == ',') {
      const Mark comma = mark();
      step();
      skip_space();
      if (now() != close) {
        return true;
      }
      problems_.warning(comma, "a comma too many, which vsomeip refuses");
    }
    if (now() != close || at_end()) {
      return fail(std::string{"',' or '"} + close + "'");
    }
    step();
    closed = true;
    return true;
  }

  bool array(JsonNode& node, int depth) {
    node.kind = JsonNode::Kind::array;
    step();
    skip_space();
    bool closed = now() == ']';
    if (closed) {
      step();
    }
    while (!closed) {
      if (!value(node.elements.emplace_back(), depth + 1) || !next(']', closed)) {
        return false;
      }
    }
    return true;
  }

  bool object(JsonNode& node, int depth) {
    node.kind = JsonNode::Kind::object;
    step();
    skip_space();
    bool closed = now() == '}';
    if (closed) {
      step();
    }
    while (!closed) {
      JsonNode& member = node.members.emplace_back();
      member.name_mark = mark();
      if (now() != '"') {
        return fail("a name in quotes");
      }
      if (!string(member.name)) {
        return false;
      }
      skip_space();
      if (now() != ':') {
        return fail("':'");
      }
      step();
      skip_space();
      if (!value(member, depth + 1) || !next('}', closed)) {
        return false;
      }
    }
    return true;
  }

  std::string_view text_;
  documents::Problems& problems_;
  std::size_t at_ = 0;
  std::size_t line_begin_ = 0;
  int line_ = 1;
  std::size_t values_ = 0;
  bool told_of_comment_ = false;
};

}  // namespace

const JsonNode* JsonNode::find(std::string_view wanted) const noexcept {
  const auto found = std::ranges::find_if(members, [&](const JsonNode& one) { return one.name == wanted; });
  return found == members.end() ? nullptr : &*found;
}

std::optional<JsonNode> parse_json(std::string_view text, documents::Problems& problems) {
  return JsonParser{text, problems}.parse();
}

std::optional<std::vector<std::string_view>> names_of_root(std::string_view text) {
  std::vector<std::string_view> names;
  bool is_object = false;
  std::size_t depth = 0;
  std::string_view last;  // a string, which a colon makes a name
  for (std::size_t at = text.starts_with("\xef\xbb\xbf") ? 3 : 0; at < text.size(); ++at) {
    const char c = text[at];
    if (c == ' ' || c == '\t' || c == '\r' || c == '\n') {
      continue;
    }
    const bool is_comment = text.substr(at, 2) == "/*";
    if (is_comment || c == '#' || text.substr(at, 2) == "//") {
      at = std::min(is_comment ? text.find("*/", at + 2) : text.find('\n', at), text.size());
      at += is_comment ? 1 : 0;
      continue;
    }
    is_object = is_object || c == '{';
    if (!is_object) {
      return std::nullopt;
    }
    if (c == '"') {
      const std::size_t begin = at + 1;
      for (at = begin; at < text.size() && text[at] != '"'; ++at) {
        at += text[at] == '\\' ? 1 : 0;
      }
      last = text.substr(begin, std::min(at, text.size()) - begin);
      continue;
    }
    if (c == ':' && depth == 1 && last.data() != nullptr) {
      names.push_back(last);
    }
    last = {};
    if (c == '{' || c == '[') {
      ++depth;
    } else if ((c == '}' || c == ']') && --depth == 0) {
      break;
    }
  }
  return is_object ? std::optional{std::move(names)} : std::nullopt;
}

std::string what_it_is(const JsonNode& node) {
  switch (node.kind) {
    case JsonNode::Kind::null:
      return "null";
    case JsonNode::Kind::boolean:
    case JsonNode::Kind::number:
      return documents::quote(node.text);
    case JsonNode::Kind::string:
      return "the text " + documents::quote(node.text);
    case JsonNode::Kind::array:
      return "a list";
    case JsonNode::Kind::object:
      return "an object";
  }
  return "";
}

}  // namespace trestle::describe
