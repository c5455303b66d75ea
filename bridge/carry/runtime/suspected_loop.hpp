#pragma once
#include <memory>

#include "bridge/carry/runtime/loop_guard.hpp"
#include "bridge/carry/runtime/loop_suspects.hpp"

namespace trestle::carry {

/// Puts on trial what comes again and again by SOME/IP from a host where somebody could close a ring: from
/// one sender all copies come, as they do of one that says the same each time, so that only a trial tells.
/// On the thread that runs the io_context.
class SuspectedLoop {
 public:
  /// @param what   the route, for the log.
  /// @param words  stand in the log between the suspect and the sender: "the ROS node /x" and
  /// "10.0.0.2:30501".
  SuspectedLoop(RouteClock& clock, std::string what, LoopSuspects suspects, std::string words,
                const LoopCheck::Limits& limits = {});

  [[nodiscard]] const LoopSuspects& suspects() const noexcept { return suspects_; }
  /// Whether what came from there is not to be carried for now.
  [[nodiscard]] bool refuses(ByteView payload, const Endpoint& from, const DdsSide& dds,
                             LoopCheck::TimePoint now);
  /// Messages that were refused.
  [[nodiscard]] std::uint64_t looped() const noexcept { return guard_ ? guard_->looped() : 0; }

 private:
  RouteClock& clock_;
  const std::string what_;
  LoopSuspects suspects_;
  const std::string words_;
  const LoopCheck::Limits limits_;
  std::unique_ptr<LoopGuard> guard_;  ///< from when something first came from where one of them is
};

}  // namespace trestle::carry
