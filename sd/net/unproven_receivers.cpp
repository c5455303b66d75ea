#include "sd/net/unproven_receivers.hpp"

#include <algorithm>

namespace trestle::sd {

UnprovenReceivers::UnprovenReceivers(std::size_t most, std::size_t rate_per_s, std::uint32_t seed)
    : most_{most}, rate_per_s_{rate_per_s}, budgets_{seed, {.left = static_cast<double>(most), .at = {}}} {}

bool UnprovenReceivers::take(const IpAddress& to, std::size_t bytes, TimePoint now) noexcept {
  Budget& budget = budgets_.at(to);
  const double grown =
      std::chrono::duration<double>(now - budget.at).count() * static_cast<double>(rate_per_s_);
  budget = {std::min(static_cast<double>(most_), budget.left + grown), now};
  if (static_cast<double>(bytes) > budget.left) {
    return false;
  }
  budget.left -= static_cast<double>(bytes);
  return true;
}

bool is_of_this_host(const IpAddress& address, const IpAddress& own) noexcept {
  return address.is_loopback() || (!address.v6 && address == own);
}

bool RepeatedValues::take(const IpAddress& to, OfferHandle offer, someip::MethodId event, std::size_t bytes,
                          TimePoint now) noexcept {
  constexpr std::size_t around = 64;  // headers, which a value of few bytes takes all the same
  constexpr auto most = static_cast<std::int64_t>(someip::max_plain_payload_bytes + around);
  const Duration cost = bytes > someip::max_plain_payload_bytes
                            ? pause
                            : pause_of_datagram * static_cast<std::int64_t>(bytes + around) / most;
  const std::uint64_t value_of =
      (std::uint64_t{offer.index} << 48U) | (std::uint64_t{offer.generation} << 32U) | someip::value(event);
  TimePoint& free_at = free_at_.at(to, value_of);
  const TimePoint next = std::max(free_at, now) + cost;
  if (next > now + pause * at_once_) {
    return false;
  }
  free_at = next;
  return true;
}

}  // namespace trestle::sd
