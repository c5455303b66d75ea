#pragma once
#include <cstdint>
#include <functional>
#include <vector>

#include "sd/core/events.hpp"
#include "someip/wire/types.hpp"

namespace trestle::sd {

/// How long to withhold the services of gateways to the network that we are a gateway to,
/// ServiceDiscovery::be_gateway_to(): until the application knows what it has to know of one, but not longer
/// than some time after it was seen first. No clock of its own; remembers only what is there.
class WithheldServices {
 public:
  using IsKnown = std::function<bool(const RemoteService&)>;

  /// @param is_known  may be empty: nothing is.
  WithheldServices(Duration longest, IsKnown is_known) : longest_{longest}, is_known_{std::move(is_known)} {}

  /// @param all  services that are withheld now.
  /// @return those to admit.
  [[nodiscard]] std::vector<RemoteHandle> to_admit(const std::vector<RemoteService>& all, TimePoint now);
  /// Whether some were not to be admitted yet: to be asked again soon.
  [[nodiscard]] bool waits() const noexcept { return !seen_.empty(); }
  /// How many had to wait so far.
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }

 private:
  struct Seen {
    RemoteHandle service;
    TimePoint first{};
  };
  const Duration longest_;
  const IsKnown is_known_;
  std::vector<Seen> seen_;  ///< of those that wait, by index
  std::uint64_t count_ = 0;
};

}  // namespace trestle::sd
