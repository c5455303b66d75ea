#include "ets_application.hpp"

#include <algorithm>

#include <trestle/someip/core/e2e/layout.hpp>
#include <trestle/someip/core/request_check.hpp>
#include <trestle/someip/wire/header.hpp>

namespace trestle::example {
namespace {

namespace e2e = someip::e2e;
using device::EventgroupId;
using device::InstanceId;
using device::MethodId;
using someip::MethodKind;
using someip::ReturnCode;

// Places in the tables below.
constexpr std::size_t testability = 0;
constexpr std::size_t used_by_itself = 0;
constexpr std::size_t found_when_told = 1;
constexpr std::size_t subscribed_when_told = 2;

constexpr std::uint16_t port = 30501;
constexpr std::uint16_t port_of_second_instance = 30502;
constexpr std::uint16_t port_of_old_and_new = 30503;
constexpr std::uint16_t own_client_port = 30521;
constexpr std::uint16_t told_client_port = 30522;

// Where values of fields are kept. Only the device writes there, also what they are at first: see start().
constinit std::array<std::byte, 1> uint8_value{};
constinit std::array<std::byte, 256> array_value{};
constinit std::array<std::byte, 1> quiet_value{};
constinit std::array<std::byte, 1> version_value{};

// With their types written out: GCC 12 puts constants of a deduced type into RAM.
constexpr std::array<EventgroupId, 1> group_2{EventgroupId{2}};
constexpr std::array<EventgroupId, 1> group_5{EventgroupId{5}};
constexpr std::array<EventgroupId, 2> groups_2_and_5{EventgroupId{2}, EventgroupId{5}};
constexpr std::array<sd::Eventgroup, 2> groups{sd::Eventgroup{.id = group_2[0]},
                                               sd::Eventgroup{.id = group_5[0]}};

constexpr std::array<device::Event, 3> events{
    device::Event{.id = ets::event_uint8, .eventgroups = group_2},
    device::Event{.id = ets::event_array, .eventgroups = group_2},
    device::Event{.id = ets::event_e2e_shaped, .eventgroups = group_2}};

constexpr device::Field field(std::size_t place, std::span<const EventgroupId> eventgroups, ByteSpan room) {
  const ets::FieldOfInterface& one = ets::fields[place];
  return {.getter = one.getter,
          .setter = one.setter.value_or(MethodId{0}),
          .notifier = one.notifier.value_or(MethodId{0}),
          .eventgroups = eventgroups,
          .room = room};
}
constexpr std::array<device::Field, 4> fields{field(0, groups_2_and_5, uint8_value),
                                              field(1, group_5, array_value), field(2, {}, quiet_value),
                                              field(3, {}, version_value)};
static_assert(fields.size() == ets::fields.size());

constexpr std::array<MethodId, 5> orders{ets::reset_interface, ets::suspend_interface, ets::client_activate,
                                         ets::client_deactivate, ets::client_subscribe};

constexpr bool is_here(const ets::Trigger& trigger) {
  return std::ranges::find(events, trigger.event, &device::Event::id) != events.end();
}

constexpr std::size_t method_count =
    orders.size() + 1 + ets::echoes.size() + ets::protected_echoes.size() + events.size();
constexpr std::array<device::Method, method_count> all_methods() {
  std::array<device::Method, method_count> all{};
  auto next = all.begin();
  const auto add = [&](MethodId id, MethodKind kind) { *next++ = {.id = id, .kind = kind}; };
  for (const MethodId id : orders) {
    add(id, MethodKind::fire_and_forget);
  }
  for (const ets::Trigger& one : ets::triggers) {
    if (is_here(one)) {
      add(one.method, MethodKind::fire_and_forget);
    }
  }
  add(ets::last_value_udp, MethodKind::request_response);
  for (const MethodId id : ets::echoes) {
    add(id, MethodKind::request_response);
  }
  for (const MethodId id : ets::protected_echoes) {
    add(id, MethodKind::request_response);
  }
  return all;
}
constexpr std::array<device::Method, method_count> methods = all_methods();

constexpr std::array<device::Method, 1> one_echo{device::Method{.id = ets::echo_uint8}};
constexpr device::Service companion(device::ServiceId id, std::uint16_t instance, std::uint16_t at) {
  return {.service = id, .instance = InstanceId{instance}, .port = at, .methods = one_echo};
}
constexpr device::Service newer() {
  device::Service service = companion(ets::old_and_new, 1, port_of_old_and_new);
  service.major = 2;
  service.minor = 7;
  return service;
}
constexpr std::array<device::Service, EtsApplication::limits.services> service_table{
    device::Service{.service = ets::service,
                    .instance = InstanceId{1},
                    .port = port,
                    .methods = methods,
                    .events = events,
                    .fields = fields,
                    .eventgroups = groups},
    companion(ets::service, 2, port_of_second_instance), companion(ets::second_service, 1, port),
    companion(ets::old_and_new, 1, port_of_old_and_new), newer()};

constexpr std::array<MethodId, 1> wanted_events{MethodId{0x8001}};
constexpr std::array<device::Subscription, 1> wanted{
    device::Subscription{.eventgroup = EventgroupId{1}, .events = wanted_events}};
constexpr std::array<device::Need, EtsApplication::limits.needs> need_table{
    device::Need{.service = ets::used_by_itself,
                 .instance = InstanceId{1},
                 .port = own_client_port,
                 .subscriptions = wanted},
    device::Need{.service = ets::used_when_told, .instance = InstanceId{1}, .port = told_client_port},
    device::Need{.service = ets::used_when_told,
                 .instance = InstanceId{1},
                 .port = told_client_port,
                 .subscriptions = wanted}};

/// A header as it is sent. Its second half is protected along with the payload.
class EncodedHeader {
 public:
  EncodedHeader(const someip::Header& header, std::size_t payload_bytes) noexcept {
    static_cast<void>(someip::encode_header(header, payload_bytes, bytes_));
  }
  [[nodiscard]] ByteView protected_part() const noexcept { return ByteView{bytes_}.subspan(8); }

