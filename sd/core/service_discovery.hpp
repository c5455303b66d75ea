// sd/core: service discovery, server and client, without sockets, clock, threads, exceptions or heap.
//
//   service_discovery.hpp  the whole interface. Its functions are in several files:
//                          server_side.cpp (offers, subscribers), client_side.cpp (our subscriptions),
//                          remote_services.cpp (offers of peers, Finds), rivals.cpp (which of two servers is
//                          kept), peers.cpp (peers, restarts, limits),
//                          losses.cpp (telling the application what has ended)
//   settings.hpp           what it is told about the network; storage.hpp: its memory and limits
//   events.hpp             what it tells the application
//   offer_schedule.hpp     when Offers and Finds are sent
//   entry_options.hpp      what the options of an entry mean
//   device/                a whole UDP device in one object, for firmware
#pragma once
#include <algorithm>

#include "sd/core/bounded_queue.hpp"
#include "sd/core/entry_options.hpp"
#include "sd/core/find_id.hpp"
#include "sd/core/known_failures.hpp"
#include "sd/core/random.hpp"
#include "sd/core/storage.hpp"
#include "someip/wire/counters.hpp"

namespace trestle::sd {

class SdWriter;

/// Why a call of the application was refused; nothing has changed then.
enum class SdError : std::uint8_t {
  table_full,      ///< the limit for this is reached
  duplicate,       ///< the same service instance and major version is offered already, or an eventgroup twice
  bad_argument,    ///< an id, endpoint or TTL that cannot be; each call says what it needs
  unknown_handle,  ///< the handle names nothing, or something that has ended
};

/// The error's name as it stands above, for logs.
[[nodiscard]] const char* to_string(SdError error) noexcept;

/// Why a peer's subscription was refused, in the order in which it is checked.  [feat_req_someipsd_1164]
/// [feat_req_someipsd_1137]
enum class NackReason : std::uint8_t {
  unknown_service,
  unknown_instance,
  unknown_major,
  unknown_eventgroup,
  bad_options,        ///< an option that is missing, malformed, impossible, in conflict with another, or of a
                      ///< foreign endpoint: DiscoveryRules::own_endpoints_only
  missing_endpoint,   ///< none where the eventgroup's events could be sent to
  no_tcp_connection,  ///< it names one that is not open
  no_room,
  not_allowed,  ///< see ServiceDiscovery::judge_entries(); checked before all others. Not in a build for
                ///< size.
};
inline constexpr std::size_t nack_reasons = optimised_for_many ? 9 : 8;

/// The reason in words, for logs.
[[nodiscard]] const char* to_string(NackReason reason) noexcept;

/// What must not be exceeded. Each has a setting of its own.
enum class Limit : std::uint8_t {
  peers,
  subscribers,
  subscribers_per_eventgroup,
  subscribers_per_eventgroup_and_address,
  remote_services,
  tcp_connections,
  configurations,
  configuration_bytes,
  pending_entries,
  pending_events,
  entries_per_second,
  reboots,
};
inline constexpr std::size_t limit_count = 12;

/// The name of the setting that raises it, as in Limits or DiscoveryRules: "max_peers".
[[nodiscard]] const char* to_string(Limit limit) noexcept;

/// A service instance of ours.
struct OfferedService {
  ServiceId service{};
  InstanceId instance{};
  std::uint8_t major = 1;
  std::uint32_t minor = 0;
  /// Where it is reached, and where its events come from: one or both.  [feat_req_someipsd_681]
  std::optional<Endpoint> udp{};
  std::optional<Endpoint> tcp{};
  std::span<const Eventgroup> eventgroups{};  ///< read during the call
  std::optional<std::uint32_t> ttl_s{};       ///< else that of the Timing
  /// What else is to be said about it, in this order, equal keys included; read during the call. A service of
  /// other_protocols is named by its one `otherserv` item, no other may have one.  [feat_req_someipsd_857]
  /// [feat_req_someipsd_500] [feat_req_someipsd_502] [feat_req_someipsd_1228]
  std::span<const ConfigurationItem> configuration{};
  OfferOptions options{};
};

/// A service that the application needs.
struct RequiredService {
  ServiceId service{};
  InstanceId instance = someip::any_instance;
  std::uint8_t major = any_major;
  std::uint32_t minor = any_minor;
  /// The name of a service of other_protocols (needed); read during the call.  [feat_req_someipsd_503]
  std::string_view otherserv{};
};

/// A subscription to an eventgroup of a required service.
struct EventgroupRequest {
  EventgroupId eventgroup{};
  /// May be left out when the requirement names an instance.
  std::optional<InstanceId> instance{};
  /// Where events are received: have the port open before.  [feat_req_someipsd_1182]
  std::optional<Endpoint> udp{};
  /// Our end of the connection to the server: have it open before.  [feat_req_someipsd_767]
  std::optional<Endpoint> tcp{};
  std::optional<std::uint32_t> ttl_s{};  ///< else that of the Timing
  /// Subscribe anew when no event_received() came for this long, counted from the Ack and from each event:
  /// more than the longest pause between two events of the eventgroup.  [feat_req_someipsd_439]
  std::optional<Duration> silence_timeout{};
  /// Bytes that the socket of `udp` has room for; 0: not told. See DiscoveryRules::tell_receive_buffer.
  std::uint32_t receive_buffer_bytes = 0;
};

/// A datagram to be sent from the own SD endpoint.
struct Transmit {
  Endpoint destination;
  ByteView bytes;  ///< at the front of the room given to poll_transmit()
};

/// Whether an OfferService or SubscribeEventgroup entry of the host `from` is to be heard. Asked during
/// on_datagram(), and must not call the ServiceDiscovery.
struct EntryJudge {
  bool (*is_allowed)(void* context, const Entry& entry,
                     const IpAddress& from) noexcept = nullptr;  ///< null: all
  void* context = nullptr;                                       ///< passed to it
};

/// What happened since construction.
struct SdCounters {
  std::uint64_t datagrams_received = 0;
  std::uint64_t messages_received = 0;  ///< SD messages that were processed
  std::uint64_t datagrams_sent = 0;
  std::uint64_t entries_sent = 0;
  std::uint64_t reboots_detected = 0;

