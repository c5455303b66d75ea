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

void Problems::error(Mark mark, std::string text) {
  ++errors_;
  problems_.push_back({Problem::Severity::error, file_, mark, std::move(text)});
}

void Problems::warning(Mark mark, std::string text) {
  problems_.push_back({Problem::Severity::warning, file_, mark, std::move(text)});
}

std::vector<Problem> Problems::take() {
  const auto place = [](const Problem& problem) {
    return std::tuple{problem.mark.line, problem.mark.column};
  };
  std::ranges::stable_sort(problems_, {}, place);
  // Equal problems need not be neighbours, because others may have the same place.
  std::vector<Problem> once;
  for (Problem& problem : problems_) {
    const auto same = [&](const Problem& other) { return other.text == problem.text; };
    auto begin = std::ranges::lower_bound(once, place(problem), {}, place);
    if (std::none_of(begin, once.end(), same)) {
      once.push_back(std::move(problem));
    }
  }
  problems_.clear();
  return once;
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
