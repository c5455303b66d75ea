#pragma once
#include <map>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "bridge/conform/verdict.hpp"

/// results.json as it is read again, to compare runs.
namespace trestle::conform {

struct ReadCase {
  std::string title{};
  Verdict verdict{};
  std::string reason{};
};

/// A run of before.
struct ReadRun {
  std::string name{};  ///< of the device
  std::string version{};
  std::string started{};
  bool cancelled = false;
  std::map<std::string, ReadCase> cases{};  ///< by id
};

/// @param path  the file, or the folder that it is in.
/// @return the run, or why there is none: it names the file.
[[nodiscard]] tl::expected<ReadRun, std::string> read_results(const std::string& path);
/// The same for the text of the file.
[[nodiscard]] tl::expected<ReadRun, std::string> parse_results(const std::string& text,
                                                               const std::string& file);

/// "pass", "pass-nonstrict", ...; nothing: it is none of them.
[[nodiscard]] std::optional<Verdict> verdict_of(std::string_view word) noexcept;

}  // namespace trestle::conform