  // Datagrams and messages that were dropped as a whole.
  std::uint64_t dropped_down = 0;        ///< came while the link was down
  std::uint64_t dropped_own = 0;         ///< our own, come back
  std::uint64_t dropped_source = 0;      ///< from an address that cannot be a peer's
  std::uint64_t dropped_not_sd = 0;      ///< other SOME/IP messages
  std::uint64_t dropped_malformed = 0;   ///< SOME/IP or SD framing broken
  std::uint64_t dropped_reboots = 0;     ///< showed another reboot than may be taken for real
  std::uint64_t dropped_duplicates = 0;  ///< came again: see DiscoveryRules::duplicate_window

  // Entries that were ignored, or answered with a Nack.
  std::uint64_t ignored_unknown_type = 0;
  /// Came by multicast where only unicast is allowed, or unannounced.
  std::uint64_t ignored_wrong_transport = 0;
  std::uint64_t ignored_unknown_subscriptions = 0;  ///< see DiscoveryRules::answer_unknown_subscriptions
  std::uint64_t ignored_bad_options = 0;
  /// Offers and SD endpoints, see DiscoveryRules::own_endpoints_only; of the latter the sender's address.
  std::uint64_t ignored_foreign_endpoints = 0;
  std::uint64_t ignored_conflicting_offer = 0;  ///< the service is offered by another peer already
  std::uint64_t ignored_unexpected_ack = 0;     ///< for nothing we subscribed to
  std::uint64_t ignored_no_room = 0;            ///< some table or queue is full
  std::uint64_t ignored_too_many = 0;  ///< Finds, Subscribes and answers beyond max_entries_per_second
  std::uint64_t displaced = 0;  ///< subscribers, services and peers in use that had to make room for others
  /// How often each limit kept something out; indexed by Limit.
  std::array<std::uint64_t, limit_count> limits_reached{};
  std::uint64_t configurations_cut = 0;  ///< offers whose configuration found no room, or not all of it
  std::uint64_t nacks_sent = 0;
  std::array<std::uint64_t, nack_reasons> nacks_by_reason{};  ///< indexed by NackReason
  std::uint64_t silences = 0;                                 ///< subscriptions made anew since no event came
  std::uint64_t unsendable_entries = 0;                       ///< did not even fit into an empty datagram
  std::uint64_t lost_events = 0;                              ///< poll_event() was not called in time

  template <typename Visit>
  constexpr void for_each_counter(Visit visit) const {
    using enum someip::CounterKind;
    visit("datagrams_received", datagrams_received, traffic);
    visit("messages_received", messages_received, traffic);
    visit("datagrams_sent", datagrams_sent, traffic);
    visit("entries_sent", entries_sent, traffic);
    visit("nacks_sent", nacks_sent, traffic);
    visit("reboots_detected", reboots_detected, traffic);
    visit("own_echoes", dropped_own, traffic);
    visit("duplicates", dropped_duplicates, traffic);
    visit("subscribed_anew", silences, traffic);
    visit("down", dropped_down, loss);
    visit("source", dropped_source, loss);
    visit("not_sd", dropped_not_sd, loss);
    visit("malformed", dropped_malformed, loss);
    visit("no_room", ignored_no_room, loss);
    visit("too_many", ignored_too_many, loss);
    visit("too_many_reboots", dropped_reboots, loss);
    visit("displaced", displaced, loss);
    visit("unknown_type", ignored_unknown_type, loss);
    visit("wrong_transport", ignored_wrong_transport, loss);
    visit("unknown_subscriptions", ignored_unknown_subscriptions, loss);
    visit("bad_options", ignored_bad_options, loss);
    visit("foreign_endpoints", ignored_foreign_endpoints, loss);
    visit("configurations_cut", configurations_cut, loss);
    visit("lost_events", lost_events, loss);
    visit("conflicting_offer", ignored_conflicting_offer, loss);
    visit("unexpected_ack", ignored_unexpected_ack, loss);
    visit("unsendable", unsendable_entries, loss);
    for (std::size_t i = 0; i < limit_count; ++i) {
      visit(to_string(static_cast<Limit>(i)), limits_reached[i], loss);
    }
    constexpr std::array nacks{"nacks_unknown_service",    "nacks_unknown_instance", "nacks_unknown_major",
                               "nacks_unknown_eventgroup", "nacks_bad_options",      "nacks_missing_endpoint",
                               "nacks_no_tcp_connection",  "nacks_no_room",          "nacks_not_allowed"};
    for (std::size_t i = 0; i < nack_reasons; ++i) {
      visit(nacks[i], nacks_by_reason[i], loss);
    }
  }
};

/// SOME/IP service discovery of one node, server and client side, without I/O: it is told what arrives and
/// what time it is, and asked what to send, what happened, and when to be called again.
///
///     discovery.on_datagram(bytes, from, via_multicast, now);   // whenever one arrives
///     discovery.on_time(now);                                   // at deadline(), or at any other time
///     // then, and after each other call:
///     while (auto datagram = discovery.poll_transmit(room, now)) { send(*datagram); }
///     while (auto event = discovery.poll_event()) { ... }       // may make calls: then transmit again
///     rearm_timer(discovery.deadline());
///
/// In that order: an Ack must leave before the initial events that SubscriberAdded asks for.
/// `now` must not go back from call to call. Nothing here blocks, throws or allocates. Single-threaded.
class ServiceDiscovery {
 public:
  /// @param storage  of Storage<>::view(); its sizes are the limits.
  ServiceDiscovery(const Settings& settings, const StorageView& storage) noexcept;
  ServiceDiscovery(const ServiceDiscovery&) = delete;
  ServiceDiscovery& operator=(const ServiceDiscovery&) = delete;

