#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <sstream>

#include "bridge/messages/values/quoted.hpp"
#include "bridge/messages/values/text_value.hpp"

namespace trestle::messages {
namespace {

TextPlace place_of(const YAML::Mark& mark) {
  return mark.is_null() ? TextPlace{} : TextPlace{mark.line + 1, mark.column + 1};
}

/// Throws yaml-cpp's own kind of exception when the text uses more of YAML than a message needs.
class Events : public YAML::EventHandler {
 public:
  void OnDocumentStart(const YAML::Mark& mark) override { start_ = mark; }
  void OnDocumentEnd() override {}

  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    scalar(mark, anchor, TextValue::Kind::nothing, {});
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t /*anchor*/) override {
    throw YAML::ParserException{mark, "anchors and aliases cannot be used here"};
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    scalar(mark, anchor, kind_of(mark, tag), value);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value /*style*/) override {
    begin(mark, anchor, TextValue::Kind::list);
  }
  void OnSequenceEnd() override { end(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value /*style*/) override {
    begin(mark, anchor, TextValue::Kind::mapping);
  }
  void OnMapEnd() override { end(); }

  /// Reports a list or mapping in the place of a key only here, because to yaml-cpp an unclosed bracket looks
  /// like one.
  [[nodiscard]] TextValue take() {
    if (key_fault_) {
      throw YAML::ParserException{*key_fault_, "expected the name of a field"};
    }
    return builder_.take();
  }
  [[nodiscard]] const YAML::Mark& start() const { return start_; }
  /// Where the lists and mappings begin that have not ended, the outermost first.
  [[nodiscard]] const std::vector<YAML::Mark>& open() const { return open_; }

 private:
  static TextValue::Kind kind_of(const YAML::Mark& mark, const std::string& tag) {
    if (tag == "?" || tag.empty()) {
      return TextValue::Kind::plain;
    }
    if (tag == "!" || tag == "tag:yaml.org,2002:str") {
      return TextValue::Kind::quoted;
    }
    if (tag == "tag:yaml.org,2002:binary") {
      return TextValue::Kind::binary;
    }
    if (tag.starts_with("tag:yaml.org,2002:")) {
      return TextValue::Kind::plain;
    }
    throw YAML::ParserException{mark, "unknown tag " + excerpt(tag)};
  }

  void scalar(const YAML::Mark& mark, YAML::anchor_t anchor, TextValue::Kind kind, const std::string& value) {
    refuse_anchor(mark, anchor);
    if (key_fault_) {
      return;
    }
    if (builder_.expects_key()) {
      builder_.key(value, place_of(mark));
      return;
    }
    const bool null = kind == TextValue::Kind::plain &&
                      (value == "~" || value == "null" || value == "Null" || value == "NULL");
    builder_.scalar(null ? TextValue::Kind::nothing : kind, value, place_of(mark));
  }

  void begin(const YAML::Mark& mark, YAML::anchor_t anchor, TextValue::Kind kind) {
    refuse_anchor(mark, anchor);
    open_.push_back(mark);
    if (!key_fault_ && builder_.expects_key()) {
      key_fault_ = mark;
    }
    if (key_fault_) {
      return;
    }
    if (!builder_.begin(kind, place_of(mark))) {
      throw YAML::ParserException{mark, "lists and mappings are nested too deep"};
    }
  }
  void end() {
    open_.pop_back();
    if (!key_fault_) {
      builder_.end();
    }
  }

  static void refuse_anchor(const YAML::Mark& mark, YAML::anchor_t anchor) {
    if (anchor != YAML::NullAnchor) {
      throw YAML::ParserException{mark, "anchors and aliases cannot be used here"};
    }
  }

  TextValueBuilder builder_;
  YAML::Mark start_;
  std::vector<YAML::Mark> open_;
  std::optional<YAML::Mark> key_fault_;
};

/// The error for a text that ends within brackets; yaml-cpp reports it at the first column.
std::optional<ValueError> unclosed(std::string_view text, const YAML::Mark& error, const Events& events) {
  constexpr std::string_view mark_of_utf8 = "\xef\xbb\xbf";  // yaml-cpp does not count it
  const std::size_t skipped = text.starts_with(mark_of_utf8) ? mark_of_utf8.size() : 0;
  text.remove_prefix(skipped);
  if (error.is_null() || static_cast<std::size_t>(error.pos) < text.size()) {
    return std::nullopt;
  }
  for (auto open = events.open().rbegin(); open != events.open().rend(); ++open) {
    const auto at = static_cast<std::size_t>(open->pos);
    const char bracket = at < text.size() ? text[at] : ' ';
    if (bracket != '{' && bracket != '[') {
      continue;  // begun by indentation, not by a bracket
    }
    const std::size_t end = text.find_last_not_of(" \t\r\n") + 1;
    const std::string_view lines = text.substr(0, end);
    const auto line_start = lines.find_last_of('\n') + 1;  // 0 if there is no line break
    const TextPlace place{static_cast<int>(std::ranges::count(lines, '\n')) + 1,
                          static_cast<int>(end - line_start) + 1};
    const TextPlace begin = place_of(*open);
    return ValueError{place,
                      {},
                      std::string{"not valid YAML: '"} + bracket + "' of " + std::to_string(begin.line) +
                          ":" + std::to_string(begin.column) + " is not closed; expected '" +
                          (bracket == '{' ? '}' : ']') + "'"};
  }
  return std::nullopt;
}

}  // namespace

tl::expected<TextValue, ValueError> parse_yaml_text(std::string_view text) {
  if (auto error = unreadable(text)) {
    return tl::unexpected{std::move(*error)};
  }
  Events first;
  try {
    std::istringstream stream{std::string{text}};
    YAML::Parser parser{stream};
    parser.HandleNextDocument(first);
    // A "---" at the end, which stands between printed messages, begins one more, empty document.
    Events second;
    if (parser.HandleNextDocument(second) && second.take().kind != TextValue::Kind::nothing) {
      return tl::unexpected{ValueError{place_of(second.start()), {}, "expected the end of the message"}};
    }
    TextValue value = first.take();
    if (value.kind == TextValue::Kind::nothing) {
      value.kind = TextValue::Kind::mapping;
    }
    return value;
  } catch (const YAML::Exception& error) {
    if (auto end = unclosed(text, error.mark, first)) {
      return tl::unexpected{std::move(*end)};
    }
    return tl::unexpected{ValueError{place_of(error.mark), {}, "not valid YAML: " + error.msg}};
  }
}

}  // namespace trestle::messages
