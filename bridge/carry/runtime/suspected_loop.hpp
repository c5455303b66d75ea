#pragma once
#include <memory>

#include "bridge/carry/runtime/loop_guard.hpp"
#include "bridge/carry/runtime/loop_suspects.hpp"

namespace trestle::carry {

/// Puts on trial what comes again and again by SOME/IP: from one sender all copies come, as they do of one
/// that says the same each time, so that only a trial tells. From a host where somebody could close a ring
/// few are enough. From elsewhere many are needed: such a ring leads over two hosts. On the thread that runs
/// the io_context.
class SuspectedLoop {
 public:
  /// @param what   the route, for the log.
  /// @param words  stand in the log between the suspect and the sender: "the ROS node /x" and
  /// "10.0.0.2:30501".
  SuspectedLoop(RouteClock& clock, std::string what, LoopSuspects suspects, std::string words,
                const LoopCheck::Limits& limits = {});

  [[nodiscard]] const LoopSuspects& suspects() const noexcept { return suspects_; }
  /// Whether what came from there is not to be carried for now.
  /// @param caused  whether one that was carried before may be the cause of this one.
  [[nodiscard]] bool refuses(ByteView payload, const Endpoint& from, const DdsSide& dds,
                             LoopCheck::TimePoint now, bool caused = true);
  /// Messages that were refused.
  [[nodiscard]] std::uint64_t looped() const noexcept {
    return (near_ ? near_->looped() : 0) + (far_ ? far_->looped() : 0);
  }

 private:
  /// Whether so much has come from elsewhere in a second that it is worth a look.
  [[nodiscard]] bool is_much(LoopCheck::TimePoint now) noexcept;

  RouteClock& clock_;
  const std::string what_;
  LoopSuspects suspects_;
  const std::string words_;
  const LoopCheck::Limits near_limits_;
  const LoopCheck::Limits far_limits_;
  std::unique_ptr<LoopGuard> near_;  ///< from when something first came from where one of them is
  std::unique_ptr<LoopGuard> far_;   ///< from when much came from elsewhere
  LoopCheck::TimePoint second_begin_{};
  std::uint32_t in_second_ = 0;  ///< messages from elsewhere
};

}  // namespace trestle::carry
