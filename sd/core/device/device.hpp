// sd/core/device: a whole SOME/IP device over UDP in one object, for firmware. Same rules as sd/core.
//
//   device.hpp       the object: services, events, fields, calls, subscriptions, segments
//   description.hpp  what it offers and needs, as constants that may lie in flash memory
//   happenings.hpp   what it tells the application
//   memory.hpp       its memory: sizes are limits; memory_bytes() says what they cost
//   argument.hpp     what is wrong with an argument
//
// sd/c is the same for programs in C. docs/embedding.md explains both.
#pragma once
#include "sd/core/device/argument.hpp"
#include "sd/core/device/happenings.hpp"
#include "sd/core/device/memory.hpp"
#include "sd/core/device/send_queue.hpp"

namespace trestle::device {

// clang-format off
/// A whole SOME/IP device over UDP for a microcontroller: offers services by SD, answers their methods and
/// fields, sends events to subscribers, finds, calls and subscribes to the services of others; large messages
/// in segments (TP), both ways. Without I/O, clock, threads, heap, exceptions and RTTI.
///
///     constexpr std::array in_group_1{EventgroupId{1}};
///     constexpr std::array groups{sd::Eventgroup{.id = EventgroupId{1}}};
///     constexpr std::array methods{device::Method{.id = MethodId{1}}};
///     constexpr std::array events{device::Event{.id = MethodId{0x8001}, .eventgroups = in_group_1}};
///     constexpr std::array services{device::Service{.service = ServiceId{0x1234}, .instance = InstanceId{1},
///         .port = 30501, .methods = methods, .events = events, .eventgroups = groups}};
///
///     device::Settings settings;  // also: settings.discovery.seed, unlike that of other devices
///     settings.discovery.unicast = {IpAddress::v4(192, 0, 2, 10), 30490};
///     settings.services = services;
///     static device::StaticDevice<device::Limits{.services = 1, .subscribers = 4}> device{settings};
///     static_cast<void>(device.offer(0, now()));  // the first of `services`
///     for (;;) {  // on each datagram, and at device.deadline()
///       if (received) {
///         device.on_datagram(bytes, from, to, now());  // `to`: own address or group, and port
///       }
///       device.on_time(now());
///       for (;;) {  // first send, then look at one happening, and so on
///         while (const auto out = device.poll_transmit(room, now())) { udp_send(*out); }
///         const auto what = device.poll_happening();
///         if (!what) { break; }
///         if (const auto* request = std::get_if<device::Request>(&*what)) {
///           static_cast<void>(device.respond(*request, answer));
///         }
///       }
///       if (each_100_ms) { static_cast<void>(device.notify(0, MethodId{0x8001}, value)); }
///     }
///
/// The firmware opens UDP sockets for SD's port (which also joins SD's group) and for the ports of services
/// and needs. In that order, as an Ack must leave before initial events; and the memory of a datagram must
/// stay as it is until poll_happening() has returned nothing. `now` must not go back from call to call.
///
/// Not here: TCP, multicast events of own services, end-to-end protection (trestle::someip_e2e can do that to
/// payloads), cyclic sending. Not thread-safe.
// clang-format on
class Device {
 public:
  /// @param memory  of lay_out(); its sizes are the limits.
  Device(const Settings& settings, const MemoryView& memory) noexcept;
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  // --- Server ---------------------------------------------------------------------------------------------

  /// Starts to offer the service at this place of Settings::services.  [feat_req_someipsd_22] Reserved ids
  /// and those meant for the other kind (an event below 0x8000, say) are taken: see UnusualId.
  /// @return `bad_argument`  no such service, or its description cannot be: an id or port that is none, SD's
  ///                         port, an eventgroup by TCP or multicast, an event in an eventgroup that the
  ///                         service has not, an initial value larger than its room, an id that is there
  ///                         twice;
  ///         `duplicate`     it is offered already, or another instance of it at that port;
  ///         `table_full`    more services, eventgroups, or events and fields than Limits have.
  [[nodiscard]] Result<void> offer(std::size_t service, TimePoint now) noexcept;

  /// Withdraws it; its subscribers are told nothing else. Without effect when it is not offered.
  void withdraw(std::size_t service, TimePoint now) noexcept;

