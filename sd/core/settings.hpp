#pragma once
#include <optional>
#include <span>

#include "sd/wire/option.hpp"
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

/// That messages from the host `peer` may name endpoints of the host `named`.
struct ForeignEndpoints {
  IpAddress peer;
  IpAddress named;
  friend constexpr bool operator==(const ForeignEndpoints&, const ForeignEndpoints&) = default;
};

/// Where the specification leaves a choice. The defaults are what it asks for, or asks for first;
/// docs/sd_options.md tells the reasons.
struct DiscoveryRules {
  /// Peers and the endpoints they name must be in the subnet that `unicast` is in, of this prefix length;
  /// nothing: any subnet.  [feat_req_someipsd_1135] [feat_req_someipsd_1149]
  std::optional<std::uint8_t> subnet_prefix_bits{};
  /// Loopback addresses of peers, and of endpoints they name, are refused unless our own address is one.
  /// False: another stack of the same host may be there.  [feat_req_someipsd_1233] [feat_req_someipsd_1149]
  bool refuse_loopback = true;
  /// Whether a peer may name endpoints only at its own address, from which its datagram comes: as its SD
  /// endpoint, in offers and in subscriptions. Otherwise anybody could speak in the name of others, and have
  /// messages sent to them that they did not ask for.  [feat_req_someipsd_1149]
  bool own_endpoints_only = true;
  FindAnswer find_answer = FindAnswer::unicast;
  /// Whether a Find is also answered in the repetition phase, where the next Offer is near anyway.
  /// [feat_req_someipsd_811]
  bool answer_finds_in_repetition_phase = true;
  /// Whether we ask for initial events, and say that we understand such a request. Off for test suites from
  /// before that feature.  [feat_req_someipsd_1187]
  bool explicit_initial_data = true;
  /// Whether subscriptions to TCP events need a connection, see tcp_connected().  [feat_req_someipsd_1137]
  bool check_tcp_connections = true;
  /// Whether a subscription to an eventgroup with UDP and TCP events may name an endpoint of only one of the
  /// two, and then gets only those events.  [feat_req_someipsd_102]
  bool accept_partial_endpoints = false;
  /// Whether a subscription to what is not offered is refused with a Nack, as the specification asks for;
  /// off: it is ignored, as some stacks do.  [feat_req_someipsd_1164] [feat_req_someipsd_1137]
  bool answer_unknown_subscriptions = true;
  /// Whether an entry is refused when it references an option of unknown type that is not marked discardable.
  /// Requirement _102 asks for it; _1142 says to ignore such options, which keeps newer peers working.
  bool refuse_unknown_options = false;
  /// Whether offers reference the multicast endpoint that all multicast eventgroups of the service share.
  /// Requirement _855 asks for it, the table of _946 allows an offer no multicast option.
  bool multicast_option_in_offers = false;
  /// Where peers shall send their answers, if not to `unicast`, the source of our datagrams (behind a NAT,
  /// for example). Of the same IP version; goes into each message as an SD endpoint option.
  /// [feat_req_someipsd_1081] [feat_req_someipsd_1156] [feat_req_someipsd_1155]
  std::optional<Endpoint> sd_endpoint{};
  /// Whether messages from a port other than SD's are dropped, as some stacks do; no requirement asks for it.
  bool only_from_sd_port = false;
  /// The upper byte of the Client ID of our messages.  [feat_req_someipsd_26]
  std::uint8_t client_id_prefix = 0;
  /// Whether an acknowledged subscription of infinite TTL is renewed with each Offer, like others. Otherwise
  /// it is made anew only after a reboot of the server, and that goes unnoticed when the first messages of
  /// the restarted server are lost.  [feat_req_someipsd_431]
  bool renew_infinite_subscriptions = true;
  /// Whether our subscriptions tell, by a configuration option, how much may be sent to their UDP endpoint at
  /// once: see receive_buffer_key. Only servers that know explicit initial data are told, because some older
  /// ones fail at such an option. The same goes for the offers of a Node, of services whose description says
  /// which methods take large requests.  [feat_req_someipsd_946]
  bool tell_receive_buffer = true;
  std::uint16_t max_subscribers_per_eventgroup = 64;
  /// Of these from one address: as many as have different counters.  [feat_req_someipsd_322]
  std::uint16_t max_subscribers_per_eventgroup_and_address = 16;
  /// Peers at one address, at different ports. A further one takes the place of another one there.
  std::uint16_t max_peers_per_address = 16;
  std::uint16_t max_reboots_at_once = 8;  ///< see reboot_pause
  /// Exceptions from own_endpoints_only: hosts with several addresses, or behind a NAT. It is read later, so
  /// it must outlive this object.
  const std::span<const ForeignEndpoints>* foreign_endpoints = nullptr;
  /// When a table is full, entries of a peer make room for a newcomer if the peer was silent for this long,
  /// or for twice the time that it was heard before, whatever TTL it named. So a peer that speaks once soon
  /// gives way, and one that renews stays. If no peer is silent, an entry of the address with the most gives
  /// way, if the newcomer's address has fewer.
  Duration silent_after = std::chrono::seconds{10};
  /// FindService and SubscribeEventgroup entries taken from one address (in small cores, from each port), and
  /// offers that it withdraws or changes: on average, and in a row. A refused one counts as four. Answers to
  /// our subscriptions count when they change one unasked. Further ones are ignored; an offer that is new, or
  /// only repeats another, is always taken. Each at least 1.
  /// Also how often each subscription asks further hosts that offer the same as one that has not answered
  /// yet.
  std::uint32_t max_entries_per_second = 2000;
  std::uint32_t max_entries_at_once = 10'000;
  /// Reboots of one peer that are believed: on average one in each such pause, and max_reboots_at_once in a
  /// row. Messages that show further ones are dropped.
  Duration reboot_pause = std::chrono::seconds{5};
  /// A message is a duplicate made by the network if it equals one of the peer's last four, session included,
  /// and the peer was never silent for this long since. A duplicate is dropped; otherwise it would look like
  /// a reboot, as session 1 after others does. A peer that sends one message, is restarted within this time
  /// and sends the same one again is not noticed: its subscriptions go on, and so do ours to it, which the
  /// next Offer renews. 0: no message is a duplicate.  [feat_req_someipsd_863]
  Duration duplicate_window = std::chrono::milliseconds{500};
  /// The rank of a service that is offered without load balancing option: by default after all others.
  /// [feat_req_someipsd_174]
  LoadBalancingOption unranked{.priority = 0xffff, .weight = 0};
};

/// What a ServiceDiscovery is told about its network. It stays the same for the object's whole life.
struct Settings : DiscoveryRules {
  Endpoint unicast;  ///< own SD endpoint: where SD messages leave from and unicast ones arrive
  Endpoint multicast{IpAddress::v4(224, 244, 224, 245), 30490};
  Timing timing;
  /// Randomness for the delays. Two stacks of one network should not have the same.
  std::uint64_t seed = 0;
};

}  // namespace trestle::sd