  // --- Server ---------------------------------------------------------------------------------------------

  /// Starts to offer a service.  [feat_req_someipsd_22]
  /// @return its handle, or
  ///         bad_argument  a service, instance or eventgroup 0x0000 or 0xffff, major 0xff, no endpoint, an
  ///                       endpoint with port 0 or a multicast or unspecified address, a multicast endpoint
  ///                       that is none, TTL 0, a configuration that cannot be written or is too long, a name
  ///                       or MAC groupcast where none may be, or no name where one must be;
  ///         duplicate, table_full.
  [[nodiscard]] Result<OfferHandle, SdError> offer(const OfferedService& service, TimePoint now) noexcept;

  /// Withdraws an offer and its subscribers. The handle ends. Without effect for an unknown handle.
  /// [feat_req_someipsd_820] [feat_req_someipsd_830]
  void stop_offer(OfferHandle offer, TimePoint now) noexcept;

  /// This host is a gateway: what it offers comes from another network, which is known by this multicast
  /// endpoint. From now on our messages with offers tell that, by a multicast option that no entry
  /// references: hosts that do not know it ignore it. A service that appears in such a message of another
  /// host, which is a gateway to the same network, is withheld: it is as if it were not offered, until
  /// admit(). So nothing that comes from that network goes back there before it is known there whether the
  /// two hosts have the same. Without effect in a build for size.
  void be_gateway_to(const Endpoint& network) noexcept { std::ranges::fill(gateway_to_, network); }
  /// Takes a service that is withheld, Remote::is_withheld(), as if it were offered only now.
  void admit(const RemoteHandle& service, TimePoint now) noexcept;

  /// From now on entries are heard only if the judge allows them: an Offer that it does not allow is ignored,
  /// a Subscribe gets a Nack. Without effect in a build for size.
  void judge_entries(const EntryJudge& judge) noexcept { std::ranges::fill(entry_judge_, judge); }

  /// Calls `visit(const Subscriber&)` for each subscriber of an eventgroup.  [feat_req_someipsd_432]
  template <typename Visit>
  void for_each_subscriber(OfferHandle offer, EventgroupId eventgroup, Visit visit) const {
    if (offers_.find(offer) == nullptr) {
      return;
    }
    for (const slots::Subscriber& slot : subscribers_) {
      if (slot.offer == offer.index && slot.eventgroup == eventgroup) {
        visit(subscriber_of(slot));
      }
    }
  }

  /// How many bytes the socket at this UDP endpoint has room for, as any subscription from there tells, or 0.
  [[nodiscard]] std::uint32_t receive_buffer_of(const Endpoint& client) const noexcept;

  /// The subscription in this place, below max_subscribers, of the table of all; null when there is none, or
  /// it is to another offer. Valid until the next call that is told the time.
  [[nodiscard]] const slots::Subscriber* subscription(OfferHandle offer, std::size_t place) const noexcept;

  /// Adds a subscriber that both sides are configured with, so that it never says so: it stays as long as the
  /// offer, whatever happens to the link. SubscriberAdded does not tell of it. In an eventgroup without UDP
  /// and TCP events, `client` merely makes it one more subscriber.  [feat_req_someipsd_444]
  /// @return bad_argument  no such eventgroup, one with TCP events, or an endpoint as in subscribe();
  ///         unknown_handle, duplicate, table_full (also: max_subscribers_per_eventgroup).
  [[nodiscard]] Result<void, SdError> add_subscriber(OfferHandle offer, EventgroupId eventgroup,
                                                     const Endpoint& client) noexcept;

  /// A client opened or closed a TCP connection to `own`; its subscriptions need it.  [feat_req_someipsd_767]
  /// @return false when there is no room to remember it: its subscriptions will be refused.
  bool tcp_connected(const Endpoint& own, const Endpoint& client) noexcept;
  void tcp_closed(const Endpoint& own, const Endpoint& client) noexcept;
  /// Whether a subscription needs the connection of this client to `own`.
  [[nodiscard]] bool tcp_needed(const Endpoint& own, const Endpoint& client) const noexcept;

  /// Whether this address has shown to receive what we send: it has a TCP connection here, or a subscription
  /// by UDP and has answered doubts.
  [[nodiscard]] bool is_proven(const IpAddress& client) const noexcept;
  /// Subscriptions in the name of this address may be forged, which matters now: as long as it has some, it
  /// is sent Offers at times that nobody can foresee, until it has subscribed several times right after one.
  /// That takes some seconds. Without effect in a build for size, or without guards: there, each subscription
  /// counts as a proof.
  void doubt(const IpAddress& client) noexcept;

