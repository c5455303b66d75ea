#pragma once
#include <vector>

#include "sd/core/events.hpp"
#include "sd/core/method_ids.hpp"
#include "sd/net/e2e_spec.hpp"
#include "sd/net/responder.hpp"
#include "someip/core/tp_pacing.hpp"
#include "someip/core/update_schedule.hpp"
#include "someip/net/wait_rule.hpp"

namespace trestle::sd {

/// Called with each request, which is valid during the call; `responder` may be kept and used later.
using RequestHandler = std::function<void(const someip::Message& request, Responder responder)>;

/// A method of an offered service. Requests that do not fit, say of another type, are answered without asking
/// the handler; one whose payload cannot be understood the handler answers with malformed_message.
struct MethodSpec {
  someip::MethodId id{};
  RequestHandler handler;
  someip::MethodKind kind = someip::MethodKind::request_response;
  std::optional<someip::TpPacing> pacing{};  ///< of large responses over UDP; nothing: NodeConfig::pacing
  /// The largest request over UDP in segments. A larger one is not put together; and if a single datagram has
  /// room for this much (someip::max_plain_payload_bytes), none is. Nothing: NodeConfig::max_message_bytes.
  std::optional<std::size_t> max_request_bytes{};
};

/// Judges the value that a setter brings: gives the value to be set, which may be another, or the error.
/// [feat_req_someip_634]
using SetHandler = std::function<someip::Result<std::vector<std::byte>, someip::ReturnCode>(ByteView wanted)>;

/// Whether the value of a field or event differs from the one that was sent last by so much that it is worth
/// a notification: for a number, by more than an epsilon.
using DifferenceCheck = std::function<bool(ByteView sent, ByteView value)>;

/// A field of an offered service: one or more of getter, setter and notifier. The Node keeps its value,
/// answers the getter, notifies of changes, and gives new subscribers the value.
/// [feat_req_someip_631] [feat_req_someip_632]
struct FieldSpec {
  std::optional<someip::MethodId> getter{};
  std::optional<someip::MethodId> setter{};
  std::optional<someip::MethodId> notifier{};
  std::optional<std::vector<std::byte>> value{};
  SetHandler on_set{};          ///< nothing: every value is taken as it comes
  someip::UpdateRule update{};  ///< when the notifier is sent
  DifferenceCheck differs{};    ///< nothing: by any byte
  /// What the getter answers until there is a value; not ok.
  someip::ReturnCode without_value = someip::ReturnCode::not_ok;
  /// The pacing of large values over UDP, in notifications and responses; nothing: NodeConfig::pacing.
  std::optional<someip::TpPacing> pacing{};
};

/// Rules for an event given to `notify()`. An event without a rule is sent by each `notify()`. The Node
/// copies the last payload, to compare and to repeat, but not for new subscribers: only fields have initial
/// values.  [feat_req_someip_635] [feat_req_someipsd_833]
struct EventSpec {
  someip::MethodId id{};
  someip::UpdateRule update{};  ///< on change, in a cycle from the first notify() on, or both
  DifferenceCheck differs{};    ///< nothing: by any byte
};

/// How many messages of an event may wait for one subscriber that takes them more slowly than they come.
struct EventWait {
  someip::MethodId id{};  ///< an event, or the notifier of a field
  someip::WaitRule rule{};
};

/// An item of a service's configuration: `key`, `key=` or `key=value`.
struct ConfigurationText {
  std::string key;
  std::optional<std::string> value{};  ///< nothing: without '='
  friend bool operator==(const ConfigurationText&, const ConfigurationText&) = default;
};

/// An eventgroup of an offered service, with the events and notifiers that its subscribers get.
struct EventgroupSpec {
  someip::EventgroupId id{};
  std::vector<someip::MethodId> events{};
  /// Where its UDP events go to when multicast is used.
  std::optional<Endpoint> multicast{};
  /// From this number of subscribers on, multicast is used if there is an endpoint for it.
  /// 0: never, 1: always.  [feat_req_someip_813]
  std::size_t multicast_threshold = 1;
  /// UDP endpoints of clients that both sides are configured with: they get the events without ever
  /// subscribing, but no initial ones. Not for eventgroups with TCP events.  [feat_req_someipsd_444]
  std::vector<Endpoint> configured_subscribers{};
};

/// A service to offer.
struct ServiceSpec {
  someip::ServiceId service{};
  someip::InstanceId instance{};
  std::uint8_t major = 1;
  std::uint32_t minor = 0;
  /// Ports; 0: the system chooses. Several services may share one, but not several instances of one service
  /// [feat_req_someip_967]. Nothing: not offered by that protocol; one of them must be.
  std::optional<std::uint16_t> udp_port = std::uint16_t{0};
  std::optional<std::uint16_t> tcp_port{};
  std::vector<MethodSpec> methods{};
  std::vector<FieldSpec> fields{};
  std::vector<EventSpec> events{};  ///< those with an update rule; each is in an eventgroup, too
  std::vector<EventgroupSpec> eventgroups{};
  /// Events and notifiers that go over TCP. Those of a service without UDP do anyway, all others go over UDP.
  std::vector<someip::MethodId> tcp_events{};
  /// Events with Session ID 0, unless sent in segments.  [feat_req_someip_667] [feat_req_someip_700]
  std::vector<someip::MethodId> events_without_session{};
  /// Events, and methods with their responses, that may be sent over UDP in segments when they are large.
  /// Nothing: all. [feat_req_someiptp_788] With a method or setter among them, the offer tells how much its
  /// socket has room for, DiscoveryRules::tell_receive_buffer, unless it has its own `configuration`.
  std::optional<std::vector<someip::MethodId>> segmented{};
  /// How many messages of an event may wait for a slow subscriber; else as NodeConfig::max_queued_bytes says.
  std::vector<EventWait> waits{};
  std::vector<E2eSpec> e2e{};  ///< events, methods, getters, setters and notifiers with protection
  /// What else discovery says about the service, in this order.  [feat_req_someipsd_857] A service of
  /// other_protocols is named by its item `otherserv`.  [feat_req_someipsd_500]
  std::vector<ConfigurationText> configuration{};
  /// How long it lives unless it is offered again, 1 to infinite_ttl_s; nothing: Timing::ttl_s of the node.
  /// [feat_req_someipsd_253]
  std::optional<std::uint32_t> ttl_s{};
  OfferOptions options{};  ///< of a service with `mac_groupcast` neither port is needed
  /// How its requests that are in error are answered; nothing: as NodeConfig says.  [feat_req_someip_726]
  std::optional<someip::AnswerRules> answers{};
};

/// Chooses among the subscribers of an event.
using SubscriberFilter = std::function<bool(const Subscriber& subscriber)>;

/// What became of an event; all 0 when its rule says not to send it now.
struct Notified {
  someip::SessionId session{};  ///< of the message that was sent
  std::size_t subscribers = 0;  ///< endpoints that it was sent to, or queued for
  std::size_t dropped = 0;      ///< those that did not get it, as the counters tell
  /// Of these, the ones for which too much waits now (NodeConfig::max_queued_bytes): Node::when_room() tells
  /// when there is room again.
  std::size_t no_room = 0;
  /// Messages of this event, also this one, that were dropped for a slow subscriber, see EventWait.
  std::size_t overtaken = 0;
};

/// A subscriber for which events were dropped because it takes them too slowly (EventWait).
struct SlowSubscriber {
  Endpoint at;
  Transport transport = Transport::udp;
  std::uint64_t overtaken = 0;  ///< messages
};

/// A service to call methods of.
struct RequireSpec {
  someip::ServiceId service{};
  someip::InstanceId instance = someip::any_instance;
  std::uint8_t major = 1;
  std::uint32_t minor = any_minor;
  /// Methods whose large requests may go over UDP, in segments. Nothing: all.  [feat_req_someiptp_788]
  std::optional<std::vector<someip::MethodId>> segmented{};
  std::vector<E2eSpec> e2e{};  ///< methods, getters and setters with end-to-end protection
  std::string otherserv{};     ///< the name, for other_protocols  [feat_req_someipsd_503]
};

/// An eventgroup to subscribe to.
struct SubscribeSpec {
  someip::ServiceId service{};
  someip::InstanceId instance = someip::any_instance;  ///< any: all that are offered
  std::uint8_t major = 1;
  std::uint32_t minor = any_minor;
  someip::EventgroupId eventgroup{};
  std::vector<someip::MethodId> events{};
  /// The protocols of its events. A server may refuse a subscription that leaves out one that it needs.
  bool udp = true;
  bool tcp = false;
  std::uint16_t port = 0;  ///< UDP, to receive at; 0: one that all subscriptions of the node share
  /// The server is configured with us as a subscriber: only receive, say nothing. UDP only.
  /// [feat_req_someipsd_444]
  bool configured = false;
  /// Subscribe anew when no event of `events` came for this long, counted from the Ack and from each event;
  /// nothing: never.  [feat_req_someipsd_439] [feat_req_someipsd_691]
  std::optional<Duration> silence_timeout{};
  /// How long it lives unless it is renewed, 1 to infinite_ttl_s; nothing: Timing::ttl_s of the node.
  /// [feat_req_someipsd_322]
  std::optional<std::uint32_t> ttl_s{};
  std::vector<E2eSpec> e2e{};  ///< of `events` with end-to-end protection
  /// The largest of `events` that comes over UDP in segments: a larger one is not put together. Nothing:
  /// NodeConfig::max_message_bytes.
  std::optional<std::size_t> max_event_bytes{};
  std::string otherserv{};  ///< the name, for other_protocols  [feat_req_someipsd_503]
};

/// How often something came between a subscription and its events; each counts when it begins, and is logged
/// as a warning.
struct SubscriptionFaults {
  std::uint64_t refused = 0;          ///< the server answered with a Nack
  std::uint64_t other_transport = 0;  ///< the service is not offered over TCP, which was wanted
  std::uint64_t other_version = 0;    ///< the service is only offered in another version
  /// Events of its servers that nobody here has asked for; of a message in segments each. No warnings.
  std::uint64_t other_events = 0;
};

/// A service that somebody else offers now.
struct SeenOffer {
  someip::ServiceId service{};
  someip::InstanceId instance{};
  std::uint8_t major = 0;
  std::uint32_t minor = 0;
  IpAddress host;
};

/// Another host in discovery.
struct SeenHost {
  Endpoint at;                    ///< its SD endpoint
  Duration silent{};              ///< since its last message
  std::size_t offers = 0;         ///< services of it that are known
  std::size_t subscriptions = 0;  ///< to services of ours
};

/// A limit of a Node, by the name of its setting, and how much of it is taken.
struct UsedLimit {
  const char* name = "";
  std::size_t used = 0;
  std::size_t limit = 0;
};

/// Events that came from the servers of a subscription, of its service, and that nobody here has asked for.
struct OtherEvents {
  static constexpr std::size_t max_ids = 8;
  std::uint64_t count = 0;              ///< of a message in segments each
  std::vector<someip::MethodId> ids{};  ///< the first that came, each once
};

/// Why a call was not answered as it should be.
enum class CallFault : std::uint8_t {
  unavailable,     ///< nobody offers the service now
  not_connected,   ///< there is no TCP connection to the server now
  not_sent,        ///< too much waits (Node::when_room()), it is too large, or the system does not take it
  too_many_calls,  ///< NodeConfig::max_calls are outstanding
  timed_out,       ///< no answer came in time, or the connection was lost meanwhile  [feat_req_someip_326]
  error,           ///< the server answered with an error
};

/// The fault's name as it stands above.
[[nodiscard]] const char* to_string(CallFault fault) noexcept;

/// Why a call failed, and what the server said. Valid during the call of the handler.
struct CallError {
  CallFault fault{};
  someip::ReturnCode code = someip::ReturnCode::not_ok;  ///< of CallFault::error
  ByteView payload{};                                    ///< of CallFault::error; valid during the call
  const someip::Header* header = nullptr;                ///< likewise
  const someip::e2e::CheckResult* check = nullptr;       ///< likewise, of an answer with protection
};

/// The response to a call, valid during the call of the handler, or why there is none.
using CallResult = someip::Result<someip::Message, CallError>;
using ResponseHandler = std::function<void(const CallResult& result)>;

/// A call of a method, or of a field's getter or setter.
struct CallSpec {
  someip::MethodId method{};
  Duration timeout = std::chrono::seconds{5};
  /// Nothing: what is offered, and if that is both, TCP for a payload that does not fit a datagram.
  std::optional<Transport> transport{};
  /// Nothing: one chosen by priority and weight while it stays and answers.  [feat_req_someipsd_770]
  std::optional<someip::InstanceId> instance{};
  /// Fire and forget only: false sends Session ID 0. A call needs a session to recognise its answer.
  /// [feat_req_someip_667] [feat_req_someip_700]
  bool session = true;
  std::optional<someip::TpPacing> pacing{};  ///< of a large request over UDP; nothing: NodeConfig::pacing
};

/// Names a subscription that Node::subscribe() made.
enum class SubscriptionId : std::uint32_t {};
/// Names a requirement that Node::require() made.
enum class RequirementId : std::uint32_t {};
/// Names a call that Node::call() made.
enum class CallId : std::uint32_t {};

using EventHandler = std::function<void(const someip::Message& message, const Endpoint& from)>;
/// Told of a service that is offered from now on, or not any more.
using AvailabilityHandler = std::function<void(const RemoteService& service, bool available)>;

}  // namespace trestle::sd
