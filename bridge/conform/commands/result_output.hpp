#pragma once
#include <string>

#include "bridge/conform/report.hpp"

namespace trestle::conform {

/// Prints each result below a heading for each area.
class ResultTree {
 public:
  explicit ResultTree(const RunInfo& info);

  void add(const CaseResult& result);
  [[nodiscard]] const cli::Colours& colours() const { return colours_; }

 private:
  const RunInfo& info_;
  cli::Colours colours_;
  std::string area_;
};

/// Writes report.html, results.json and junit.xml into the folder of `info`, which exists.
/// @throws std::runtime_error when that is not possible.
void write_results(const RunResult& run, const RunInfo& info);

}  // namespace trestle::conform
