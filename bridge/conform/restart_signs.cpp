#include "bridge/conform/restart_signs.hpp"

#include <algorithm>

namespace trestle::conform {

std::optional<Duration> longest_pause(const TimingProfile& timing) {
  Duration longest{0};
  if (timing.cyclic_offer_delay) {
    // An offer may get lost, and the next one be late.
    longest = 3 * *timing.cyclic_offer_delay;
  }
  if (timing.repetitions_base_delay && timing.repetitions_max) {
    longest =
        std::max<Duration>(longest, 2 * *timing.repetitions_base_delay * (1U << *timing.repetitions_max));
  }
  // Without a cycle, nobody knows what comes when the repetitions are over. No cycle at all is known, too.
  return timing.cyclic_offer_delay && longest > Duration{0} ? std::optional{longest} : std::nullopt;
}

void NewLife::before(const SdSign& sign) {
  last_[sign.multicast ? 1 : 0] = sign;
  heard_ = sign.time;
}

bool NewLife::begins_with(const SdSign& sign) {
  const std::optional<SdSign>& last = last_[sign.multicast ? 1 : 0];
  // The same session again may be one datagram that came twice.
  const bool from_begin =
      sign.session == someip::SessionId{1} || (last && (sign.session < last->session || !last->reboot));
  const bool after_silence = sign.offers && pause_ && sign.time - heard_ > *pause_;
  const bool begins = (sign.reboot && from_begin) || after_silence;
  before(sign);
  return begins;
}

}  // namespace trestle::conform
