#include "bridge/documents/problems.hpp"

#include <fmt/format.h>
#include <yaml-cpp/mark.h>

#include <algorithm>
#include <span>
#include <tuple>

#include "someip/wire/utf.hpp"

namespace trestle::documents {

Mark to_mark(const YAML::Mark& mark) {
  return mark.is_null() ? Mark{} : Mark{mark.line + 1, mark.column + 1};
}

bool is_control(char32_t code) noexcept {
  return code < 0x20 || (code >= 0x7f && code < 0xa0) || code == 0x061c || code == 0x200e || code == 0x200f ||
         (code >= 0x2028 && code <= 0x202e) || (code >= 0x2066 && code <= 0x2069) || code == 0xfeff ||
         code == 0xfffe || code == 0xffff;
}

bool has_control(std::string_view text) noexcept {
  for (ByteView rest = std::as_bytes(std::span{text}); !rest.empty();) {
    const auto character = someip::first_utf8(rest);
    if (!character || is_control(character->code)) {
      return true;
    }
    rest = rest.subspan(character->bytes);
  }
  return false;
}

std::string printable(std::string_view text) {
  std::string result;
  for (ByteView rest = std::as_bytes(std::span{text}); !rest.empty();) {
    const auto character = someip::first_utf8(rest);
    const std::size_t bytes = character ? character->bytes : 1;
    if (!character || (is_control(character->code) && bytes == 1)) {
      result += fmt::format("\\x{:02x}", std::to_integer<unsigned>(rest.front()));
    } else if (is_control(character->code)) {
      result += fmt::format("\\u{:04x}", static_cast<std::uint32_t>(character->code));
    } else {
      result += text.substr(text.size() - rest.size(), bytes);
    }
    rest = rest.subspan(bytes);
  }
  return result;
}

std::string printable_json(std::string json) {
  // Those below 0x20 are escaped in any JSON, or stand between its parts.
  const auto may_begin_one = [](char c) { return static_cast<unsigned char>(c) >= 0x7f; };
  if (std::ranges::none_of(json, may_begin_one)) {
    return json;
  }
  std::string result;
  for (ByteView rest = std::as_bytes(std::span{json}); !rest.empty();) {
    const auto character = someip::first_utf8(rest);
    const std::size_t bytes = character ? character->bytes : 1;
    if (character && character->code >= 0x7f && is_control(character->code)) {
      result += fmt::format("\\u{:04x}", static_cast<std::uint32_t>(character->code));
    } else {
      result.append(json, json.size() - rest.size(), bytes);
    }
    rest = rest.subspan(bytes);
  }
  return result;
}

std::string quote(std::string_view text) {
  constexpr std::size_t shown_max = 60;
  std::size_t shown = std::min(text.size(), shown_max);
  while (shown > 0 && shown < text.size() && (static_cast<unsigned char>(text[shown]) & 0xc0U) == 0x80U) {
    --shown;  // no half characters
  }
  return "'" + printable(text.substr(0, shown)) + (text.size() > shown_max ? "...'" : "'");
}

void Problems::add(std::vector<Found>& list, const Place& place, std::string text) {
  if (list.size() < most_ && said_.emplace(place.file, place.mark.line, place.mark.column, text).second) {
    list.push_back({place, std::move(text)});
  }
}

void Problems::warning_once(const std::string& key, const Place& place, std::string text) {
  if (warnings_.size() < most_ && keys_.insert(key).second) {
    warning(place, std::move(text));
  }
}

std::vector<Problem> Problems::take(const std::vector<std::string>& files) {
  std::vector<std::pair<Place, Problem>> found;
  const auto put = [&](std::vector<Found>& list, Problem::Severity severity) {
    for (Found& one : list) {
      if (found.size() >= most_) {
        break;
      }
      std::string file = one.place.file < files.size() ? files[one.place.file] : std::string{};
      found.emplace_back(one.place, Problem{severity, std::move(file), one.place.mark, std::move(one.text)});
    }
    list.clear();
  };
  put(errors_, Problem::Severity::error);
  put(warnings_, Problem::Severity::warning);
  std::ranges::stable_sort(found, {}, [](const auto& one) {
    return std::tuple{one.first.file, one.first.mark.line, one.first.mark.column};
  });
  said_.clear();
  std::vector<Problem> problems;
  for (auto& [place, problem] : found) {
    problems.push_back(std::move(problem));
  }
  return problems;
}

std::string to_string(const Problem& problem) {
  const char* severity = problem.severity == Problem::Severity::error ? "error" : "warning";
  if (problem.mark.line == 0) {
    return printable(fmt::format("{}: {}: {}", problem.file, severity, problem.text));
  }
  return printable(fmt::format("{}:{}:{}: {}: {}", problem.file, problem.mark.line, problem.mark.column,
                               severity, problem.text));
}

}  // namespace trestle::documents