 private:
  std::array<std::byte, someip::header_bytes> bytes_{};
};

}  // namespace

std::span<const device::Service> EtsApplication::services() noexcept {
  return service_table;
}

std::span<const device::Need> EtsApplication::needs() noexcept {
  return need_table;
}

device::Result<void> EtsApplication::start(TimePoint now) noexcept {
  for (std::size_t place = 0; place < service_table.size(); ++place) {
    if (const auto offered = device_.offer(place, now); !offered) {
      return offered;
    }
  }
  if (const auto set = reset_fields(); !set) {
    return set;
  }
  return device_.require(used_by_itself, now);
}

void EtsApplication::on_time(TimePoint now) noexcept {
  while (const ets::Trigger* const due = schedule_.next(now)) {
    // Where there is no room, or the service is suspended, this one is left out.
    static_cast<void>(device_.notify(testability, due->event, due->payload));
  }
  if (offered_again_ && is_due(*offered_again_, now)) {
    offered_again_.reset();
    static_cast<void>(device_.offer(testability, now));
  }
}

void EtsApplication::on(const device::Happening& happening, TimePoint now) noexcept {
  if (const auto* request = std::get_if<device::Request>(&happening)) {
    on_request(*request, now);
  } else if (const auto* sent = std::get_if<device::SendFinished>(&happening)) {
    for (Answer& one : answers_) {
      one.is_being_sent = one.is_being_sent && one.bytes.data() != sent->payload;
    }
  } else if (const auto* event = std::get_if<device::EventReceived>(&happening)) {
    if (event->need == subscribed_when_told && !event->payload.empty()) {
      last_value_ = std::to_integer<std::uint8_t>(event->payload.front());
    }
  }
}

void EtsApplication::on_request(const device::Request& request, TimePoint now) noexcept {
  const MethodId method = request.header.method;
  if (const auto trigger = std::ranges::find(ets::triggers, method, &ets::Trigger::method);
      trigger != ets::triggers.end()) {
    schedule_.trigger(*trigger, request.payload, now);
    return;
  }
  switch (method) {
    case ets::reset_interface:
      static_cast<void>(reset_fields());
      break;
    case ets::suspend_interface:
      device_.withdraw(testability, now);
      offered_again_ = now + ets::suspended_for;
      break;
    case ets::client_activate:  // what is there already is left as it is, here and below
      static_cast<void>(device_.require(found_when_told, now));
      break;
    case ets::client_deactivate:
      device_.release(found_when_told, now);
      device_.release(subscribed_when_told, now);
      break;
    case ets::client_subscribe:
      static_cast<void>(device_.require(subscribed_when_told, now));
      break;
    case ets::last_value_udp: {
      const std::array<std::byte, 1> value{std::byte{last_value_}};
      static_cast<void>(device_.respond(request, value));
      break;
    }
    default:
      if (ets::is_protected(method)) {
        protected_echo(request);
      } else {
        echo(request);
      }
      break;
  }
}

void EtsApplication::echo(const device::Request& request) noexcept {
  if (request.payload.size() + ets::room_beside <= small_answer_bytes) {
    std::array<std::byte, small_answer_bytes> room{};
    static_cast<void>(echo(request, room));
  } else {
    echo_large(request);
  }
}

void EtsApplication::echo_large(const device::Request& request) noexcept {
  const auto room = std::ranges::find(answers_, false, &Answer::is_being_sent);
  if (room == answers_.end()) {
    refuse(request, ReturnCode::not_ready);
    return;
  }
  room->is_being_sent = echo(request, room->bytes);
}

/// @return whether `room` is needed until SendFinished tells that it is not any more.
bool EtsApplication::echo(const device::Request& request, ByteSpan room) noexcept {
  std::array<char, text_bytes> text{};
  const auto answer = ets::echo(request.header.method, request.payload, {.answer = room, .text = text});
  if (!answer) {
    refuse(request, answer.error());
    return false;
  }
  return device_.respond(request, *answer).has_value() && answer->size() > device_.max_copied_bytes();
}

/// An answer repeats the counter and the source of its request: so each client sees a sequence of its own.
void EtsApplication::protected_echo(const device::Request& request) noexcept {
  const MethodId method = request.header.method;
  const e2e::Config& config = ets::protection_of(method);
  const e2e::CheckResult checked = check(request);
  const auto layout = e2e::make_layout(config);
  auto protector = e2e::Protector::create(config);
  const std::size_t header_bytes = layout ? layout->header_bytes().value_or(0) : 0;
  if (const ReturnCode code = code_of(checked.status); code != ReturnCode::ok || !protector) {
    refuse(request, code);
    return;
  }
  std::array<std::byte, 64> room{};
  const auto content = ets::echo(method, request.payload.subspan(header_bytes),
                                 {.answer = std::span{room}.subspan(header_bytes), .text = {}});
  if (!content) {
    refuse(request, content.error());
    return;
  }
  const ByteSpan payload = std::span{room}.first(header_bytes + content->size());
  const EncodedHeader header{someip::answer_header(request.header, ReturnCode::ok, {}), payload.size()};
  protector->resume(checked.counter);
  if (protector->protect(header.protected_part(), payload,
                         {.response = true, .source_id = checked.source_id})) {
    static_cast<void>(device_.respond(request, payload));
  } else {
    refuse(request, ReturnCode::not_ok);
  }
}

e2e::CheckResult EtsApplication::check(const device::Request& request) noexcept {
  const MethodId method = request.header.method;
  Protection& protection = protections_[ets::place_of_protected(method)];
  const EncodedHeader header{request.header, request.payload.size()};
  if (protection.checker && protection.client == request.from &&
      protection.client_id == request.header.client) {
    return protection.checker->check(header.protected_part(), request.payload);
  }
  auto checker = e2e::Checker::create(ets::protection_of(method));
  if (!checker) {
    return {.status = e2e::CheckStatus::error};
  }
  const e2e::CheckResult result = checker->check(header.protected_part(), request.payload);
  if (result.fault == e2e::Fault::none) {  // else anybody could make it forget the client before
    protection = {.checker = *checker, .client = request.from, .client_id = request.header.client};
  }
  return result;
}

void EtsApplication::refuse(const device::Request& request, ReturnCode code) noexcept {
  static_cast<void>(device_.respond_error(request, code));  // full: the client's call times out
}

/// Gives them their first values. Each gets its own, whatever happens to another.
device::Result<void> EtsApplication::reset_fields() noexcept {
  device::Result<void> result;
  for (std::size_t place = 0; place < ets::fields.size(); ++place) {
    if (const auto set = device_.set_field(testability, place, ets::fields[place].initial); !set) {
      result = set;
    }
  }
  return result;
}

}  // namespace trestle::example
