#pragma once
#include <variant>

#include "sd/core/device/description.hpp"
#include "someip/core/call_table.hpp"

namespace trestle::device {

/// What a device tells the application. `service` and `need` are the places in the tables of Settings.
/// Payloads are valid until the next call of on_datagram(), poll_event() or poll_transmit().

/// A method is called, or a judged setter. To be answered once, now or later, if `header.type` is request;
/// it may be kept for that, without the payload.
struct Request {
  std::size_t service = 0;
  someip::Header header{};
  Endpoint from{};
  ByteView payload{};
};

/// A setter has set a field, that everybody has been told of.
struct FieldSet {
  std::size_t service = 0;
  std::size_t field = 0;  ///< its place in Service::fields
  ByteView value{};
};

/// An event or notifier of a subscription of ours has come.
struct EventReceived {
  std::size_t need = 0;
  std::size_t subscription = 0;  ///< its place in Need::subscriptions
  someip::Header header{};
  ByteView payload{};
};

/// A call of ours has ended: by a response, an error, or because no answer came in time. Told once for each
/// call that was not cancelled.
struct CallEnded {
  someip::CallHandle call{};
  bool answered = false;  ///< else no answer came in time  [feat_req_someip_436]
  someip::ReturnCode code = someip::ReturnCode::timeout;
  ByteView payload{};
};

/// A needed service is offered by somebody, or its offer changed.
struct ServiceAvailable {
  std::size_t need = 0;
  sd::RemoteService service{};
};
/// A needed service is not offered any more.
struct ServiceLost {
  std::size_t need = 0;
  sd::RemoteService service{};
  sd::LossReason reason{};
};

/// The server accepted a subscription.
struct Subscribed {
  std::size_t need = 0;
  std::size_t subscription = 0;
  /// Where it sends multicast events to: join the group, and give the device what comes from there.
  std::optional<Endpoint> multicast{};
};
/// The server refused a subscription (Nack), perhaps one that it had accepted before.
struct SubscriptionRefused {
  std::size_t need = 0;
  std::size_t subscription = 0;
};
/// A subscription that was accepted has ended.
struct SubscriptionLost {
  std::size_t need = 0;
  std::size_t subscription = 0;
  sd::LossReason reason{};
};

/// Somebody subscribed to an eventgroup of ours. Initial events leave by themselves.
struct SubscriberAdded {
  std::size_t service = 0;
  EventgroupId eventgroup{};
  Endpoint subscriber{};  ///< where it receives events
  bool again = false;  ///< it was there already, and wants the initial events anew  [feat_req_someipsd_1188]
};
/// A subscriber of ours has ended its subscription, or lost it.
struct SubscriberRemoved {
  std::size_t service = 0;
  EventgroupId eventgroup{};
  Endpoint subscriber{};
  sd::LossReason reason{};
};

/// A service that is now offered has an id that other stacks may refuse: a reserved one, or one that is meant
/// for the other kind, such as an event below 0x8000.  [feat_req_someip_626] [feat_req_someipids_636]
struct UnusualId {
  std::size_t service = 0;
  MethodId id{};
};

/// A large payload is not needed any more: it was sent, or there is nobody to send it to.
struct SendFinished {
  const std::byte* payload = nullptr;  ///< where the one given began
};

using Happening = std::variant<Request, FieldSet, EventReceived, CallEnded, ServiceAvailable, ServiceLost,
                               Subscribed, SubscriptionRefused, SubscriptionLost, SubscriberAdded,
                               SubscriberRemoved, SendFinished, UnusualId>;

/// Why a call of the application was refused; nothing has changed then.
enum class Error : std::uint8_t {
  bad_argument,  ///< no such service, method, event, field or need, or a description that cannot be:
                 ///< Device::bad_argument() says which
  table_full,    ///< a limit for it is reached
  duplicate,     ///< it is offered or needed already
  not_offered,   ///< the service is not offered now
  unavailable,   ///< nobody offers the needed service now
  no_room,       ///< too much waits to be sent: poll_transmit() makes room
  busy,          ///< the field's value is being sent, in segments
  too_large,     ///< more than the field's room, or than TP can carry
};

/// The error's name as it stands above, for logs.
[[nodiscard]] const char* to_string(Error error) noexcept;

/// A value, or why there is none.
template <typename T>
using Result = tl::expected<T, Error>;

/// What happened since construction, besides what discovery, reassembly and calls count. Modulo 2^32.
struct Counters {
  std::uint32_t datagrams_received = 0;  ///< discovery's left out
  std::uint32_t datagrams_sent = 0;      ///< likewise
  std::uint32_t requests = 0;            ///< given to the application, or done for a field
  std::uint32_t events = 0;              ///< given to the application
  std::uint32_t requests_answered = 0;   ///< with an error, without asking the application

  // Dropped on reception.
  std::uint32_t malformed = 0;        ///< datagrams that are empty, or bad from some message on
  std::uint32_t unexpected = 0;       ///< no request for us, no event subscribed to, no answer to a call
  std::uint32_t unknown_sender = 0;   ///< a subscribed event from a peer that does not offer it
  std::uint32_t wrong_version = 0;    ///< an event of another interface or protocol version
  std::uint32_t bad_return_code = 0;  ///< an event with one  [feat_req_someip_683]
  std::uint32_t not_polled = 0;       ///< datagrams that were not polled to their end
  std::uint32_t not_reassembled = 0;  ///< segments refused; reassembly() tells why

  // Not sent.
  std::uint32_t send_queue_full = 0;  ///< answers and initial events
  std::uint32_t room_too_small = 0;   ///< messages larger than the room given to poll_transmit()
};

/// A datagram to be sent from the device's address and the port `from_port`.
struct Transmit {
  std::uint16_t from_port = 0;
  Endpoint destination{};
  ByteView bytes{};  ///< at the front of the room given to poll_transmit()
};

}  // namespace trestle::device
