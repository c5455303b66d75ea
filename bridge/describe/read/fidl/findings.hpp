#pragma once
#include <set>
#include <string>
#include <vector>

#include "bridge/describe/model.hpp"

namespace trestle::describe::fidl {

/// Gathers what is wrong with several files. At most `most` errors, and as many warnings as fit beside them.
class Findings {
 public:
  static constexpr std::size_t most = 100;

  void error(Place place, std::string text) {
    add(place, documents::Problem::Severity::error, std::move(text));
  }
  void warning(Place place, std::string text) {
    add(place, documents::Problem::Severity::warning, std::move(text));
  }
  [[nodiscard]] std::size_t errors() const noexcept { return errors_.size() + more_errors_; }
  /// No more errors are kept: reading on tells nothing.
  [[nodiscard]] bool full() const noexcept { return errors_.size() >= most; }
  /// In the order of the files and places.
  /// @param files  their names
  [[nodiscard]] std::vector<documents::Problem> take(const std::vector<std::string>& files);

 private:
  struct Finding {
    Place place;
    documents::Problem::Severity severity;
    std::string text;
  };
  void add(Place place, documents::Problem::Severity severity, std::string text);

  std::vector<Finding> errors_;
  std::vector<Finding> warnings_;
  std::set<std::string> said_;
  std::size_t more_errors_ = 0;
};

}  // namespace trestle::describe::fidl