  /// Sends an event to its subscribers, each once.  [feat_req_someipsd_1168]
  ///
  /// @param payload  copied up to max_copied_bytes(). A larger one must stay as it is until SendFinished.
  /// @return bad_argument (also: the notifier of a field), not_offered, no_room, too_large. Without
  ///         subscribers all is well, and no SendFinished comes.
  [[nodiscard]] Result<void> notify(std::size_t service, MethodId event, ByteView payload) noexcept;

  /// Sets a field, and tells its subscribers if it differs.  [feat_req_someip_635]
  /// @param field  its place in Service::fields.
  /// @return bad_argument, not_offered, too_large for its room, no_room to tell, or busy: the old value is
  ///         being sent in segments.
  [[nodiscard]] Result<void> set_field(std::size_t service, std::size_t field, ByteView value) noexcept;

  /// The value of a field; nothing when there is none, or the service is not offered.
  [[nodiscard]] std::optional<ByteView> field(std::size_t service, std::size_t field) const noexcept;

  /// Answers a request with success. Nothing is sent for fire and forget.
  /// @param payload  as for notify().
  /// @return no_room, too_large, bad_argument for a service that is none.
  [[nodiscard]] Result<void> respond(const Request& request, ByteView payload) noexcept;
  /// Answers it with an error; not ReturnCode::ok. Nothing is sent to requests that may not be answered so.
  /// [feat_req_someip_655] [feat_req_someip_597]
  /// @param payload  only where the interface says so; at most max_copied_bytes().
  [[nodiscard]] Result<void> respond_error(const Request& request, someip::ReturnCode code,
                                           ByteView payload = {}) noexcept;
  /// Answers the request of a judged setter with `value`, sets the field to it, and tells its subscribers.
  /// [feat_req_someip_634] Errors as of set_field().
  [[nodiscard]] Result<void> accept(const Request& request, ByteView value) noexcept;

  /// The largest payload that is copied: Limits::send_bytes, but no more than a datagram holds.
  [[nodiscard]] std::size_t max_copied_bytes() const noexcept { return queue_.max_copied_bytes(); }

  /// How many endpoints get an event or notifier.
  [[nodiscard]] std::size_t subscribers(std::size_t service, MethodId event) const noexcept;

  // --- Client ---------------------------------------------------------------------------------------------

  /// Starts to look for the service at this place of Settings::needs, and subscribes when it is there.
  /// [feat_req_someipsd_18]
  /// @return bad_argument  no such need, ids or a port that are none, SD's port, or subscriptions without a
  ///                       certain instance;
  ///         duplicate     it is looked for already;
  ///         table_full    more needs or subscriptions than Limits have.
  [[nodiscard]] Result<void> require(std::size_t need, TimePoint now) noexcept;
  /// Ends that, and its subscriptions. Calls under way go on.
  void release(std::size_t need, TimePoint now) noexcept;

  /// Calls a method, a getter or a setter.  CallEnded tells how it ended.
  /// @param payload  as for notify().
  /// @return bad_argument, unavailable, table_full (calls), no_room, too_large.
  [[nodiscard]] Result<someip::CallHandle> call(std::size_t need, MethodId method, ByteView payload,
                                                Duration timeout, TimePoint now) noexcept;
  /// Fire and forget. Errors as of call().
  [[nodiscard]] Result<void> tell(std::size_t need, MethodId method, ByteView payload) noexcept;
  /// The end of a call is not awaited any more.
  /// @return false for one that has ended.
  bool cancel(someip::CallHandle call) noexcept;
  /// Whether the needed service is there to be called.
  [[nodiscard]] bool available(std::size_t need) noexcept;

  // --- Both -----------------------------------------------------------------------------------------------

  /// The link went down: subscribers and found services are lost, and what waits is not sent.
  /// [feat_req_someipsd_23] [feat_req_someipsd_437]
  void link_down() noexcept;
  /// It is up, as it is after construction.  [feat_req_someipsd_436] [feat_req_someipsd_440]
  void link_up(TimePoint now) noexcept;
  /// Withdraws all that is offered and needed: drain poll_transmit() once more. What arrives later is
  /// ignored. [feat_req_someipsd_821]
  void shutdown(TimePoint now) noexcept;

