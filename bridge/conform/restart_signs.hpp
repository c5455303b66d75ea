#pragma once
#include <array>
#include <optional>

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

/// Finds the first message of the device's new life: one with the Reboot flag and session 1 or a session
/// below the one before it [feat_req_someipsd_764], or an offer after a silence. It is told what the device
/// sends, in the order in which that comes.
class NewLife {
 public:
  /// @param began  the time when the restart began.
  /// @param pause  what is longer is a silence; nothing: there is none.
  NewLife(WallTime began, std::optional<Duration> pause) : heard_{began}, pause_{pause} {}

  /// What had come when the restart began.
  void before(const SdSign& sign);
  /// What came then.
  /// @return whether the new life begins with it.
  [[nodiscard]] bool begins_with(const SdSign& sign);

 private:
  WallTime heard_;
  std::optional<Duration> pause_;
  std::array<std::optional<SdSign>, 2> last_{};  ///< by unicast, by multicast
};

}  // namespace trestle::conform