  /// Sending an event by UDP failed because `subscriber` cannot be reached: its subscriptions end.
  /// [feat_req_someipsd_435]
  void unreachable(const Endpoint& subscriber) noexcept;

  // --- Client ---------------------------------------------------------------------------------------------

  /// Starts to look for a service of other nodes; own offers are not found.  [feat_req_someipsd_18]
  /// @return its handle; ServiceAvailable tells of each instance found, at once of those known already. Or
  ///         bad_argument for service 0x0000 or 0xffff, instance 0x0000, or a name where none may be or none
  ///         where one must be; table_full.
  [[nodiscard]] Result<RequirementHandle, SdError> require(const RequiredService& service,
                                                           TimePoint now) noexcept;

  /// The service is not needed any more: ends its subscriptions and handles too.  [feat_req_someipsd_822]
  void release(RequirementHandle requirement, TimePoint now) noexcept;

  /// Of the services that are offered and fit the requirement, the one to use: one of the lowest priority
  /// value, at random by their weights. Another call may choose another.  [feat_req_someipsd_770]
  /// If some have answered, see answered(), it is one of those. If some are not mute, it is none of the mute
  /// ones: the priority of an impostor must not count. If all are mute, it is any.
  [[nodiscard]] std::optional<RemoteService> choose(RequirementHandle requirement) noexcept;

  /// Calls `visit(const slots::Remote&)` for each service of a peer that is known: also those that nobody
  /// requires, as long as there is room for them.
  template <typename Visit>
  void for_each_remote(Visit visit) const {
    for (const slots::Remote& remote : remotes_) {
      visit(remote);
    }
  }
  [[nodiscard]] RemoteService service_of(const slots::Remote& remote) const noexcept;
  /// Calls `visit(const slots::Peer&)` for each other node that has been heard, and not been forgotten since.
  template <typename Visit>
  void for_each_peer(Visit visit) const {
    for (const slots::Peer& peer : peers_) {
      visit(peer);
    }
  }
  /// How many these are.
  [[nodiscard]] std::size_t known_peers() const noexcept { return peers_.size() - peers_.free_slots(); }
  /// A peer's service; nothing when it is gone.
  [[nodiscard]] std::optional<RemoteService> remote(RemoteHandle service) const noexcept;
  /// When two nodes offer the same instance, the one that answers is kept: a server that was asked several
  /// times in a row and has not answered gives way. Answers to subscriptions are noticed here; answers to
  /// calls the application reports. Without effect for services that are gone.
  void not_answered(RemoteHandle service) noexcept;
  void answered(RemoteHandle service) noexcept;
  /// It is not offered in the way that the application needs, so it cannot even be asked. Then it counts as
  /// one that does not answer, unless it has answered to something else.
  void is_of_no_use(RemoteHandle service) noexcept;
  /// Whether it was asked several times in a row and has not answered. False when it is gone.
  [[nodiscard]] bool is_mute(RemoteHandle service) const noexcept;
  /// The last service that SdCounters::ignored_conflicting_offer counted; nothing when it had to give way.
  [[nodiscard]] std::optional<RemoteService> contested() const noexcept;
  /// The last service that another peer took over since the last call: because the one that had offered it
  /// did not answer, or had offered nothing that fits a requirement, or had come while the other was away,
  /// which had held it for a longer time.
  [[nodiscard]] std::optional<Takeover> take_takeover() noexcept;
  /// The service that a subscription is to; nothing while there is none.
  [[nodiscard]] std::optional<RemoteService> server_of(SubscriptionHandle subscription) const noexcept;

  /// Walks over the configuration of a peer's service: the items of all its configuration options, in their
  /// order, equal keys included. No items when the service is gone. The cursor and its items are valid until
  /// the next call that is told the time.  [feat_req_someipsd_1146] [feat_req_someipsd_1147]
  [[nodiscard]] ConfigurationCursor configuration(RemoteHandle service) const noexcept;

  /// Subscribes to an eventgroup, as soon as the service is offered and again with each offer.
  /// [feat_req_someipsd_428] [feat_req_someipsd_431]
  /// @return its handle, or
  ///         bad_argument  no instance, TTL 0, an endpoint with port 0, with a multicast or
  ///                       unspecified address, or with an address of another IP version
  ///                       than ours;
  ///         unknown_handle, table_full (also: 16 subscriptions to one eventgroup).
  [[nodiscard]] Result<SubscriptionHandle, SdError> subscribe(RequirementHandle requirement,
                                                              const EventgroupRequest& request,
                                                              TimePoint now) noexcept;

  /// Ends a subscription and its handle.  [feat_req_someipsd_433]
  void unsubscribe(SubscriptionHandle subscription, TimePoint now) noexcept;

  /// After a SubscriptionLost of a subscription with a TCP endpoint: the connection stands again, from `tcp`.
  void reconnected(SubscriptionHandle subscription, const Endpoint& tcp, TimePoint now) noexcept;

  /// An event of the subscription's eventgroup arrived. Needed only with a silence_timeout.
  void event_received(SubscriptionHandle subscription, TimePoint now) noexcept;

  // --- Both -----------------------------------------------------------------------------------------------

  /// The link went down: subscribers and remote services are lost, nothing is sent or received until
  /// link_up(). [feat_req_someipsd_23] [feat_req_someipsd_437]
  void link_down() noexcept;
  /// The link is up, as it is after construction: offers and requirements enter the initial wait phase.
  /// [feat_req_someipsd_436] [feat_req_someipsd_440]
  void link_up(TimePoint now) noexcept;