  /// Takes a datagram. If the one before was not polled to its end, its rest is lost.
  /// @param datagram  must stay as it is until poll_happening() has returned nothing.
  /// @param to  where it was sent to: the own address, or a group that was joined, and the port.
  void on_datagram(ByteView datagram, const Endpoint& from, const Endpoint& to, TimePoint now) noexcept;

  /// Nobody listens there for events or answers (ICMP): its subscriptions end.  [feat_req_someipsd_435]
  void unreachable(const Endpoint& receiver) noexcept { discovery_.unreachable(receiver); }

  /// Does what is due. Early and repeated calls change nothing.
  void on_time(TimePoint now) noexcept;

  /// The next datagram to send now, or nothing. Here the messages of the last datagram are looked at.
  /// @param room  bounds it: datagram_bytes hold any.
  [[nodiscard]] std::optional<Transmit> poll_transmit(ByteSpan room, TimePoint now) noexcept;
  static constexpr std::size_t datagram_bytes = someip::header_bytes + someip::max_plain_payload_bytes;

  /// The next happening, or nothing. To be asked when poll_transmit() has nothing more, and then that again.
  [[nodiscard]] std::optional<Happening> poll_happening() noexcept;

  /// When to call on_time() and poll again, in the past if something can be polled now; nothing: wait for a
  /// datagram or a call.
  [[nodiscard]] std::optional<TimePoint> deadline() const noexcept;

  /// Which argument was wrong of the last call that was refused as bad_argument, or which member of the
  /// description that the call was about.
  [[nodiscard]] const BadArgument& bad_argument() const noexcept { return bad_argument_; }

  [[nodiscard]] const Counters& counters() const noexcept { return counters_; }
  [[nodiscard]] const sd::SdCounters& discovery() const noexcept { return discovery_.counters(); }
  [[nodiscard]] const someip::TpCounters& reassembly() const noexcept { return reassembler_.counters(); }
  /// All 0 without room for calls.
  [[nodiscard]] someip::CallCounters calls() const noexcept {
    return calls_ ? calls_->counters() : someip::CallCounters{};
  }

 private:
  using Ready = std::variant<std::monostate, Request, FieldSet, EventReceived, CallEnded>;
  struct Found {
    std::size_t need;
    std::size_t subscription;
  };

  static constexpr std::size_t max_payload_bytes = 0xffff'ffff - someip::length_covered_header_bytes;

  // device.cpp
  tl::unexpected<Error> bad(const BadArgument& argument) noexcept;
  tl::unexpected<Error> bad(Argument argument) noexcept { return bad(BadArgument{argument}); }
  [[nodiscard]] bool may_be_port(std::uint16_t port) const noexcept;
  void drop_rest() noexcept;
  bool take_message(TimePoint now) noexcept;
  [[nodiscard]] bool admit(const someip::Header& header) noexcept;
  void forget_large(const IpAddress& sender, TimePoint now) noexcept;
  void on_message(const someip::Message& message, TimePoint now) noexcept;
  [[nodiscard]] Result<void> check_payload(ByteView payload) const noexcept;
  void answer(const someip::Header& header, ByteView payload) noexcept;
  [[nodiscard]] std::optional<Happening> happening_of(const sd::Happening& event) noexcept;

