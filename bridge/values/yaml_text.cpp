#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <sstream>

#include "bridge/values/quoted.hpp"
#include "bridge/values/text_value.hpp"

namespace trestle::bridge {
namespace {

TextPlace place_of(const YAML::Mark& mark) {
  return mark.is_null() ? TextPlace{} : TextPlace{mark.line + 1, mark.column + 1};
}

/// Leaves yaml-cpp with its own kind of exception when the text is more than a message needs.
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
  void OnSequenceEnd() override { builder_.end(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& /*tag*/, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value /*style*/) override {
    begin(mark, anchor, TextValue::Kind::mapping);
  }
  void OnMapEnd() override { builder_.end(); }

  [[nodiscard]] TextValue take() { return builder_.take(); }
  [[nodiscard]] const YAML::Mark& start() const { return start_; }

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
    if (builder_.expects_key()) {
      throw YAML::ParserException{mark, "expected the name of a field"};
    }
    if (!builder_.begin(kind, place_of(mark))) {
      throw YAML::ParserException{mark, "lists and mappings are nested too deep"};
    }
  }

  static void refuse_anchor(const YAML::Mark& mark, YAML::anchor_t anchor) {
    if (anchor != YAML::NullAnchor) {
      throw YAML::ParserException{mark, "anchors and aliases cannot be used here"};
    }
  }

  TextValueBuilder builder_;
  YAML::Mark start_;
};

}  // namespace

tl::expected<TextValue, ValueError> parse_yaml_text(std::string_view text) {
  if (auto error = unreadable(text)) {
    return tl::unexpected{std::move(*error)};
  }
  try {
    std::istringstream stream{std::string{text}};
    YAML::Parser parser{stream};
    Events first;
    parser.HandleNextDocument(first);
    // A "---" at the end, as stands between printed messages, begins one more document with nothing in it.
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
    return tl::unexpected{ValueError{place_of(error.mark), {}, "not valid YAML: " + error.msg}};
  }
}

}  // namespace trestle::bridge
