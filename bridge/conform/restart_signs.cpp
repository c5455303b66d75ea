#include "bridge/conform/restart_signs.hpp"

#include <algorithm>
#include <array>

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

std::optional<std::size_t> begin_of_new_life(const std::vector<SdSign>& messages, std::size_t since,
                                             WallTime began, std::optional<Duration> pause) {
  std::array<const SdSign*, 2> before{};  // by unicast, by multicast
  WallTime heard = began;
  for (std::size_t at = 0; at < messages.size(); ++at) {
    const SdSign& one = messages[at];
    const SdSign*& last = before[one.multicast ? 1 : 0];
    if (at >= since) {
      // The same session again may be one datagram that came twice.
      const bool from_begin = one.session == someip::SessionId{1} ||
                              (last != nullptr && (one.session < last->session || !last->reboot));
      const bool after_silence = one.offers && pause && one.time - heard > *pause;
      if ((one.reboot && from_begin) || after_silence) {
        return at;
      }
    }
    last = &one;
    heard = one.time;
  }
  return std::nullopt;
}

}  // namespace trestle::conform