  /// Withdraws all offers, subscriptions and requirements; drain poll_transmit() once more before closing the
  /// socket. What arrives afterwards is ignored. All handles end.  [feat_req_someipsd_821]
  void shutdown(TimePoint now) noexcept;

  /// Takes a datagram that arrived at the own SD endpoint or at the multicast group.
  void on_datagram(ByteView datagram, const Endpoint& from, bool via_multicast, TimePoint now) noexcept;

  /// Does what is due. Early and repeated calls change nothing.
  void on_time(TimePoint now) noexcept;

  /// The next datagram to send now, or nothing. Entries that are due for one destination share a datagram as
  /// long as they fit.  [feat_req_someipsd_836]
  /// @param room  bounds the datagram: 1400 bytes are a good size, 200 and max_configuration_bytes enough for
  ///              any single entry.
  [[nodiscard]] std::optional<Transmit> poll_transmit(ByteSpan room, TimePoint now) noexcept;

  /// The next event, or nothing. Events come in the order in which things happened.
  [[nodiscard]] std::optional<Happening> poll_event() noexcept;

  /// When to call on_time() and poll_transmit() again; nothing: when a datagram arrives or a call is made.
  [[nodiscard]] std::optional<TimePoint> deadline() const noexcept;

  /// Another value whenever a peer's service was added, changed or lost: then for_each_remote() shows others.
  [[nodiscard]] std::uint32_t remote_changes() const noexcept { return remote_changes_; }

  [[nodiscard]] const SdCounters& counters() const noexcept { return counters_; }

 private:
  // A message being processed, and what is known about its sender.
  struct Arrival {
    const SdMessage& message;
    const IpAddress& source;  // of the datagram
    std::uint16_t peer = 0;
    bool via_multicast = false;
    TimePoint answer_due;
    TimePoint now;
  };

  // The name that an entry of other_protocols references, or empty; until the next configuration is read.
  [[nodiscard]] std::string_view name_in(const Entry& entry, const Arrival& arrival) noexcept;
  // Whether a requirement, offer or remote service of these properties has the name; SOME/IP has any.
  [[nodiscard]] bool has_name(ServiceId service, std::uint16_t configuration,
                              std::string_view name) const noexcept;
  [[nodiscard]] std::optional<std::uint16_t> keep_configuration(bool important) noexcept;

  TRESTLE_ONCE static void count(std::uint64_t& counter) noexcept { ++counter; }
  void note(Limit limit) noexcept { count(counters_.limits_reached[static_cast<std::size_t>(limit)]); }
  // An entry finds no room.
  void refuse(Limit limit) noexcept {
    note(limit);
    count(counters_.ignored_no_room);
  }

  // service_discovery.cpp
  void on_message(const someip::Message& message, const Endpoint& from, bool via_multicast,
                  TimePoint now) noexcept;
  // Whether it names other hosts than may be.
  [[nodiscard]] bool is_foreign(const EntryOptions& options, const Arrival& arrival) const noexcept;
  [[nodiscard]] bool is_allowed(const Entry& entry, const Arrival& arrival) const noexcept {
    return std::ranges::all_of(entry_judge_, [&](const EntryJudge& judge) {
      return judge.is_allowed == nullptr || judge.is_allowed(judge.context, entry, arrival.source);
    });
  }
  void on_entry(const Entry& entry, const Arrival& arrival) noexcept;
  [[nodiscard]] TimePoint first_due(TimePoint now) noexcept;
  template <typename Schedule>
  TRESTLE_ONCE void start(Schedule& schedule, TimePoint now) noexcept {
    schedule.start(settings_.timing, first_due(now));
  }
  // An entry that is about to be sent, to be filled in; nothing when there is no room, which is counted.
  [[nodiscard]] slots::PendingEntry* send(std::uint16_t to, TimePoint due) noexcept;
  void note_due(TimePoint due) noexcept {
    if constexpr (optimised_for_many) {
      transmit_due_ = earlier(transmit_due_, due);
    }
  }
  [[nodiscard]] Happening* next_event() noexcept;
  // For what is new. Losses that are still to be told come before it.
  [[nodiscard]] std::size_t event_places() const noexcept {
    return guards && is_some_untold_ ? 0 : events_.free_places();
  }
  // What `make` returns is made where the event is.
  template <typename Make>
  void tell(Make make) noexcept {
    using What = std::invoke_result_t<Make>;
    struct Made {
      explicit operator What() const noexcept { return make(); }
      const Make& make;
    };
    if (Happening* const event = next_event()) {
      event->emplace<What>(Made{make});
    }
  }

