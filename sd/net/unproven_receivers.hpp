#pragma once
#include <array>

#include "sd/core/service_discovery.hpp"
#include "sd/net/node_config.hpp"

namespace trestle::sd {

/// What is sent, for the mere asking, to addresses that have not shown to receive anything: somebody may have
/// asked in their name, and a few bytes must not bring them megabytes. Each address has a budget that grows
/// with time. Of those that there is no room for, one takes the place of that with most of its budget left,
/// and has no more than was left of that.
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

}  // namespace trestle::sd
