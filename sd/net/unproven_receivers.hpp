#pragma once
#include <span>
#include <vector>

#include "sd/core/recent_messages.hpp"
#include "sd/core/service_discovery.hpp"
#include "sd/net/node_config.hpp"

namespace trestle::sd {

/// Values kept by a hash that nobody else can foresee, in a fixed number of places: keys may share a place,
/// and what is counted there counts for all of them. So nothing is ever forgotten to make room, and whoever
/// asks in ever other names gains nothing by it, nor takes much from others.
template <typename Value>
class HashedPlaces {
 public:
  static constexpr std::size_t count = 4096;

  HashedPlaces(std::uint32_t seed, Value first) : seed_{seed}, places_(count, first) {}

  /// @param more  of the key, beside the address
  [[nodiscard]] Value& at(const IpAddress& address, std::uint64_t more = 0) noexcept {
    const std::uint32_t of_more = hash_of(seed_, std::as_bytes(std::span{&more, 1}));
    const std::uint32_t hash = hash_of(of_more, std::as_bytes(std::span{address.bytes}));
    return places_[(hash ^ (hash >> 16U)) % count];
  }

 private:
  std::uint32_t seed_;
  std::vector<Value> places_;
};

/// What is sent, for the mere asking, to addresses that have not shown to receive anything: somebody may have
/// asked in their name, and a few bytes must not bring them megabytes. Each address has a budget that grows
/// with time, see HashedPlaces.
class UnprovenReceivers {
 public:
  /// @param most           bytes at once to one address.
  /// @param rate_per_s     bytes per second to one address, when those are used up.
  /// @param seed           that nobody else knows.
  UnprovenReceivers(std::size_t most, std::size_t rate_per_s, std::uint32_t seed);

  /// Whether `bytes` more may go there; takes them from its budget then.
  [[nodiscard]] bool take(const IpAddress& to, std::size_t bytes, TimePoint now) noexcept;

 private:
  struct Budget {
    double left = 0;
    TimePoint at{};
  };

  std::size_t most_;
  std::size_t rate_per_s_;
  HashedPlaces<Budget> budgets_;
};

/// Whether nobody outside of this host can have sent in the name of this address: the system takes no such
/// packets from a network.
[[nodiscard]] bool is_of_this_host(const IpAddress& address, const IpAddress& own) noexcept;

/// How often an initial value goes to one address: somebody may subscribe in its name, again and again, and a
/// hundred bytes must not bring it megabytes each time. In segments so often at once, then once every two
/// seconds; in one datagram five times as often, and more often the smaller it is. See HashedPlaces.
class RepeatedValues {
 public:
  static constexpr Duration pause = std::chrono::seconds{2};
  static constexpr Duration pause_of_datagram = pause / 5;  ///< of the largest

  RepeatedValues(std::uint16_t at_once, std::uint32_t seed) : at_once_{at_once}, free_at_{seed, {}} {}

  /// Whether the value of this event, so many bytes, may go there once more, which then counts.
  [[nodiscard]] bool take(const IpAddress& to, OfferHandle offer, someip::MethodId event, std::size_t bytes,
                          TimePoint now) noexcept;

 private:
  std::uint16_t at_once_;
  HashedPlaces<TimePoint> free_at_;  ///< when all would have been sent, had they been sent with pauses
};

}  // namespace trestle::sd
