#pragma once
#include <optional>
#include <variant>

#include "sd/wire/offer_options.hpp"
#include "someip/wire/endpoint.hpp"

namespace trestle::sd {

/// Names something the application asked for. Stays safe to use after its end: it is then unknown.
template <typename Tag>
struct Handle {
  std::uint16_t index = 0;
  std::uint16_t generation = 0;  ///< 0: names nothing
  friend constexpr bool operator==(const Handle&, const Handle&) = default;
};
using OfferHandle = Handle<struct OfferTag>;
using RequirementHandle = Handle<struct RequirementTag>;
using SubscriptionHandle = Handle<struct SubscriptionTag>;
/// An offer of a peer, from ServiceAvailable to ServiceLost.
using RemoteHandle = Handle<struct RemoteTag>;

/// Why a remote service, a subscription or a subscriber is gone.
enum class LossReason : std::uint8_t {
  stopped,      ///< the peer said so: StopOfferService, StopSubscribeEventgroup
  expired,      ///< its TTL ran out
  rebooted,     ///< the peer was started anew  [feat_req_someipsd_871]
  replaced,     ///< the service is offered with other endpoints or another minor version
  link_down,    ///< our own link went down
  unreachable,  ///< tcp_closed() or unreachable() told so  [feat_req_someipsd_435]
  displaced,    ///< the table is full, and it had to make room: see DiscoveryRules::silent_after
};

/// The reason's name as it stands above, for logs.
[[nodiscard]] const char* to_string(LossReason reason) noexcept;

/// A subscriber of one of our eventgroups.
struct Subscriber {
  Endpoint peer;                ///< its SD endpoint
  std::optional<Endpoint> udp;  ///< where it receives unicast events by UDP
  std::optional<Endpoint> tcp;  ///< its end of the connection for TCP events
  /// Bytes of datagrams that its socket for UDP events has room for, as receive_buffer_key tells. 0: unknown.
  std::uint32_t receive_buffer_bytes = 0;
  friend constexpr bool operator==(const Subscriber&, const Subscriber&) = default;
};

/// A service that a peer offers.
struct RemoteService {
  ServiceId service{};
  InstanceId instance{};
  std::uint8_t major = 0;
  std::uint32_t minor = 0;
  std::optional<Endpoint> udp;  ///< where it is reached, and its UDP events come from
  std::optional<Endpoint> tcp;
  Endpoint peer;  ///< its SD endpoint
  OfferOptions options{};
  RemoteHandle handle{};  ///< for ServiceDiscovery::configuration()
  friend constexpr bool operator==(const RemoteService&, const RemoteService&) = default;
};

/// A service that somebody else offers now.
struct Takeover {
  RemoteService service;
  Endpoint from;  ///< SD endpoint of the peer that offered it before
  /// Whether it is the one that held it before, and `from` came while it was away; otherwise `from` does not
  /// answer.
  bool is_back = false;
};

/// Server: a new subscription was accepted. Send its Ack, then, when `initial_data`, the values of the
/// eventgroup's fields by unicast.  [feat_req_someipsd_107] [feat_req_someipsd_833]
struct SubscriberAdded {
  OfferHandle offer;
  EventgroupId eventgroup{};
  Subscriber subscriber;
  bool initial_data = false;
};

/// Server: a subscriber that is known already wants the fields' values again.  [feat_req_someipsd_1188]
struct InitialDataRequested {
  OfferHandle offer;
  EventgroupId eventgroup{};
  Subscriber subscriber;
};

/// Server: events must not go there any more. Not sent for what the application itself ended.
struct SubscriberRemoved {
  OfferHandle offer;
  EventgroupId eventgroup{};
  Subscriber subscriber;
  LossReason reason{};
};

/// Server: the client of this TCP connection was started anew and knows nothing of it: close it. Not told of
/// connections later than the client's last message: they may be new.  [feat_req_someipsd_872]
struct ConnectionOutdated {
  Endpoint own;
  Endpoint client;
};

/// Client: a service that fits the requirement is offered. Comes again, without a ServiceLost in between,
/// when its configuration or load balancing changes.
struct ServiceAvailable {
  RequirementHandle requirement;
  RemoteService service;
};

/// Client: a service of the requirement is gone. Its subscriptions are over, each told of by its own
/// SubscriptionLost; they are renewed when the service comes back, those with a TCP endpoint after
/// reconnected(). After a reboot reset its TCP connections.  [feat_req_someipsd_872]
struct ServiceLost {
  RequirementHandle requirement;
  RemoteService service;
  LossReason reason{};
};

/// Client: the server accepted the subscription. Comes again only when `multicast` changes.
struct Subscribed {
  SubscriptionHandle subscription;
  /// Where the server sends multicast events to: join it at once.  [feat_req_someipsd_791]
  std::optional<Endpoint> multicast;
};

/// Client: the server refused the subscription, perhaps one that it had accepted before; for TCP events check
/// the connection. Tried again with the next offer; told again only after a success. [feat_req_someipsd_869]
struct SubscriptionRefused {
  SubscriptionHandle subscription;
};

/// Client: an accepted subscription is over for now. It is renewed by itself with the server's next offer.
struct SubscriptionLost {
  SubscriptionHandle subscription;
  LossReason reason{};
};

using Happening =
    std::variant<SubscriberAdded, InitialDataRequested, SubscriberRemoved, ConnectionOutdated,
                 ServiceAvailable, ServiceLost, Subscribed, SubscriptionRefused, SubscriptionLost>;

}  // namespace trestle::sd
