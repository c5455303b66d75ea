#include "bridge/messages/types/default_elements.hpp"

#include <algorithm>
#include <string_view>

namespace trestle::messages {

std::string_view trimmed(std::string_view text) {
  const auto begin = std::min(text.find_first_not_of(" \t"), text.size());
  return text.substr(begin, text.find_last_not_of(" \t") + 1 - begin);
}

std::size_t element_size(std::string_view text) {
  char quote = 0;
  std::size_t end = 0;
  for (; end < text.size() && (quote != 0 || text[end] != ','); ++end) {
    if (quote != 0 && text[end] == '\\') {
      ++end;
    } else if (quote != 0) {
      quote = text[end] == quote ? '\0' : quote;
    } else if (text[end] == '"' || text[end] == '\'') {
      quote = text[end];
    }
  }
  return std::min(end, text.size());
}

namespace {

DefaultElement element(Primitive type, std::string_view text) {
  DefaultElement value;
  if (type == Primitive::boolean) {
    value.text = text == "1" || text == "true" || text == "True" ? "true" : "false";
  } else if (width(type) == 0 && !text.empty() && (text.front() == '"' || text.front() == '\'')) {
    value.quoted = true;
    for (std::size_t at = 1; at + 1 < text.size(); ++at) {
      at += text[at] == '\\' && at + 2 < text.size() ? 1U : 0U;
      value.text += text[at];
    }
  } else {
    value.text = text;
  }
  return value;
}

}  // namespace

std::vector<DefaultElement> default_elements(const Field& field) {
  std::string_view text = field.default_value;
  if (text.empty() || !field.type.primitive) {
    return {};
  }
  if (field.type.array == ArrayKind::none) {
    return {element(*field.type.primitive, text)};
  }
  std::vector<DefaultElement> elements;
  text = text.substr(1, text.size() - 2);
  while (!trimmed(text).empty()) {
    const std::size_t size = element_size(text);
    elements.push_back(element(*field.type.primitive, trimmed(text.substr(0, size))));
    text.remove_prefix(std::min(size + 1, text.size()));
  }
  return elements;
}

}  // namespace trestle::messages
