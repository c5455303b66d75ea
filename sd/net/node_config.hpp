#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "sd/core/events.hpp"
#include "sd/core/settings.hpp"
#include "sd/core/storage.hpp"
#include "sd/net/access.hpp"
#include "someip/core/request_check.hpp"
#include "someip/core/tp_pacing.hpp"
#include "someip/net/tls.hpp"
#include "someip/wire/counters.hpp"

namespace trestle::sd {

/// Settings of a Node. Only `address` has to be given; the defaults are those of the specification, or common
/// in the industry where it has none (docs/sd_options.md). Sizes are in bytes, and each limit is the Node's
/// own: two Nodes of one process share nothing.
struct NodeConfig {
  /// Own unicast address: SD listens on it, and it is the endpoint of every offered service.
  IpAddress address;
  std::string multicast_interface{};   ///< for multicast; empty: the one that has `address`
  std::uint8_t multicast_ttl = 1;      ///< hops that multicast may take
  std::uint8_t unicast_ttl = 0;        ///< hops that unicast may take; 0: as the system has it
  std::uint8_t dscp = 0;               ///< class of service of all that is sent, 0 to 63
  int receive_buffer_bytes = 8 << 20;  ///< of each UDP socket, as far as the system grants it
  int send_buffer_bytes = 4 << 20;     ///< likewise
  /// How long the system polls a network device for each UDP socket before it waits (SO_BUSY_POLL); 0: it
  /// does not. Rounded up to microseconds. Needs CAP_NET_ADMIN, and a device whose driver can do it.
  Duration busy_poll{0};
  IpAddress multicast = IpAddress::v4(224, 244, 224, 245);  ///< SD's group
  std::uint16_t port = 30490;  ///< SD's port, of all nodes  [feat_req_someip_676]
  Timing timing{};             ///< of service discovery: delays, repetitions, TTL
  DiscoveryRules discovery{};  ///< see docs/sd_options.md
  /// Hosts that may name endpoints of other hosts (DiscoveryRules::own_endpoints_only). If there are any,
  /// they replace those of `discovery`.
  std::vector<ForeignEndpoints> foreign_endpoints{};
  /// Where `discovery` names no prefix length, take that of the interface with `address`, so that peers
  /// outside of its subnet are ignored. False: all peers are heard, also those at loopback addresses of this
  /// host.  [feat_req_someipsd_1135] [feat_req_someipsd_1149]
  bool check_subnet = true;
  /// Who may offer to us, subscribe to us and call us.
  AccessControl access{};
  /// Watch the link: whether the interface for multicast is up, and whether it or another one has `address`.
  /// False: only Node::link() counts.  [feat_req_someipsd_23]
  bool watch_link = true;
  Limits limits{};  ///< of service discovery
  /// SD datagrams that may wait for up to 3 s when the system cannot take them, because its buffer or its
  /// table of neighbours is full. Datagrams to the group, and to hosts known to be there, go first.
  std::size_t max_waiting_discovery = 256;
  std::size_t max_message_bytes = std::size_t{16} << 20U;  ///< payload of a received message
  /// Bytes that may wait to be sent at one UDP port or TCP connection. Beyond them messages are dropped, at a
  /// UDP port those to the receiver with the most. Up to as much memory for copies of waiting messages is
  /// kept for later ones.
  std::size_t max_queued_bytes = std::size_t{64} << 20U;
  /// Large messages that may be under way to one UDP port at once: so many requests, and as many events and
  /// answers. Their memory is taken as they fill it, and given back when none came for reassembly_timeout.
  std::size_t max_reassemblies = 32;
  std::size_t max_reassemblies_per_sender = 16;  ///< of them, from one address
  /// Memory that all large messages over UDP together may use, at all ports, counted as it is filled; never
  /// less than for two of them. Where it does not suffice, the slowest message gives way.
  std::size_t max_udp_receive_bytes = std::size_t{512} << 20U;
  Duration reassembly_timeout = std::chrono::seconds{5};  ///< a message not whole by then never will be
  /// Bytes per second. A large message that comes at least this fast keeps its place. When all places are
  /// taken, the slowest of the others gives way to a new one. 0: none gives way.
  std::uint32_t reassembly_protected_rate = 1'000'000;
  /// Names this client among those of the same address.  [feat_req_someip_699] [feat_req_someip_701]
  someip::ClientId client{1};
  std::uint16_t max_calls = 1024;    ///< that may be outstanding at once
  std::size_t max_tcp_clients = 64;  ///< connections at a time to one TCP port of ours
  /// Of these from one address, so that no client can keep all others out.
  std::size_t max_tcp_clients_per_address = 16;
  /// Connections that one address may make in a second, to all ports of ours together; 0: any number. Further
  /// ones are closed at once.
  std::uint32_t max_tcp_connects_per_second = 1000;
  /// Requests from one address in a second that are heard, over UDP and TCP each; 0: any number. Further ones
  /// are dropped. Over UDP others may send in the name of an address, and so use up what it may.
  std::uint32_t max_requests_per_second = 0;
  /// A client's connection is closed when no subscription needs it and no message has passed for this long
  /// (at the latest after a quarter of the time more). 0: never.
  Duration tcp_idle_timeout = std::chrono::minutes{5};
  /// The same for a connection with a request that we have not answered yet; the longer time counts.
  Duration tcp_unanswered_timeout = std::chrono::hours{1};
  /// Of a client that does not read its answers no requests are read over TCP while so much waits for it.
  std::size_t max_unread_answer_bytes = std::size_t{1} << 20U;
  /// What may wait to be sent over all TCP connections together; never less than max_queued_bytes. Beyond it,
  /// a connection for which something waits gets its share and no more; messages above that are dropped.
  std::size_t max_tcp_queued_bytes = std::size_t{128} << 20U;
  /// Memory that all TCP connections together may take for messages that come in pieces, besides 64 KiB of
  /// each; never less than for one message. Where it does not suffice, the connection that holds the most for
  /// the longest time ends.
  std::size_t max_tcp_receive_bytes = std::size_t{256} << 20U;
  /// Limits answers in segments over UDP to another host that has neither a subscription here nor a TCP
  /// connection: somebody may have asked in its name. This many bytes may go there at once, and so many more
  /// each second. Beyond them the answer is ReturnCode::not_ok.
  std::size_t unproven_answer_bytes = std::size_t{64} << 10U;
  std::size_t unproven_answer_rate = std::size_t{2} << 10U;  ///< bytes per second
  /// How often the initial value of a field goes over UDP to one other host within a short time, when it
  /// takes segments: somebody may subscribe in its name, again and again. After so many, one goes there every
  /// two seconds, and other Subscribes bring none. Five times as often when it takes one datagram of 1400
  /// bytes, and more often the smaller it is.
  std::uint16_t max_repeated_values = 8;
  /// Of a gateway: the network that its services come from, by a multicast endpoint that stands for it. The
  /// messages with its offers tell that, and services of other gateways to the same network are withheld: as
  /// if they were not offered, until it is known there whether they are a way back. Else what comes from that
  /// network could be carried back, before its own discovery has told of the other gateway.
  std::optional<Endpoint> gateway_to{};
  /// Whether that is known of such a service; asked again and again while it is withheld. Empty: of none.
  std::function<bool(const RemoteService&)> is_way_back_known{};
  /// The longest time for it; then it is taken as any other.
  Duration max_withheld = std::chrono::seconds{5};
  someip::AnswerRules answers{};  ///< to requests that are in error, where a service has none of its own
  someip::TpPacing pacing{};      ///< of large requests and responses over UDP
  /// How long a small message may wait for others from its UDP port to its receiver, to share a datagram
  /// (nPDU). 0: each has its own.  [feat_req_someip_741] [feat_req_someip_732]
  Duration collect_for{0};
  /// All TCP connections of the Node are encrypted, and both ends prove who they are: those of its services
  /// and those to services of others, which have to do the same. Nothing: plain TCP. UDP is not protected by
  /// it.
  std::optional<someip::TlsSettings> tls{};
  bool magic_cookies = false;  ///< on TCP connections, for test setups
  /// Where they stand: one at the start of each TCP segment, and nowhere else; only the further segments of a
  /// message that is larger than one segment cannot have any. Or, with false, before a message every ten
  /// seconds.  [feat_req_someip_591] [feat_req_someip_592] [feat_req_someip_593]
  bool cookie_in_each_segment = true;
  /// A TCP peer that acknowledges nothing for so long, data or the probes of an idle connection, is given up.
  Duration tcp_dead_after = std::chrono::seconds{10};
  /// A TCP connection on which a message is under way for longer is closed: half a message must not hold its
  /// place for ever. 0: never.
  Duration tcp_message_timeout = std::chrono::seconds{30};
  int tcp_receive_buffer_bytes = 0;  ///< of the kernel, for each connection; 0: it adapts them itself
  int tcp_send_buffer_bytes = 0;     ///< likewise
  Duration tcp_connect_timeout = std::chrono::seconds{3};  ///< how long an attempt to connect may take
  /// Wait before the second attempt to connect, doubled after each further one up to the maximum. A
  /// connection that has stood for longer than the maximum begins anew.
  Duration tcp_retry_min = std::chrono::milliseconds{100};
  Duration tcp_retry_max = std::chrono::seconds{5};
};

/// Received messages and datagrams that a Node dropped, by reason, and what it did with the others.
struct NodeCounters {
  std::uint64_t datagrams = 0;      ///< received, SD left out
  std::uint64_t events = 0;         ///< delivered to a subscription
  std::uint64_t requests = 0;       ///< delivered to a method or field
  std::uint64_t malformed = 0;      ///< datagrams that are empty, or bad from some message on
  std::uint64_t overflowed = 0;     ///< datagrams that the system dropped as a receive buffer was full
  std::uint64_t wrong_version = 0;  ///< another interface or protocol version than was subscribed to
  /// Notifications with a return code other than E_OK.  [feat_req_someip_683] [feat_req_someip_367]
  std::uint64_t bad_return_code = 0;
  // Of a message in segments, each segment counts.
  std::uint64_t unexpected = 0;      ///< neither a subscribed event, nor a request, nor an answer to a call
  std::uint64_t unknown_sender = 0;  ///< a subscribed event from an endpoint that does not offer it
  std::uint64_t requests_answered = 0;    ///< with an error, without asking a method
  std::uint64_t not_to_be_segmented = 0;  ///< not sent over UDP: too large for one datagram
  /// Large answers over UDP beyond NodeConfig::unproven_answer_bytes: an error was sent instead.
  std::uint64_t answers_refused = 0;
  /// Answers over UDP to hosts that do not answer to their address (ARP), while too many such are waited for:
  /// dropped. Somebody asks in the name of hosts that are not there.
  std::uint64_t answers_to_silent = 0;
  /// Initial values over UDP beyond NodeConfig::max_repeated_values: not sent.
  std::uint64_t repeated_values_refused = 0;
  /// Datagrams and TCP connections from addresses that AccessControl::peers does not have.
  std::uint64_t peers_not_allowed = 0;
  // What AccessControl::policies do not allow. Of a request in segments, each segment counts.
  std::uint64_t offers_not_allowed = 0;
  std::uint64_t subscriptions_not_allowed = 0;  ///< also in SdCounters, as Nacks
  std::uint64_t calls_not_allowed = 0;
  std::uint64_t too_many_requests = 0;  ///< beyond NodeConfig::max_requests_per_second
  std::uint64_t too_many_connects = 0;  ///< beyond NodeConfig::max_tcp_connects_per_second
  std::uint64_t e2e_failed = 0;         ///< events, requests and answers that failed their end-to-end check
  /// Events, requests and answers of another size than their E2E profile has: not sent.
  std::uint64_t e2e_not_protected = 0;
  std::uint64_t offered_twice = 0;  ///< instances of ours that somebody else began to offer, too
  std::uint64_t withheld = 0;       ///< services that had to wait for NodeConfig::is_way_back_known
  /// Events that were dropped for subscribers that take them too slowly, EventWait.
  std::uint64_t overtaken = 0;
  // SD datagrams.
  std::uint64_t discovery_not_sent = 0;  ///< the system refused them: no way, no link
  std::uint64_t discovery_waited = 0;    ///< it could not take them at once
  std::uint64_t discovery_no_room = 0;   ///< of them dropped: more waited than max_waiting_discovery
  std::uint64_t discovery_outdated = 0;  ///< likewise: for 3 s, until the link went down, or to the end
  std::uint64_t unreachable = 0;  ///< errors of the network (ICMP): a UDP receiver of ours is not there
  /// Such errors that neither the receiver nor this host sent: not believed, as anybody can send them.
  std::uint64_t unreachable_ignored = 0;

