#include "sd/net/unproven_receivers.hpp"

#include <algorithm>

namespace trestle::sd {

double UnprovenReceivers::left_of(const Budget& one, TimePoint now) const noexcept {
  const double grown = std::chrono::duration<double>(now - one.at).count() * static_cast<double>(rate_per_s_);
  return one.address.is_unspecified() ? static_cast<double>(most_)
                                      : std::min(static_cast<double>(most_), one.left + grown);
}

bool UnprovenReceivers::take(const IpAddress& to, std::size_t bytes, TimePoint now) noexcept {
  auto place = std::ranges::find(budgets_, to, &Budget::address);
  if (place == budgets_.end()) {
    place = std::ranges::max_element(budgets_, {}, [&](const Budget& one) { return left_of(one, now); });
  }
  *place = {to, left_of(*place, now), now};
  if (static_cast<double>(bytes) > place->left) {
    return false;
  }
  place->left -= static_cast<double>(bytes);
  return true;
}

bool is_of_this_host(const IpAddress& address, const IpAddress& own) noexcept {
  return address.is_loopback() || (!address.v6 && address == own);
}

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
