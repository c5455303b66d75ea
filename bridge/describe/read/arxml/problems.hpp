#pragma once
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "bridge/describe/model.hpp"

namespace trestle::describe::arxml {

/// More are counted and not kept.
inline constexpr std::size_t max_problems = 100;

/// Collects what is wrong, with places.
class Problems {
 public:
  explicit Problems(const std::vector<std::string>& files) : files_{files} {}

  void error(Place place, std::string text) {
    failed_ = true;
    add(documents::Problem::Severity::error, place, std::move(text));
  }
  void warning(Place place, std::string text) {
    add(documents::Problem::Severity::warning, place, std::move(text));
  }
  /// A warning that is given once for each `key`.
  void warning_once(const std::string& key, Place place, std::string text) {
    if (seen_[key]++ == 0) {
      warning(place, std::move(text));
    }
  }
  [[nodiscard]] bool failed() const noexcept { return failed_; }
  [[nodiscard]] std::vector<documents::Problem> take() { return std::move(problems_); }

 private:
  void add(documents::Problem::Severity severity, Place place, std::string text) {
    // Errors are worth more than warnings: the last places are theirs.
    const std::size_t room =
        severity == documents::Problem::Severity::error ? max_problems : max_problems - 10;
    if (problems_.size() >= room) {
      return;
    }
    problems_.push_back({severity, place.file < files_.size() ? files_[place.file] : std::string{},
                         place.mark, std::move(text)});
  }

  const std::vector<std::string>& files_;
  std::vector<documents::Problem> problems_{};
  std::unordered_map<std::string, int> seen_{};
  bool failed_ = false;
};

}  // namespace trestle::describe::arxml
