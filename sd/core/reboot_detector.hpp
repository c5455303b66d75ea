#pragma once
#include "sd/wire/entry.hpp"
#include "someip/core/session_counter.hpp"

namespace trestle::sd {

/// Tells from the Session IDs and Reboot flags of one peer when it was started anew.  [feat_req_someipsd_863]
class RebootDetector {
 public:
  /// How a message came: the peer counts the two apart.  [feat_req_someipsd_765]
  enum class Channel : std::uint8_t { unicast, multicast };

  /// Whether a message with this session and flag shows a reboot since the last one of its channel.
  [[nodiscard]] bool shows_reboot(Channel channel, SessionId session, bool reboot) const noexcept;
  /// Of a message that has come before, with this session: whether it is that one again. Else it is the first
  /// one of a peer that was started anew: session 1 after others.
  [[nodiscard]] bool is_repeated(Channel channel, SessionId session) const noexcept {
    return session != SessionId{1} ||
           (channel == Channel::unicast ? unicast_ : multicast_).session == session;
  }
  /// Takes the message as the last one, which has a session. When it shows a reboot, the other channel starts
  /// anew too: its counter restarted at the same time, which must not be taken for a second reboot.
  void observe(Channel channel, SessionId session, bool reboot) noexcept;

 private:
  struct Last {
    SessionId session = someip::no_session;  // none has come
    bool reboot_flag = false;
  };
  Last unicast_;
  Last multicast_;
};

}  // namespace trestle::sd
