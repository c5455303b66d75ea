#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bridge/conform/fuzz/sequence.hpp"

namespace trestle::conform {

/// What is wrong with a device.
enum class FindingKind : std::uint8_t {
  ended,        ///< its process ended: a crash, or an exit
  silent,       ///< it does not answer any more
  restarted,    ///< its messages say that it was restarted, though nobody did
  breaks_rule,  ///< what it sent breaks a rule of the specification
  slow,         ///< its answers come late
  grows,        ///< its memory grows
  leaks,        ///< it has ever more file descriptors
};

/// "crash", "silence", "restart", "rule", "slowness", "memory", "descriptors".
[[nodiscard]] const char* to_string(FindingKind kind) noexcept;

/// Something that is wrong, and what was sent before it.
struct Finding {
  FindingKind kind{};
  std::string key{};   ///< what makes two findings the same: "rule pcap.sd.entry-reserved"
  std::string what{};  ///< a sentence
  Sequence sequence{};
  bool confirmed = false;       ///< a device that was started anew showed the same
  std::size_t steps_found = 0;  ///< before steps that are not needed were left out
  std::size_t seen = 1;
  std::chrono::milliseconds after{0};  ///< since the run began
  std::string evidence{};              ///< file name of the capture that shows it
};

/// Leaves out steps, and cuts bytes off, as long as the rest still shows the finding.
/// @param shows  tries a sequence. Called at most `budget` times.
[[nodiscard]] Sequence minimised(Sequence sequence, std::size_t budget,
                                 const std::function<bool(const Sequence&)>& shows);

}  // namespace trestle::conform
