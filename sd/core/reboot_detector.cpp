#include "sd/core/reboot_detector.hpp"

namespace trestle::sd {

// By these rules of the specification reordered datagrams look like a reboot; what is lost by that is renewed
// with the next offer. For duplicates see RecentMessages.
bool RebootDetector::shows_reboot(Channel channel, SessionId session, bool reboot) const noexcept {
  const Last& last = channel == Channel::unicast ? unicast_ : multicast_;
  if (last.session == someip::no_session || !reboot) {
    return false;
  }
  return !last.reboot_flag || last.session >= session;  // [feat_req_someipsd_764]
}

void RebootDetector::observe(Channel channel, SessionId session, bool reboot) noexcept {
  if (shows_reboot(channel, session, reboot)) {
    unicast_ = {};
    multicast_ = {};
  }
  (channel == Channel::unicast ? unicast_ : multicast_) = Last{session, reboot};
}

}  // namespace trestle::sd
