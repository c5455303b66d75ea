#include "sd/net/repeated_values.hpp"

#include <algorithm>

namespace trestle::sd {

bool RepeatedValues::take(const IpAddress& to, OfferHandle offer, someip::MethodId event,
                          TimePoint now) noexcept {
  auto place = std::ranges::find_if(
      sent_, [&](const Sent& one) { return one.event == event && one.offer == offer && one.to == to; });
  if (place == sent_.end()) {
    place = std::ranges::min_element(sent_, {}, &Sent::free_at);
    *place = {to, offer, event, {}};
  }
  const TimePoint next = std::max(place->free_at, now) + pause;
  if (next > now + pause * at_once_) {
    return false;
  }
  place->free_at = next;
  return true;
}

}  // namespace trestle::sd
