#include "bridge/documents/problems.hpp"

#include <fmt/format.h>
#include <yaml-cpp/mark.h>

#include <algorithm>
#include <tuple>

namespace trestle::documents {

Mark to_mark(const YAML::Mark& mark) {
  return mark.is_null() ? Mark{} : Mark{mark.line + 1, mark.column + 1};
}

std::string printable(std::string_view text) {
  std::string result;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f) {
      result += fmt::format("\\x{:02x}", byte);
    } else {
      result += c;
    }
  }
  return result;
}

std::string quote(std::string_view text) {
  constexpr std::size_t shown_max = 60;
  return "'" + printable(text.substr(0, shown_max)) + (text.size() > shown_max ? "...'" : "'");
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
    return fmt::format("{}: {}: {}", problem.file, severity, problem.text);
  }
  return fmt::format("{}:{}:{}: {}: {}", problem.file, problem.mark.line, problem.mark.column, severity,
                     problem.text);
}

}  // namespace trestle::documents
