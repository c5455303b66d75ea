#pragma once
#include <string>
#include <string_view>

#include "bridge/cli/terminal.hpp"
#include "bridge/conform/runner.hpp"

/// Results for people and for programs.
namespace trestle::conform {

/// The version of results.json: raised when something is renamed or taken away.
inline constexpr int results_schema = 1;

/// What is said about a run in reports besides its cases.
struct RunInfo {
  std::string profile_file{};
  std::string device{};
  std::string device_version{};
  std::string folder{};
  Level level = Level::tc8;
  std::uint64_t seed = 1;
  /// The command that runs one case again, without its id.
  std::string command{};
};

/// One line, without its end: verdict, id and title; below it, if it is no pass, why.
[[nodiscard]] std::string case_text(const CaseResult& result, const RunInfo& info,
                                    const cli::Colours& colours);
/// What a case is about, for `trestle conform explain`.
[[nodiscard]] std::string explanation(const Case& one);
/// The same of a TC8 case that no case of ours is about, with the reason why.
[[nodiscard]] std::string explanation(const Tc8Row& row);
/// The same of a requirement: the rules about it, and why there is no case or no rule.
/// @param rules  those of `trestle conform replay`.
[[nodiscard]] std::string explanation(const RequirementRow& row, const std::vector<Case>& rules);
/// Why no case is about a requirement; empty: there is one, or a capture is enough to judge it.
[[nodiscard]] std::string why_no_case(const RequirementRow& row);
/// The last lines: how many of each verdict.
[[nodiscard]] std::string summary(const RunResult& run, const cli::Colours& colours);

/// A document of JUnit XML, a test suite for each area.
[[nodiscard]] std::string junit_xml(const RunResult& run, const RunInfo& info);
/// docs/conform.md has the schema.
[[nodiscard]] std::string results_json(const RunResult& run, const RunInfo& info);

/// The first part of an id: "sd".
[[nodiscard]] std::string area_of(const std::string& id);
/// The first two parts of it: "sd.offer".
[[nodiscard]] std::string group_of(const std::string& id);

[[nodiscard]] const char* colour_of(Verdict verdict, const cli::Colours& colours) noexcept;

}  // namespace trestle::conform
