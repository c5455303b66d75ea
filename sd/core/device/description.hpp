#pragma once
#include "sd/core/service_discovery.hpp"
#include "someip/core/request_check.hpp"
#include "someip/core/tp_pacing.hpp"

namespace trestle::device {

/// What a device offers and needs: tables that may lie in flash memory, read for as long as the device lives.

using someip::ClientId;
using someip::EventgroupId;
using someip::InstanceId;
using someip::MethodId;
using someip::ServiceId;

/// A method of an offered service. Requests that do not fit, say of another type, are answered with an error
/// without asking the application.  [feat_req_someip_718]
struct Method {
  MethodId id{};
  someip::MethodKind kind = someip::MethodKind::request_response;
};

/// An event of an offered service, and the eventgroups whose subscribers get it.
struct Event {
  MethodId id{};
  std::span<const EventgroupId> eventgroups{};
};

/// A field of an offered service: any of getter, setter and notifier, 0 for those it has not.
/// [feat_req_someip_631] [feat_req_someip_632] The device answers the getter, and tells its subscribers of
/// changes, new ones of the value.
struct Field {
  MethodId getter{};
  MethodId setter{};
  MethodId notifier{};
  std::span<const EventgroupId> eventgroups{};  ///< of the notifier
  /// Where the value is kept: the application's memory, as large as the value can get. Only the device writes
  /// there.
  ByteSpan room{};
  /// How many bytes at the front of `room` are the value at first; nothing: there is none until it is set,
  /// the getter is answered with not_ready.
  std::optional<std::size_t> initial_bytes{};
  /// Whether the application judges what a setter brings: it comes as a Request, to be answered with
  /// Device::accept() or respond_error(). Else each value is taken that fits into `room`, and FieldSet tells.
  bool judged = false;
};

/// A service to offer by UDP.
struct Service {
  ServiceId service{};
  InstanceId instance{};
  std::uint8_t major = 1;
  std::uint32_t minor = 0;
  /// UDP port: not SD's. Services may share one, but not instances of one service.  [feat_req_someip_967]
  std::uint16_t port = 0;
  std::span<const Method> methods{};
  std::span<const Event> events{};
  std::span<const Field> fields{};
  /// All eventgroups that events and fields name. Their events go by UDP unicast: `tcp` and `multicast` stay
  /// as they are by default.
  std::span<const sd::Eventgroup> eventgroups{};
  std::optional<std::uint32_t> ttl_s{};  ///< else that of sd::Timing
  someip::AnswerRules answers{};         ///< to requests that are in error
};

/// An eventgroup of a needed service, to be subscribed to whenever the service is there.
struct Subscription {
  EventgroupId eventgroup{};
  std::span<const MethodId> events{};  ///< those wanted; empty: all that the server sends of this service
  std::optional<std::uint32_t> ttl_s{};
  std::optional<Duration> silence_timeout{};  ///< see sd::EventgroupRequest
};

/// A service to call and to subscribe to.
struct Need {
  ServiceId service{};
  InstanceId instance = someip::any_instance;  ///< one instance, if there are subscriptions
  std::uint8_t major = 1;
  std::uint32_t minor = sd::any_minor;
  /// UDP port at the device's address that calls leave from and events come to: not SD's.
  std::uint16_t port = 0;
  /// How many bytes of datagrams to that port the firmware can hold until it polls. Servers that know
  /// sd::receive_buffer_key send segments in bursts that fill a quarter of this, but at least 4 segments;
  /// firmware that can hold less needs a server with an explicit burst. 0: servers are not told.
  std::uint32_t receive_buffer_bytes = 0;
  std::span<const Subscription> subscriptions{};
};

/// How much a device can hold. More is refused with an error, or dropped and counted. See memory_bytes().
struct Limits {
  std::uint16_t services = 4;
  std::uint16_t eventgroups = 8;  ///< of all services
  std::uint16_t events = 16;      ///< events and fields of all services
  /// Of all eventgroups; a client that subscribes to two counts twice.
  std::uint16_t subscribers = 16;
  /// Other nodes that are kept in mind. The one silent for longest, that nothing depends on, makes room.
  std::uint16_t peers = 8;
  std::uint16_t needs = 0;
  std::uint16_t subscriptions = 0;    ///< of all needs
  std::uint16_t remote_services = 0;  ///< that others offer: at least as many as needs, if there are any
  std::uint16_t calls = 0;            ///< outstanding at a time
  /// Discovery entries that wait to be sent, at least services + subscriptions. A client that subscribes to
  /// this many eventgroups at once gets all Acks.
  std::uint16_t pending_entries = 8;
  /// What discovery tells at once: a peer's reboot needs one for each of its subscriptions and services.
  std::uint16_t pending_events = 8;
  /// Messages that wait to be sent, at least 2. An event to many subscribers is one.
  std::uint16_t sends = 8;
  /// Bytes for copies of their payloads. The application must keep a larger payload until SendFinished.
  std::uint16_t send_bytes = 512;
  std::uint16_t tp_buffers = 1;          ///< large messages being received at a time
  std::uint32_t tp_buffer_bytes = 8192;  ///< the largest of them

  friend constexpr bool operator==(const Limits&, const Limits&) = default;
};

/// What a device is told at its start.
struct Settings {
  /// `unicast` is the device's address, and `seed` its randomness: two devices need different ones.
  sd::Settings discovery{};
  std::span<const Service> services{};
  std::span<const Need> needs{};
  /// Names this client among those of the same address.  [feat_req_someip_699]
  ClientId client{1};
  /// Of messages that do not fit a datagram: so many segments to each receiver, then a pause. One large
  /// message is sent at a time; small ones pass it.  [feat_req_someiptp_801]
  someip::TpPacing pacing{.burst = 4, .separation = std::chrono::milliseconds{1}};
  Duration reassembly_timeout = std::chrono::seconds{1};
};

}  // namespace trestle::device
