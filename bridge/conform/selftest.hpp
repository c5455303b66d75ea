#pragma once
#include <functional>
#include <string>
#include <vector>

#include "bridge/conform/runner.hpp"

/// Are the cases any good? Each is run against the device as it is, which has to pass, and against the device
/// with a fault, which a case has to find.
namespace trestle::conform {

/// A fault as the device lists it.
struct FaultRow {
  std::string name{};
  std::vector<std::string> finders{};  ///< selectors of the cases that may find it
  std::string what{};
};

/// From the lines that the device prints; those that are none are left out.
[[nodiscard]] std::vector<FaultRow> read_faults(const std::string& lines);

struct FaultResult {
  FaultRow fault{};
  std::vector<std::string> found_by{};  ///< ids of the cases that fail
  std::size_t tried = 0;                ///< cases
  std::vector<std::string> unjudged{};  ///< ids of the cases that were inconclusive, or an error
};

struct SelftestResult {
  RunResult reference{};  ///< without a fault
  std::vector<FaultResult> faults{};

  [[nodiscard]] std::size_t found() const;
  /// Cases that passed without a fault, so that they can show that they find one.
  [[nodiscard]] std::size_t passed() const;
  /// Cases that passed without a fault and failed with none.
  [[nodiscard]] std::vector<std::string> blind_cases() const;
};

struct SelftestOptions {
  std::string folder{};
  std::string programs{};
  std::vector<std::string> only_faults{};  ///< by name; none: all
  /// Only the cases that may find one of the faults.
  bool only_finders = false;
  std::uint64_t seed = 1;
  std::function<bool()> cancelled{};  ///< as in RunOptions
  /// Every case that may find a fault, also when nothing new can be learned: the fault is found already, and
  /// the case has failed with another one.
  bool every_pair = false;
  unsigned jobs = 1;  ///< devices at once, where the profile can start several
  /// Called by one thread at a time, in any order; of a fault again when a second look has found more.
  /// Without a fault:
  std::function<void(const CaseResult& result)> on_case{};
  std::function<void(const FaultResult& result)> on_fault{};
};

/// @throws std::runtime_error as run_cases(), and when the profile has no faults or the device cannot list
/// them.
[[nodiscard]] SelftestResult selftest(const Profile& profile, const std::vector<const Case*>& chosen,
                                      const SelftestOptions& options);

}  // namespace trestle::conform