  /// All but those of for_each_discovery_counter().
  template <typename Visit>
  constexpr void for_each_counter(Visit visit) const {
    using enum someip::CounterKind;
    visit("datagrams_received", datagrams, traffic);
    visit("events_received", events, traffic);
    visit("requests_received", requests, traffic);
    visit("calls_answered_with_an_error", requests_answered, traffic);
    visit("events_overtaken", overtaken, traffic);  // `slow_subscriber` of UDP and TCP has each as a loss
    visit("unreachable", unreachable, traffic);
    visit("unreachable_ignored", unreachable_ignored, traffic);
    visit("answers_refused", answers_refused, loss);
    visit("answers_to_silent", answers_to_silent, loss);
    visit("repeated_values_refused", repeated_values_refused, loss);
    visit("peers_not_allowed", peers_not_allowed, loss);
    visit("calls_not_allowed", calls_not_allowed, loss);
    visit("too_many_requests", too_many_requests, loss);
    visit("too_many_connects", too_many_connects, loss);
    visit("malformed", malformed, loss);
    visit("wrong_version", wrong_version, loss);
    visit("unexpected", unexpected, loss);
    visit("unknown_sender", unknown_sender, loss);
    visit("not_to_be_segmented", not_to_be_segmented, loss);
    visit("bad_return_code", bad_return_code, loss);
    visit("e2e_failed", e2e_failed, doubt);  // whether it is passed on is a choice of the service
    visit("e2e_not_protected", e2e_not_protected, loss);
    visit("receive_buffer_full", overflowed, loss);
  }
  /// What is shown with SdCounters.
  template <typename Visit>
  constexpr void for_each_discovery_counter(Visit visit) const {
    using enum someip::CounterKind;
    visit("offered_twice", offered_twice, loss);
    visit("withheld", withheld, traffic);
    visit("offers_not_allowed", offers_not_allowed, loss);
    visit("subscriptions_not_allowed", subscriptions_not_allowed, loss);
    visit("not_sent", discovery_not_sent, loss);
    visit("waited_to_be_sent", discovery_waited, traffic);
    visit("not_sent_no_room", discovery_no_room, loss);
    visit("not_sent_in_time", discovery_outdated, loss);
  }
};

/// Told what discovery did, in words: one line without a line end.
using DiscoveryLog = std::function<void(const std::string& line)>;

}  // namespace trestle::sd
