#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>

#include "bridge/messages/values/text_value.hpp"

namespace trestle::messages {
namespace {

using Json = nlohmann::json;

/// The parser's position in the text. It does not tell its position, so it reads through CountedIterator.
struct Progress {
  const char* at = nullptr;
};

class CountedIterator {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  CountedIterator(const char* at, Progress& progress) : at_{at}, progress_{&progress} {}
  reference operator*() const { return *at_; }
  CountedIterator& operator++() {
    progress_->at = ++at_;
    return *this;
  }
  friend bool operator==(const CountedIterator& a, const CountedIterator& b) { return a.at_ == b.at_; }

 private:
  const char* at_;
  Progress* progress_;
};

class Events : public nlohmann::json_sax<Json> {
 public:
  Events(std::string_view text, const Progress& progress)
      : text_{text}, progress_{progress}, token_{text.data()}, counted_{text.data()} {}

  bool null() override { return literal(TextValue::Kind::nothing); }
  bool boolean(bool /*value*/) override { return literal(TextValue::Kind::literal); }
  bool number_integer(std::int64_t /*value*/) override { return literal(TextValue::Kind::literal); }
  bool number_unsigned(std::uint64_t /*value*/) override { return literal(TextValue::Kind::literal); }
  bool number_float(double /*value*/, const std::string& /*text*/) override {
    return literal(TextValue::Kind::literal);
  }
  bool string(std::string& value) override {
    builder_.scalar(TextValue::Kind::quoted, std::move(value), next_token());
    return true;
  }
  bool binary(Json::binary_t& /*value*/) override { return false; }  // not in JSON
  bool start_object(std::size_t /*elements*/) override { return begin(TextValue::Kind::mapping); }
  bool key(std::string& value) override {
    builder_.key(std::move(value), next_token());
    return true;
  }
  bool end_object() override { return end(); }
  bool start_array(std::size_t /*elements*/) override { return begin(TextValue::Kind::list); }
  bool end_array() override { return end(); }

  bool parse_error(std::size_t position, const std::string& /*last_token*/,
                   const Json::exception& error) override {
    // "[json.exception.parse_error.101] parse error at line 1, column 2: syntax error ..."
    std::string_view what = error.what();
    what.remove_prefix(std::min(what.size(), what.find("] ") + 2));
    const auto colon = what.find(": ");
    what.remove_prefix(colon == std::string_view::npos ? 0 : colon + 2);
    fail(place_of(text_.data() + std::min(position == 0 ? 0 : position - 1, text_.size())),
         "not valid JSON: " + std::string{what});
    return false;
  }

  [[nodiscard]] TextValue take() { return builder_.take(); }
  [[nodiscard]] const ValueError& error() const { return error_; }

 private:
  /// Numbers are kept as text, because neither double nor int64 can hold all of them.
  bool literal(TextValue::Kind kind) {
    const TextPlace place = next_token();
    const std::string_view rest{begin_, static_cast<std::size_t>(text_.data() + text_.size() - begin_)};
    builder_.scalar(kind, std::string{rest.substr(0, rest.find_first_of(" \t\r\n,]}"))}, place);
    return true;
  }

  bool begin(TextValue::Kind kind) {
    const TextPlace place = next_token();
    if (!builder_.begin(kind, place)) {
      fail(place, "lists and objects are nested too deep");
      return false;
    }
    return true;
  }

  bool end() {
    next_token();
    builder_.end();
    return true;
  }

  /// The place where the token begins that the parser has just read. After a number the parser reads one
  /// character more: either it is skipped here, or it is the next token.
  TextPlace next_token() {
    const char* const end = text_.data() + text_.size();
    begin_ = std::find_if(
        token_, end, [](char c) { return std::string_view{" \t\r\n,:"}.find(c) == std::string_view::npos; });
    token_ = std::max(begin_, progress_.at);
    return place_of(begin_);
  }

  /// Counts lines from the last place that was asked for.
  TextPlace place_of(const char* at) {
    for (; counted_ < at; ++counted_) {
      if (*counted_ == '\n') {
        ++place_.line;
        line_ = counted_ + 1;
      }
    }
    place_.column = static_cast<int>(at - line_) + 1;
    return place_;
  }

  void fail(TextPlace place, std::string text) { error_ = {place, {}, std::move(text)}; }

  std::string_view text_;
  const Progress& progress_;
  const char* token_;            ///< where the search for the next token begins
  const char* begin_ = nullptr;  ///< beginning of the last token
  const char* counted_;
  const char* line_ = text_.data();
  TextPlace place_{1, 1};
  TextValueBuilder builder_;
  ValueError error_;
};

}  // namespace

tl::expected<TextValue, ValueError> parse_json_text(std::string_view text) {
  if (auto error = unreadable(text)) {
    return tl::unexpected{std::move(*error)};
  }
  if (text.starts_with("\xef\xbb\xbf")) {
    text.remove_prefix(3);  // a byte order mark, which the parser skips too
  }
  Progress progress{text.data()};
  Events events{text, progress};
  if (!Json::sax_parse(CountedIterator{text.data(), progress},
                       CountedIterator{text.data() + text.size(), progress}, &events)) {
    return tl::unexpected{events.error()};
  }
  return events.take();
}

}  // namespace trestle::messages
