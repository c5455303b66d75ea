#include "bridge/describe/marks.hpp"

#include <algorithm>

namespace trestle::describe::marks {
namespace {

constexpr std::string_view separator = ", ";

/// The name of "alias Speed", if that is the word.
std::string_view name_behind(std::string_view word, std::string_view part) {
  return part.starts_with(word) && part.substr(word.size()).starts_with(' ') ? part.substr(word.size() + 1)
                                                                             : std::string_view{};
}

}  // namespace

FieldMark parse(std::string_view mark) {
  FieldMark parts;
  while (!mark.empty()) {
    const std::size_t end = std::min(mark.find(separator), mark.size());
    const std::string_view part = mark.substr(0, end);
    mark.remove_prefix(std::min(end + separator.size(), mark.size()));
    if (const auto of_whole = name_behind(alias, part); !of_whole.empty()) {
      parts.aliases.push_back(of_whole);
    } else if (const auto of_elements = name_behind(element_alias, part); !of_elements.empty()) {
      parts.element_aliases.push_back(of_elements);
    } else if (const auto of_array = name_behind(array, part); !of_array.empty()) {
      parts.array_name = of_array;
    } else if (parts.what.empty()) {
      parts.what = part;
    }
  }
  return parts;
}

std::string text_of(const FieldMark& mark) {
  std::string text{mark.what};
  const auto add = [&text](std::string_view word, std::string_view name) {
    text += text.empty() ? std::string_view{} : separator;
    text += word;
    text += ' ';
    text += name;
  };
  for (const std::string_view name : mark.aliases) {
    add(alias, name);
  }
  if (!mark.array_name.empty()) {
    add(array, mark.array_name);
  }
  for (const std::string_view name : mark.element_aliases) {
    add(element_alias, name);
  }
  return text;
}

}  // namespace trestle::describe::marks
