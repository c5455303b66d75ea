#pragma once
#include <optional>
#include <vector>

#include "bridge/conform/packet.hpp"
#include "bridge/conform/profile.hpp"
#include "someip/wire/types.hpp"

/// How it shows that a device was restarted by somebody else: the tester does not see it end and begin.
namespace trestle::conform {

/// What a message of service discovery tells of it.
struct SdSign {
  WallTime time{};
  bool multicast = false;  ///< each way counts its own sessions
  someip::SessionId session{};
  bool reboot = false;  ///< the Reboot flag
  bool offers = false;  ///< the service that is waited for
};

/// For how long a device may be silent while it runs, at most; nothing: the profile does not tell.
[[nodiscard]] std::optional<Duration> longest_pause(const TimingProfile& timing);

/// The first message of the device's new life: one with the Reboot flag and session 1 or a session below the
/// one before it [feat_req_someipsd_764], or an offer after a silence.
/// @param messages  what the device has sent, in the order in which it came.
/// @param since     the restart began when those before this place had come.
/// @param began     the time of that.
/// @param pause     what is longer is a silence; nothing: there is none.
/// @return its place in `messages`; nothing: there is none so far.
[[nodiscard]] std::optional<std::size_t> begin_of_new_life(const std::vector<SdSign>& messages,
                                                           std::size_t since, WallTime began,
                                                           std::optional<Duration> pause);

}  // namespace trestle::conform