  // peers.cpp
  // With guards, never nothing.
  [[nodiscard]] slots::Peer* peer_at(const Endpoint& endpoint, TimePoint now) noexcept;
  [[nodiscard]] slots::Peer* place_for(const Endpoint& endpoint, TimePoint now) noexcept;
  [[nodiscard]] slots::Peer* who_is_forgotten(const IpAddress* among, TimePoint now) noexcept;
  void forget(slots::Peer& peer) noexcept;
  void note_sessions(const slots::Peer& peer) noexcept {
    if (guards && peer.sessions.is_ahead_of(forgotten_sessions_)) {
      forgotten_sessions_ = peer.sessions;
    }
  }
  slots::Peer& move_guest(slots::Peer& guest, slots::Peer& place) noexcept;
  [[nodiscard]] slots::Peer* guest() noexcept;
  // In the place that is never kept.
  [[nodiscard]] bool is_guest(std::uint16_t peer) const noexcept {
    return guards && peer + std::size_t{1} == peers_.size();
  }
  [[nodiscard]] bool is_silent(const slots::Peer& peer, TimePoint now) const noexcept {
    return is_due(peer.last_seen + settings_.silent_after, now);
  }
  // Whether it has been silent for twice the time that it was heard, or long: a newcomer may take its place.
  [[nodiscard]] bool is_fleeting(const slots::Peer& peer, TimePoint now) const noexcept {
    return is_due(peer.last_seen + Duration{std::int64_t{peer.heard} << 21U}, now) || is_silent(peer, now);
  }
  [[nodiscard]] std::uint32_t hash_with_seed(const IpAddress& peer, std::uint16_t more) const noexcept;
  [[nodiscard]] std::uint16_t mark_of(const IpAddress& peer, std::uint16_t more) const noexcept;
  static void note_heard(slots::Peer& peer, TimePoint now) noexcept;
  void probe(const slots::Offer& offer, const Arrival& arrival) noexcept;
  // From now on it is to prove that it receives what is sent to it: there is no room for all.
  static void suspect(slots::Peer& peer) noexcept {
    peer.is_to_prove = peer.is_to_prove || !peer.is_in_doubt;
    peer.is_in_doubt = true;
  }
  // How peers stand when one is to make room for another.
  enum class Standing : std::uint8_t {
    stays,
    fading,  // see is_fleeting()
    asked,   // likewise, but it was sent its first Offer and still has time to answer
    failed,  // it goes on speaking, and has not answered the Offer that was sent to it
  };
  // Whether it has not answered the Offer that it was sent.
  [[nodiscard]] static bool has_failed(const slots::Peer& peer, TimePoint now) noexcept {
    bool failed = false;
    for (const slots::Probe& probe : peer.probe) {  // the one
      const auto since = static_cast<std::uint16_t>(slots::ticks(now) - probe.due);
      const bool is_late =
          peer.is_probed && since >= slots::Probe::time_to_answer && since < slots::Probe::not_due;
      failed = peer.proofs == 0 && (probe.has_failed || is_late);
    }
    return failed;
  }
  [[nodiscard]] bool may_displace(const slots::Peer& peer, TimePoint now) noexcept {
    bool may = true;
    for (KnownFailures& failures : known_failures_) {  // the one
      may = !has_failed(peer, now) || failures.may_displace(now);
    }
    return may;
  }
  // A refusal, or an Offer to see whether it hears it.
  [[nodiscard]] bool may_be_sent(const slots::Peer& peer, TimePoint now) noexcept {
    bool may = true;
    for (KnownFailures& failures : known_failures_) {  // the one
      may = !has_failed(peer, now) || failures.may_be_sent(now);
    }
    return may;
  }
  [[nodiscard]] Standing standing_of(const slots::Peer& peer, TimePoint now) const noexcept;
  template <typename Slot, typename Candidate>
  [[nodiscard]] Slot* who_gives_way(const Table<Slot>& table, std::uint16_t newcomer, TimePoint now,
                                    Candidate is_candidate) noexcept;
  [[nodiscard]] const slots::Peer* who_holds_most() noexcept;
  [[nodiscard]] bool may_go_on(std::uint16_t peer, std::uint32_t cost, TimePoint now) noexcept {
    return !guards || within_rate(peer, cost, now);
  }
  [[nodiscard]] bool within_rate(std::uint16_t peer, std::uint32_t cost, TimePoint now) noexcept;
  [[nodiscard]] bool is_outdated(const slots::TcpConnection& connection, std::uint16_t peer) const noexcept;
  void on_reboot(std::uint16_t peer, TimePoint now) noexcept;

  // server_side.cpp
  void on_find(const Entry& entry, const Arrival& arrival) noexcept;
  [[nodiscard]] bool has_room_for_answer(std::uint16_t peer) const noexcept;
  void on_subscribe(const Entry& entry, const Arrival& arrival) noexcept;
  void on_stop_subscribe(const Entry& entry, const Arrival& arrival) noexcept;
  [[nodiscard]] const slots::Offer* offered(const Entry& entry, const Arrival& arrival) noexcept;
  [[nodiscard]] const Eventgroup* eventgroup_of(const slots::Offer& offer, EventgroupId id) const noexcept;
  [[nodiscard]] slots::Subscriber* subscription_of(const slots::Offer& offer, const Entry& entry,
                                                   std::uint16_t peer,
                                                   const EntryOptions& options) const noexcept;
  using Accepted = Result<const Eventgroup*, NackReason>;
  [[nodiscard]] NackReason why_unknown(const Entry& entry) const noexcept;
  [[nodiscard]] std::optional<NackReason> lack_of(const slots::Offer& offer, const Eventgroup& eventgroup,
                                                  const EntryOptions& needed) const noexcept;
  [[nodiscard]] Accepted accept(const slots::Offer& offer, const Eventgroup& eventgroup, const Entry& entry,
                                const Arrival& arrival) noexcept;
  [[nodiscard]] slots::Subscriber* new_subscription(const slots::Offer& offer, EventgroupId eventgroup,
                                                    const Arrival& arrival) noexcept;
  [[nodiscard]] std::optional<Limit> make_room(const slots::Offer& offer, EventgroupId eventgroup,
                                               const Arrival& arrival) noexcept;
  [[nodiscard]] std::size_t subscribers_of(std::uint16_t offer, EventgroupId eventgroup,
                                           const IpAddress* from) const noexcept;
  void remove(slots::Subscriber& subscription) noexcept;
  [[nodiscard]] std::optional<Endpoint> multicast_of(const slots::Offer& offer) const noexcept;
  void acknowledge(const slots::Offer* offer, const Entry& entry, const Arrival& arrival,
                   const Accepted& accepted) noexcept;
  void lose(slots::Subscriber& subscription, LossReason reason) noexcept;
  void tell_loss(slots::Subscriber& subscription) noexcept;
  void send_offer(const slots::Offer& offer, std::uint16_t to, TimePoint due, std::uint32_t ttl_s) noexcept;
  [[nodiscard]] Subscriber subscriber_of(const slots::Subscriber& slot) const noexcept;
  [[nodiscard]] bool tcp_ready(const slots::Offer& offer, const Endpoint& client) const noexcept;
  void serve(TimePoint now) noexcept;

