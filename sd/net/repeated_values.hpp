#pragma once
#include <array>

#include "sd/core/service_discovery.hpp"

namespace trestle::sd {

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
