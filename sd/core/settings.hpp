#pragma once
#include <optional>

#include "someip/wire/endpoint.hpp"
#include "someip/wire/types.hpp"

namespace trestle::sd {

/// The specification's timing parameters.
struct Timing {
  /// Wait before the first Offer or Find of a service, drawn at random between the two.
  /// [feat_req_someipsd_62] [feat_req_someipsd_63]
  Duration initial_delay_min = std::chrono::milliseconds{10};
  Duration initial_delay_max = std::chrono::milliseconds{100};
  /// Wait before the first repetition; doubled after each.  [feat_req_someipsd_67] [feat_req_someipsd_76]
  Duration repetitions_base_delay = std::chrono::milliseconds{30};
  std::uint8_t repetitions_max = 3;  ///< [feat_req_someipsd_73]
  /// Between offers in the main phase; 0: none are sent there.  [feat_req_someipsd_79]
  Duration cyclic_offer_delay = std::chrono::seconds{1};
  /// Wait before the answer to what came by multicast, drawn at random between the two.
  /// [feat_req_someipsd_84]
  Duration request_response_delay_min{0};
  Duration request_response_delay_max = std::chrono::milliseconds{10};
  /// Lifetime of offers and subscriptions: 1 to 0xFFFFFE seconds; 0xFFFFFF is "until the next reboot".
  std::uint32_t ttl_s = 3;
  friend constexpr bool operator==(const Timing&, const Timing&) = default;
};

/// How a FindService is answered.
enum class FindAnswer : std::uint8_t {
  unicast,  ///< always by unicast  [feat_req_someipsd_824]
  /// The optional behaviour that older test suites expect: by multicast when the Find says that its sender
  /// cannot receive unicast, or, in the main phase, when half a cycle has passed since the last offer.
  /// [feat_req_someipsd_89] [feat_req_someipsd_90] [feat_req_someipsd_91]
  optimised,
};

/// What one ServiceDiscovery is told about its network. It stays the same for the object's whole life.
struct Settings {
  Endpoint unicast;  ///< own SD endpoint: where SD messages leave from and unicast ones arrive
  Endpoint multicast{IpAddress::v4(224, 244, 224, 245), 30490};
  Timing timing;
  /// Peers and the endpoints they name must be in the subnet that `unicast` is in, of this prefix length;
  /// nothing: any subnet.  [feat_req_someipsd_1135] [feat_req_someipsd_1149]
  std::optional<std::uint8_t> subnet_prefix_bits;
  FindAnswer find_answer = FindAnswer::unicast;
  /// Whether we ask for initial events, and say that we understand when others do; off for test suites from
  /// before that feature.  [feat_req_someipsd_1187]
  bool explicit_initial_data = true;
  /// Whether a subscription to TCP events needs a connection that tcp_connected() has told of.
  /// [feat_req_someipsd_1137]
  bool check_tcp_connections = true;
  std::uint16_t max_subscribers_per_eventgroup = 64;
  /// Randomness for the delays. Two stacks of one network should not have the same.
  std::uint64_t seed = 0;
};

}  // namespace trestle::sd