  // remote_services.cpp
  void on_offer(const Entry& entry, const Arrival& arrival) noexcept;
  void on_stop_offer(const Entry& entry, const Arrival& arrival) noexcept;
  // False when the offer cannot be used.
  [[nodiscard]] bool read_offer(const Entry& entry, const Arrival& arrival, slots::Remote& offered) noexcept;
  [[nodiscard]] bool keep_configuration_of(slots::Remote& offered, bool required) noexcept;
  [[nodiscard]] slots::Remote* remote_of(const Entry& entry, std::string_view name) const noexcept;
  /// The first one of that service that `wanted` is true for; nothing when there is none.
  template <typename Wanted>
  [[nodiscard]] slots::Remote* search_remotes(ServiceId service, Wanted wanted) const noexcept {
    if (const std::span<ServiceId> kept = ids_.remotes; optimised_for_many && !kept.empty()) {
      const std::span<ServiceId> ids = kept.first(remotes_.used_end());
      for (std::size_t at = find_id(ids, service); at != ids.size(); at = find_id(ids, service, at + 1)) {
        slots::Remote& remote = remotes_[static_cast<std::uint16_t>(at)];
        if (remote.slot_state == SlotBase::State::in_use && wanted(std::as_const(remote))) {
          return &remote;
        }
      }
      return nullptr;
    }
    return remotes_.find_if(
        [&](const slots::Remote& remote) { return remote.service == service && wanted(remote); });
  }
  [[nodiscard]] slots::Remote* add_remote(slots::Remote& offered, bool is_taken_over,
                                          const Arrival& arrival) noexcept;
  [[nodiscard]] slots::Remote* new_remote(std::size_t wanting, const Arrival& arrival) noexcept;
  void make_room_for_remote(const Arrival& arrival) noexcept;
  void remove(slots::Remote& remote) noexcept;
  [[nodiscard]] std::size_t requirements_of(const slots::Remote& remote) const noexcept;
  void announce(const slots::Remote& remote) noexcept;
  void tell_available(slots::Requirement& requirement, const slots::Remote& remote) noexcept;
  void tell_known(slots::Requirement& requirement) noexcept;
  void tell_new(slots::Remote& remote) noexcept;
  void tell_loss(slots::Remote& remote) noexcept;
  void slow_or_end_finds(slots::Requirement& requirement) noexcept;
  void lose(slots::Remote& remote, LossReason reason, TimePoint now) noexcept;
  [[nodiscard]] bool fits(const slots::Requirement& requirement, const slots::Remote& remote) const noexcept;
  void seek(TimePoint now) noexcept;
  void fill_find(slots::PendingEntry& pending, const slots::Requirement& requirement) const noexcept {
    pending.entry = {.type = EntryType::find_service,  // without endpoints  [feat_req_someipsd_877]
                     .service = requirement.service,
                     .instance = requirement.instance,
                     .major = requirement.major,
                     .ttl_s = settings_.timing.ttl_s,
                     .tail = any_minor};                // fits() compares  [feat_req_someipcompat_1197]
    pending.configuration = requirement.configuration;  // [feat_req_someipsd_879] [feat_req_someipsd_503]
  }
  void tell_network(SdWriter& writer) const noexcept;
  [[nodiscard]] bool leaves_room(const SdWriter& writer, std::size_t option_bytes) const noexcept;
  [[nodiscard]] bool tells_our_network(const SdMessage& message) const noexcept;

  // rivals.cpp
  void not_answered(slots::Remote& remote) noexcept;
  void answered(slots::Remote& remote) noexcept;
  [[nodiscard]] slots::Silence* silence_of(const slots::Remote& remote, bool is_new) noexcept;
  [[nodiscard]] slots::Silence* silence_seen(const slots::Remote& remote, TimePoint now) noexcept;
  void remember(const slots::Remote& remote) noexcept;
  void recall(slots::Remote& remote, TimePoint now) noexcept;
  void spread(const slots::Remote& remote) noexcept;
  bool note_asked(slots::Remote& remote, bool is_open, TimePoint when) noexcept;
  [[nodiscard]] bool gives_way(slots::Remote& remote, TimePoint now) noexcept;
  [[nodiscard]] bool takes_over(slots::Remote& offered, slots::Remote& known,
                                const Arrival& arrival) noexcept;
  [[nodiscard]] bool gives_way_to(slots::Remote& other, slots::Remote& known,
                                  const Arrival& arrival) noexcept;
  void ask_too(const slots::Remote& other, std::uint16_t host, const slots::Remote& known,
               slots::Rival* rival, const Arrival& arrival) noexcept;
  [[nodiscard]] bool rival_answers(const Entry& entry, const Arrival& arrival) noexcept;
  [[nodiscard]] bool is_open(const slots::Rival& rival) const noexcept;
  [[nodiscard]] slots::Rival& place_for_rival() noexcept;
  [[nodiscard]] std::uint16_t holder_of(const slots::Remote& remote) const noexcept;
  [[nodiscard]] std::uint32_t held_by(const slots::Remote& remote) const noexcept;
  void note_held(const slots::Remote& remote) noexcept;
  void note_mute(const slots::Remote& remote) noexcept;
  void note_back(const slots::Remote& remote) noexcept;
  [[nodiscard]] bool is_back(const slots::Remote& offered, const slots::Remote& rival) const noexcept;

