#pragma once
#include <string>

#include "bridge/conform/fuzz/campaign.hpp"

namespace trestle::conform {

/// What a report says besides the result.
struct FuzzInfo {
  std::string device{};
  std::string device_version{};
  std::string profile_file{};
  std::string folder{};
  std::uint64_t seed = 1;
  std::string command{};  ///< that ran the campaign: "trestle fuzz --dut ecu.yaml --seed 1"
};

/// The command that shows a finding again.
[[nodiscard]] std::string replay_command(const Finding& finding, const FuzzInfo& info);
/// A few lines for a terminal.
[[nodiscard]] std::string fuzz_summary(const FuzzResult& result, const FuzzInfo& info);
/// For programs, schema 1: docs/fuzzing.md.
[[nodiscard]] std::string fuzz_json(const FuzzResult& result, const FuzzInfo& info);
/// One self-contained page.
[[nodiscard]] std::string fuzz_page(const FuzzResult& result, const FuzzInfo& info);

}  // namespace trestle::conform
