// bridge/conform/fuzz: `trestle fuzz` without its command line: sends a device always new messages, and
// watches what becomes of it.
//
//   campaign.hpp       the loop: make a sequence, send it, look, keep what was new
//   behaviour.hpp      what an answer is, to tell new ones
//   described.hpp      what an interface description says of the services
//   sequences.hpp      makes sequences: into a state first, then messages that are changed a little
//   sequence.hpp       what is sent, as data
//   player.hpp         sends it; reads it from a capture
//   rule_watch.hpp     rules that the device's messages break
//   process_watch.hpp  its memory and descriptors
//   coverage_map.hpp   which of its code was run, where it is built with fuzz/coverage_hook.c
//   finding.hpp        what is wrong, and the shortest way to it
//   fuzz_report.hpp    findings as text, JSON and a page
//
// Messages are made by fuzz/mutate. docs/fuzzing.md explains it to users.
#pragma once
#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bridge/conform/fuzz/finding.hpp"
#include "bridge/conform/profile.hpp"
#include "bridge/describe/model.hpp"

namespace trestle::conform {

/// Where a campaign is.
struct FuzzProgress {
  std::chrono::milliseconds since_begin{0};
  std::uint64_t sequences = 0;
  std::uint64_t messages = 0;  ///< sent
  std::size_t behaviours = 0;  ///< different answers in different states
  std::size_t places = 0;      ///< of the device's code, that were run; 0: it has no hook
  std::size_t findings = 0;
};

struct FuzzOptions {
  std::string folder{};    ///< for captures, and what the device prints; it exists
  std::string programs{};  ///< the folder of the running program
  std::string fault{};     ///< the device is started with it
  std::chrono::milliseconds time{60'000};
  std::uint64_t max_sequences = 0;              ///< ends the campaign; 0: no limit
  const describe::Model* interfaces = nullptr;  ///< of the device's services; null: not known
  std::uint64_t seed = 1;
  std::optional<pid_t> process{};               ///< to be watched; nothing: what the profile starts
  std::size_t max_memory_growth = 128U << 20U;  ///< in bytes; more is a finding
  std::size_t max_descriptor_growth = 64;
  std::size_t max_findings = 20;      ///< ends the campaign
  std::function<bool()> cancelled{};  ///< asked again and again; true ends the campaign
  std::function<void(const FuzzProgress&)> on_progress{};
  std::function<void(const Finding&)> on_finding{};
  std::function<void(const std::string&)> on_problem{};
};

struct FuzzResult {
  FuzzProgress done{};
  std::string started{};                          ///< in UTC, "2026-01-31T12:00:00Z"
  std::map<std::string, std::uint64_t> states{};  ///< how many sequences began with each
  std::size_t kept = 0;                           ///< sequences that showed something new
  std::uint64_t restarts = 0;                     ///< of the device, by us
  std::chrono::microseconds answer_median{0};
  std::chrono::microseconds answer_longest{0};
  std::size_t memory_before = 0;  ///< in bytes; 0: not known
  std::size_t memory_after = 0;
  std::size_t descriptors_before = 0;
  std::size_t descriptors_after = 0;
  /// How often a sign came that a second try did not show: "restart", "slowness", "rule rpc.answered-once".
  std::map<std::string, std::uint64_t> unconfirmed{};
  bool cancelled = false;
  std::string gave_up{};  ///< why it ended before its time; empty: it did not
  std::vector<Finding> findings{};
};

/// Starts the device, fuzzes it until the time is over, and stops it. A device that ends is started again.
/// Captures of findings are written as soon as they are found.
/// @throws TesterError when the tester cannot use its addresses.
/// @throws std::runtime_error when the device cannot be started.
[[nodiscard]] FuzzResult fuzz_device(const Profile& profile, const FuzzOptions& options);

/// Sends one sequence to a device that was started anew, and looks what becomes of it.
/// @return what is wrong; empty: nothing.
[[nodiscard]] std::vector<Finding> replay_sequence(const Profile& profile, const Sequence& sequence,
                                                   const FuzzOptions& options);

}  // namespace trestle::conform