  // client_side.cpp
  void on_ack(const Entry& entry, const Arrival& arrival) noexcept;
  [[nodiscard]] bool may_change(const slots::Subscription& subscription, const Arrival& arrival) noexcept;
  void renew_subscriptions(slots::Remote& remote, bool is_new, const Arrival& arrival) noexcept;
  void take_subscriptions(slots::Remote& remote, const Arrival& arrival) noexcept;
  enum class Cause : std::uint8_t { application_or_unicast_offer, multicast_offer, silence, rival };
  void request(slots::Subscription& subscription, TimePoint due, Cause cause) noexcept;
  void withdraw(slots::Subscription& subscription, TimePoint now) noexcept;
  void leave_remote(slots::Subscription& subscription, LossReason reason) noexcept;
  void join_remote(slots::Subscription& subscription, TimePoint now) noexcept;
  void cancel_requests(slots::Subscription& subscription) noexcept;
  void amend_request(slots::Subscription& subscription) noexcept;
  void attach(slots::Subscription& subscription, slots::Remote& remote) noexcept;
  void detach(slots::Subscription& subscription) noexcept;
  void watch(TimePoint now) noexcept;
  slots::PendingEntry* send_subscribe(const slots::Subscription& subscription, TimePoint due,
                                      std::uint32_t ttl_s, bool initial_data) noexcept;
  slots::PendingEntry* send_subscribe_to(const slots::Remote& remote, const slots::Subscription& subscription,
                                         TimePoint due, std::uint32_t ttl_s) noexcept;
  // Of client_side.cpp alone. In place: a closed network has nobody who needs send_subscribe_to().
  [[gnu::always_inline]] inline slots::PendingEntry* queue_subscribe(const slots::Remote& remote,
                                                                     const slots::Subscription& subscription,
                                                                     TimePoint due, std::uint32_t ttl_s,
                                                                     bool initial_data) noexcept;
  void lose(slots::Subscription& subscription, LossReason reason) noexcept;
  void tell_loss(slots::Subscription& subscription) noexcept;

  // losses.cpp
  void tell_what_is_untold() noexcept;
  // What finds none is told later, with guards.
  [[nodiscard]] bool has_place_to_tell() noexcept { return !guards || has_place_or_waits(); }
  [[nodiscard]] bool has_place_or_waits() noexcept;
  void lose(slots::TcpConnection& connection) noexcept;
  void tell_loss(slots::TcpConnection& connection) noexcept;

  // What is used most stands first, where small processors reach it with short instructions.
  BoundedQueue<slots::PendingEntry> pending_;
  BoundedQueue<Happening> events_;
  bool link_up_ = true;
  bool is_some_untold_ = false;  // losses, or services, wait for room among the events
  std::uint16_t contested_ = slots::Remote::none;
  std::uint16_t taken_over_ = slots::Remote::none;  // from the peer loser_
  std::uint16_t loser_ = 0;
  std::uint32_t remote_changes_ = 0;
  TimePoint transmit_due_ = never;  // nothing that is pending is due before it
  someip::SessionCounter multicast_sessions_;
  someip::SessionCounter forgotten_sessions_;  // no peer that was forgotten has heard of a later one
  // The last peers that had to make room, by a hash: a peer that soon comes again is there to stay.
  [[no_unique_address]] std::array<std::uint16_t, !guards ? 0U : optimised_for_many ? 64U : 3U> displaced_{};
  std::uint16_t next_displaced_ = 0;
  [[no_unique_address]] slots::OneIfGuarded<KnownFailures> known_failures_{};
  std::uint16_t next_silence_ = 0;
  std::uint16_t next_rival_ = 0;
  std::span<slots::Silence> silences_;  // who did not answer, whatever became of its offers
  TimePoint questions_due_ = never;     // when to look at who is contested
  Table<slots::Peer> peers_;
  Table<slots::Remote> remotes_;
  [[no_unique_address]] slots::ServiceIds ids_;
  Table<slots::Requirement> requirements_;
  Table<slots::Subscription> subscriptions_;
  Table<slots::Offer> offers_;
  Table<slots::Subscriber> subscribers_;
  Table<slots::OfferedEventgroup> eventgroups_;
  Table<slots::TcpConnection> tcp_connections_;
  ConfigurationPool configurations_;
  Settings settings_;
  OptionRules rules_;
  Random random_;
  SdCounters counters_{};
  [[no_unique_address]] slots::OneOrNone<std::optional<Endpoint>> gateway_to_{};
  [[no_unique_address]] slots::OneOrNone<EntryJudge> entry_judge_{};
  std::span<slots::Rival, guards ? std::dynamic_extent : 0> rivals_;
};

}  // namespace trestle::sd
