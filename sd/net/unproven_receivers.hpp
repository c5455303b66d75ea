#pragma once
#include <array>

#include "sd/core/service_discovery.hpp"
#include "sd/net/node_config.hpp"

namespace trestle::sd {

/// What is sent, for the mere asking, to addresses that have not shown to receive anything: somebody may have
/// asked in their name, and a few bytes must not bring them megabytes. Each address has a budget that grows
/// with time. If there is no room, a new address replaces the one with most budget left, and gets no more
/// than that rest.
class UnprovenReceivers {
 public:
  /// @param most           bytes at once to one address.
  /// @param rate_per_s     bytes per second to one address, when those are used up.
  UnprovenReceivers(std::size_t most, std::size_t rate_per_s) noexcept
      : most_{most}, rate_per_s_{rate_per_s} {}

  /// Whether `bytes` more may go there; takes them from its budget then.
  [[nodiscard]] bool take(const IpAddress& to, std::size_t bytes, TimePoint now) noexcept;

 private:
  struct Budget {
    IpAddress address{};  ///< unspecified: unused
    double left = 0;
    TimePoint at{};
  };
  [[nodiscard]] double left_of(const Budget& one, TimePoint now) const noexcept;

  std::size_t most_;
  std::size_t rate_per_s_;
  std::array<Budget, 64> budgets_{};
};

/// Whether nobody outside of this host can have sent in the name of this address: the system takes no such
/// packets from a network.
[[nodiscard]] bool is_of_this_host(const IpAddress& address, const IpAddress& own) noexcept;

/// How often a large initial value goes to one address: somebody may subscribe in its name, again and again,
/// and a hundred bytes must not bring it megabytes each time. So many at once, then one every two seconds.
/// Of those that there is no room for, one takes the place of that which may be sent the most, and begins
/// anew: whoever subscribes with ever other addresses keeps nobody from getting the value.
class RepeatedValues {
 public:
  static constexpr Duration pause = std::chrono::seconds{2};

  explicit RepeatedValues(std::uint16_t at_once) noexcept : at_once_{at_once} {}

  /// Whether the value of this event may go there once more, which then counts.
  [[nodiscard]] bool take(const IpAddress& to, OfferHandle offer, someip::MethodId event,
                          TimePoint now) noexcept;

 private:
  struct Sent {
    IpAddress to{};
    OfferHandle offer{};
    someip::MethodId event{};
    TimePoint free_at{};  // when all would have been sent, had they been sent with pauses
  };

  std::uint16_t at_once_;
  std::array<Sent, 128> sent_{};
};

}  // namespace trestle::sd
