#pragma once
#include <string>
#include <vector>

#include "bridge/cli/terminal.hpp"
#include "bridge/conform/results_file.hpp"

/// Two runs of one device, and runs of several devices side by side.
namespace trestle::conform {

/// What became of a case from one run to the next.
enum class CaseChange : std::uint8_t {
  broke,   ///< was good, and is not any more, or cannot be judged any more
  mended,  ///< the other way round
  other,   ///< another verdict, or another reason for it, that is neither
  gone,    ///< is not there any more
  added,
};

struct ChangedCase {
  std::string id{};
  CaseChange change{};
  ReadCase before{};  ///< empty for added
  ReadCase after{};   ///< empty for gone
};

struct RunComparison {
  std::vector<ChangedCase> changes{};  ///< in the order of CaseChange, then by id
  std::size_t same = 0;

  [[nodiscard]] std::size_t count(CaseChange change) const;
};

[[nodiscard]] RunComparison compare(const ReadRun& before, const ReadRun& after);
[[nodiscard]] std::string comparison_text(const ReadRun& before, const ReadRun& after,
                                          const cli::Colours& colours);

/// Runs side by side.
struct StackMatrix {
  struct Count {
    std::size_t good = 0;
    std::size_t judged = 0;  ///< without those that are unsupported
  };
  /// "sd.offer" and how good each run is there.
  struct Area {
    std::string name{};
    std::vector<Count> counts{};
  };
  /// A case that is not alike everywhere.
  struct Difference {
    std::string id{};
    std::string title{};
    std::vector<std::optional<ReadCase>> results{};  ///< nothing: that run does not have it
  };
  std::vector<std::string> names{};  ///< of the runs, each once
  std::vector<Area> areas{};
  std::vector<Count> sums{};
  std::vector<Difference> differences{};
};

[[nodiscard]] StackMatrix matrix_of(const std::vector<ReadRun>& runs);
[[nodiscard]] std::string matrix_text(const StackMatrix& matrix, const cli::Colours& colours);
[[nodiscard]] std::string matrix_markdown(const StackMatrix& matrix);
/// docs/conform.md has the schema.
[[nodiscard]] std::string matrix_json(const StackMatrix& matrix);

}  // namespace trestle::conform
