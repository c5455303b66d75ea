#pragma once
#include <memory>

#include "bridge/carry/runtime/loop_guard.hpp"
#include "bridge/carry/runtime/loop_suspects.hpp"

namespace trestle::carry {

/// Puts on trial what comes again and again by SOME/IP. In a ring all copies come from one sender. They also
/// do from a sender that says the same each time, so only a trial tells. From a host where somebody could
/// close a ring few copies are enough. From elsewhere many are needed: such a ring leads over two hosts. On
/// the thread that runs the io_context.
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
  [[nodiscard]] std::uint64_t looped() const noexcept { return near_.looped() + far_.looped(); }

 private:
  /// Of each its own: senders elsewhere can neither put those at a suspect's host on trial nor make it
  /// lenient.
  struct Watch {
    const LoopCheck::Limits limits;
    std::unique_ptr<LoopGuard> guard{};  ///< from when it has something to look at
    [[nodiscard]] std::uint64_t looped() const noexcept { return guard ? guard->looped() : 0; }
  };

  /// Whether so much has come from elsewhere in a second that it is worth a look.
  [[nodiscard]] bool is_much(LoopCheck::TimePoint now) noexcept;

  RouteClock& clock_;
  const std::string what_;
  LoopSuspects suspects_;
  const std::string words_;
  Watch near_;  ///< what comes from where one of them is
  Watch far_;   ///< what comes from elsewhere, from when it is much
  LoopCheck::TimePoint second_begin_{};
  std::uint32_t in_second_ = 0;  ///< messages from elsewhere
};

}  // namespace trestle::carry
