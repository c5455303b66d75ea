#include "bridge/messages/values/text_value.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <utility>

#include "bridge/messages/types/number_text.hpp"
#include "bridge/messages/values/quoted.hpp"
#include "someip/wire/utf.hpp"

namespace trestle::messages {

std::string to_string(const ValueError& error) {
  std::string result;
  if (error.place.line != 0) {
    result = fmt::format("{}:{}: ", error.place.line, error.place.column);
  }
  if (!error.field.empty()) {
    result += error.field + ": ";
  }
  return result + error.text;
}

std::string found(const TextValue& value) {
  switch (value.kind) {
    case TextValue::Kind::nothing:
      return "nothing";
    case TextValue::Kind::list:
      return fmt::format("a list of {} element{}", value.elements.size(),
                         value.elements.size() == 1 ? "" : "s");
    case TextValue::Kind::mapping:
      return "a mapping";
    case TextValue::Kind::quoted:
      return "the string " + excerpt(value.text);
    case TextValue::Kind::literal:
    case TextValue::Kind::plain:
    case TextValue::Kind::binary:
      break;
  }
  return excerpt(value.text);
}

TextPlace place_of(const TextValue& text, std::string_view field) {
  const TextValue* at = &text;
  while (!field.empty()) {
    const TextValue* next = nullptr;
    if (field.front() == '[') {
      const std::size_t end = std::min(field.find(']'), field.size() - 1);
      const auto index = read_integer<std::size_t>(field.substr(1, end - 1));
      if (at->kind == TextValue::Kind::list && index && *index < at->elements.size()) {
        next = &at->elements[*index];
      }
      field.remove_prefix(end + 1);
    } else {
      field.remove_prefix(field.front() == '.' ? 1 : 0);
      const std::string_view name = field.substr(0, field.find_first_of(".["));
      if (at->kind == TextValue::Kind::mapping) {
        const auto named = std::ranges::find(at->elements, name, &TextValue::key);
        next = named == at->elements.end() ? nullptr : &*named;
      }
      if (name.empty()) {
        break;
      }
      field.remove_prefix(name.size());
    }
    if (next == nullptr) {
      break;
    }
    at = next;
  }
  return at->place;
}

std::optional<ValueError> unreadable(std::string_view text) {
  if (text.size() > max_text_bytes) {
    return ValueError{{}, {}, fmt::format("the text is longer than {} bytes", max_text_bytes)};
  }
  TextPlace place{1, 1};
  for (ByteView rest = std::as_bytes(std::span{text}); !rest.empty();) {
    const auto character = someip::first_utf8(rest);
    if (!character || character->code == 0) {
      return ValueError{place, {}, character ? "a zero byte in the text" : "the text is not valid UTF-8"};
    }
    place.column += static_cast<int>(character->bytes);
    if (character->code == '\n') {
      place = {place.line + 1, 1};
    }
    rest = rest.subspan(character->bytes);
  }
  return std::nullopt;
}

void TextValueBuilder::key(std::string key, TextPlace place) {
  key_ = std::move(key);
  key_place_ = place;
  has_key_ = true;
}

void TextValueBuilder::scalar(TextValue::Kind kind, std::string text, TextPlace place) {
  TextValue value = next(kind, place);
  value.text = std::move(text);
  add(std::move(value));
}

bool TextValueBuilder::begin(TextValue::Kind kind, TextPlace place) {
  if (open_.size() == max_text_depth) {
    return false;
  }
  open_.push_back(next(kind, place));
  return true;
}

void TextValueBuilder::end() {
  TextValue value = std::move(open_.back());
  open_.pop_back();
  add(std::move(value));
}

TextValue TextValueBuilder::next(TextValue::Kind kind, TextPlace place) {
  TextValue value;
  value.kind = kind;
  value.place = place;
  if (std::exchange(has_key_, false)) {
    value.key = std::move(key_);
    value.key_place = key_place_;
  }
  return value;
}

void TextValueBuilder::add(TextValue value) {
  (open_.empty() ? root_ : open_.back().elements.emplace_back()) = std::move(value);
}

}  // namespace trestle::messages