  // server.cpp
  [[nodiscard]] bool is_offered(std::size_t service) const noexcept;
  [[nodiscard]] std::size_t first_event(std::size_t service) const noexcept;
  [[nodiscard]] EventSlot& field_slot(std::size_t service, std::size_t field) const noexcept;
  [[nodiscard]] bool is_receiver(std::size_t service, std::span<const EventgroupId> groups,
                                 std::size_t place) const noexcept;
  [[nodiscard]] std::size_t count_receivers(std::size_t service,
                                            std::span<const EventgroupId> groups) const noexcept;
  [[nodiscard]] someip::Header event_header(std::size_t service, MethodId event,
                                            EventSlot& slot) const noexcept;
  void send_event(std::size_t service, const someip::Header& header, std::span<const EventgroupId> groups,
                  ByteView payload, SendQueue::Payload kind) noexcept;
  void send_initial_events(std::size_t service, EventgroupId eventgroup, const Endpoint& receiver) noexcept;
  [[nodiscard]] Result<void> check_value(std::size_t service, std::size_t field, ByteView value,
                                         std::size_t answers) const noexcept;
  void store(std::size_t service, std::size_t field, ByteView value) noexcept;
  /// Whether this is a request, or a segment of one, to a method that is offered where it came.
  [[nodiscard]] bool takes(const someip::Header& header) const noexcept;
  void on_request(const someip::Message& message) noexcept;
  void handle(const Request& request) noexcept;
  void refuse(const Request& request, someip::ReturnCode code) noexcept;
  void set(const Request& request, std::size_t field) noexcept;
  void accept_value(const Request& request, std::size_t field, ByteView value) noexcept;
  std::optional<Happening> next_unusual_id() noexcept;
  [[nodiscard]] std::optional<std::size_t> service_of(sd::OfferHandle offer) const noexcept;
  std::optional<Happening> on_event(const sd::SubscriberAdded& event) noexcept;
  std::optional<Happening> on_event(const sd::InitialDataRequested& event) noexcept;
  std::optional<Happening> on_event(const sd::SubscriberRemoved& event) noexcept;

  // client.cpp
  tl::unexpected<Error> refused(sd::SdError error) noexcept;
  [[nodiscard]] bool is_needed(std::size_t need) const noexcept;
  [[nodiscard]] std::span<SubscriptionSlot> subscriptions_of(std::size_t need) const noexcept;
  [[nodiscard]] std::optional<sd::RemoteService> server_of(std::size_t need) noexcept;
  [[nodiscard]] Result<sd::RemoteService> way_to(std::size_t need, ByteView payload) noexcept;
  void on_answer(const someip::Message& message) noexcept;
  [[nodiscard]] std::optional<Found> find_subscription(const someip::Header& header) noexcept;
  void on_notification(const someip::Message& message, TimePoint now) noexcept;
  [[nodiscard]] std::optional<std::size_t> need_of(sd::RequirementHandle requirement) const noexcept;
  [[nodiscard]] std::optional<Found> subscription_of(sd::SubscriptionHandle handle) const noexcept;
  std::optional<Happening> on_event(const sd::ServiceAvailable& event) noexcept;
  std::optional<Happening> on_event(const sd::ServiceLost& event) noexcept;
  std::optional<Happening> on_event(const sd::Subscribed& event) noexcept;
  std::optional<Happening> on_event(const sd::SubscriptionRefused& event) noexcept;
  std::optional<Happening> on_event(const sd::SubscriptionLost& event) noexcept;
  std::optional<Happening> on_event(const sd::ConnectionOutdated& event) noexcept;

  Endpoint own_;  // of discovery
  std::span<const Service> services_;
  std::span<const Need> needs_;
  ClientId client_;
  std::span<ServiceSlot> service_slots_;
  std::span<EventSlot> event_slots_;
  std::span<NeedSlot> need_slots_;
  std::span<SubscriptionSlot> subscription_slots_;
  std::span<std::uint16_t> timed_out_;
  std::size_t max_subscribers_;
  sd::ServiceDiscovery discovery_;
  std::optional<someip::CallTable> calls_;
  std::span<std::uint32_t> tp_senders_;
  someip::TpReassembler reassembler_;
  SendQueue queue_;
  Counters counters_;
  BadArgument bad_argument_;
  someip::SessionCounter tell_sessions_;
  // The datagram that is being polled.
  Endpoint from_;
  Endpoint to_;
  someip::MessageCursor incoming_{{}};
  Ready ready_;
};

namespace detail {
/// The memory of a StaticDevice: a base, so that it exists before the Device that uses it.
template <Limits limits>
struct DeviceMemory {
  static_assert(are_possible(limits), "limits that break their own rules, see are_possible()");
  alignas(memory_alignment) std::array<std::byte, memory_bytes(limits)> bytes;
};
}  // namespace detail

/// A Device with its memory: sizeof() is all the RAM that it takes, but for values of fields and the stack.
template <Limits limits = Limits{}>
class StaticDevice : private detail::DeviceMemory<limits>, public Device {
 public:
  explicit StaticDevice(const Settings& settings) noexcept
      : Device{settings, *lay_out(limits, detail::DeviceMemory<limits>::bytes)} {}
};

}  // namespace trestle::device
