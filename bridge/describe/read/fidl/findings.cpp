#include "bridge/describe/read/fidl/findings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

namespace trestle::describe::fidl {

void Findings::add(Place place, documents::Problem::Severity severity, std::string text) {
  const bool is_error = severity == documents::Problem::Severity::error;
  std::vector<Finding>& list = is_error ? errors_ : warnings_;
  if (list.size() >= most) {
    more_errors_ += is_error ? 1 : 0;
    return;
  }
  // A type that is used in many places is judged in each of them.
  if (said_.insert(fmt::format("{}:{}:{}:{}", place.file, place.mark.line, place.mark.column, text)).second) {
    list.push_back({place, severity, std::move(text)});
  }
}

std::vector<documents::Problem> Findings::take(const std::vector<std::string>& files) {
  std::vector<Finding> all = std::move(errors_);
  const std::size_t room = most - std::min(most, all.size());
  all.insert(all.end(), warnings_.begin(),
             warnings_.begin() + static_cast<std::ptrdiff_t>(std::min(room, warnings_.size())));
  std::ranges::stable_sort(all, {}, [](const Finding& finding) {
    return std::tuple{finding.place.file, finding.place.mark.line, finding.place.mark.column};
  });
  std::vector<documents::Problem> problems;
  for (Finding& finding : all) {
    problems.push_back({finding.severity, finding.place.file < files.size() ? files[finding.place.file] : "",
                        finding.place.mark, std::move(finding.text)});
  }
  return problems;
}

}  // namespace trestle::describe::fidl
